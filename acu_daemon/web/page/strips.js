"use strict";
// Strips of the last minutes, the timeline of the pass, how late the ticks came.
const STRIP_S = 300, STRIP_W = 300, STRIP_H = 80;
const STRIPS = [
  { name: "off the path", unit: "beamwidths", at: [1], low: 0, least: 0.6, digits: 3, limit: 0.5 },
  { name: "signal", unit: "dB", at: [2], least: 6, digits: 1 },
  { name: "lag azimuth, elevation (dashed)", unit: "s", at: [4, 5], least: 0.2, digits: 3 },
  { name: "residual", unit: "beamwidths", at: [6], low: 0, least: 0.2, digits: 3 },
];
const strip = [];

function keepRow(row) {
  const last = strip.at(-1);
  if (last && row[0] - last[0] < 0.95 && row[0] >= last[0]) return false;
  if (last && row[0] < last[0]) strip.length = 0;
  strip.push(row);
  while (strip.length && row[0] - strip[0][0] > STRIP_S) strip.shift();
  return true;
}
function rowOf(now) {
  const beam = now.half_beam_deg ? 2 * now.half_beam_deg : null, share = (x) => (beam && x !== null ? x / beam : null);
  return [now.tai_s, share(now.off_path_deg), now.is_link_up ? now.agc_db : null, now.is_acquired ? 1 : 0, now.lag_az_s, now.lag_el_s, share(now.miss_deg)];
}
function makeStrips() {
  for (const one of STRIPS) {
    const box = document.createElement("div");
    box.className = "strip";
    const head = document.createElement("p"), name = document.createElement("span");
    one.value = document.createElement("b");
    name.textContent = `${one.name}, ${one.unit}`;
    head.append(name, one.value);
    one.svg = document.createElementNS(SVG, "svg");
    one.svg.setAttribute("viewBox", `0 0 ${STRIP_W} ${STRIP_H}`);
    one.svg.setAttribute("preserveAspectRatio", "none");
    one.svg.setAttribute("aria-hidden", "true");
    box.append(head, one.svg);
    byId("strip-list").append(box);
  }
}
function drawStrips() {
  if (!strip.length) return;
  const end = strip.at(-1)[0], x = (t) => STRIP_W - ((end - t) * STRIP_W) / STRIP_S;
  for (const one of STRIPS) {
    const values = strip.flatMap((row) => one.at.map((i) => row[i])).filter((v) => v !== null).sort((a, b) => a - b);
    one.svg.replaceChildren();
    const newest = one.at.map((i) => strip.at(-1)[i]);
    one.value.textContent = newest.map((v) => (v === null ? "-" : v.toFixed(one.digits))).join("  ");
    for (const [from, to] of unacquired()) {
      shape(one.svg, "rect", { x: x(from), y: 0, width: Math.max(x(to) - x(from), 1), height: STRIP_H, class: "lost-signal" });
    }
    let low = one.low ?? values[0] ?? 0, high = values.at(-1) ?? 1;
    if (one.limit) high = Math.max(Math.min(high, 4 * one.limit), one.least);
    if (high - low < one.least) [low, high] = one.low === undefined ? [(low + high - one.least) / 2, (low + high + one.least) / 2] : [low, low + one.least];
    const y = (v) => STRIP_H - 4 - ((Math.min(v, high) - low) * (STRIP_H - 8)) / (high - low);
    for (const share of [0, 0.5, 1]) shape(one.svg, "line", { x1: 0, x2: STRIP_W, y1: 4 + share * (STRIP_H - 8), y2: 4 + share * (STRIP_H - 8) });
    if (one.limit) shape(one.svg, "line", { x1: 0, x2: STRIP_W, y1: y(one.limit), y2: y(one.limit), class: "limit" });
    one.at.forEach((i, k) => {
      let d = "", pen = "M";
      for (const row of strip) {
        if (row[i] === null) { pen = "M"; continue; }
        d += `${pen}${x(row[0]).toFixed(1)} ${y(row[i]).toFixed(1)}`;
        pen = "L";
      }
      shape(one.svg, "path", { d, class: k ? "second" : "first" });
    });
  }
}
function unacquired() {
  const spans = [];
  let was = false;
  for (const row of strip) {
    was ||= row[3] === 1;
    if (row[3] === 1 || !was) continue;
    const last = spans.at(-1);
    if (last && row[0] - last[1] < 2.5) last[1] = row[0];
    else spans.push([row[0] - 1, row[0]]);
  }
  return spans;
}

const KINDS = { IDLE: "dim", PREPOSITION: "calm", "ACQUIRE/TLE": "watch", "AUTOTRACK/TLE": "good", "AUTOTRACK/FITTED": "good", PROGRAM: "good", "HOLD/FITTED": "calm", "HOLD/TLE": "watch", SEARCH: "watch", ZENITH: "keyhole", "FALSE-LOCK": "watch", AVOID: "watch", SLAVED: "calm", MANUAL: "dim", STOW: "dim", FAULT: "bad", "LINK-LOST": "bad" };
const TIME_W = 600, TIME_H = 92;
function drawTimeline(now, back, states, ahead) {
  const svg = byId("timeline"), all = group(svg, "times");
  all.replaceChildren();
  if (!back || back.rise_tai_s === null) return;
  const begin = Math.min(back.rise_tai_s - 30, Math.max(states[0]?.from_tai_s ?? Infinity, back.rise_tai_s - 180)), end = back.set_tai_s + 15;
  const x = (t) => (TIME_W * (Math.min(Math.max(t, begin), end) - begin)) / (end - begin);
  const base = TIME_H, y = (el) => base - (Math.max(0, el) * (base - 12)) / 90;
  if (back.track.length) {
    const top = back.track.map(([t, , el]) => [x(t), y(el)]);
    shape(all, "path", { d: `${lineOf([[x(back.rise_tai_s), base], ...top, [x(back.set_tai_s), base]])}z`, class: "profile" });
  }
  const band = (from, to, kind, low, high) => shape(all, "rect", { x: x(from), y: low, width: Math.max(x(to) - x(from), 0.8), height: high - low, class: `k-${kind}` });
  for (const [from, to] of back.hidden_tai_s) band(from, to, "dim", 12, base).setAttribute("fill-opacity", 0.25);
  if (ahead?.crossing_tai_s) band(...ahead.crossing_tai_s, "keyhole", 12, base).setAttribute("fill-opacity", 0.25);
  states.forEach((one, i) => {
    if (one.from_tai_s > end) return;
    const to = Math.min(states[i + 1]?.from_tai_s ?? now.tai_s, end);
    if (to < begin) return;
    band(one.from_tai_s, to, KINDS[one.state] ?? "dim", base + 2, base + 20);
  });
  if (now.inside_s !== null && now.tai_s > begin && now.tai_s < end) band(now.tai_s, now.tai_s + now.inside_s, "trust", base + 4, base + 18).setAttribute("class", "trust");
  if (now.tai_s > begin && now.tai_s < end) shape(all, "line", { x1: x(now.tai_s), x2: x(now.tai_s), y1: 4, y2: base + 22, class: "now-line" });
  const stamp = (utc) => utc.slice(11, 19);
  shape(all, "text", { x: x(back.rise_tai_s), y: base + 34 }, `rise ${stamp(now.rise_utc)}`);
  shape(all, "text", { x: x(back.set_tai_s), y: base + 34, "text-anchor": "end" }, `set ${stamp(now.set_utc)}`);
  if (now.culmination_deg) shape(all, "text", { x: x(back.culmination_tai_s), y: 9, "text-anchor": "middle" }, `${now.culmination_deg.toFixed(0)} deg`);
}
function keyOfTimeline(states) {
  const names = { good: "tracks", calm: "led, sure", watch: "no signal, or unsure", keyhole: "past the zenith", bad: "stopped, or no link", dim: "not steered" };
  const used = new Set(states.map((one) => KINDS[one.state] ?? "dim"));
  const key = byId("timeline-key");
  key.replaceChildren();
  for (const kind of used) {
    const item = document.createElement("span"), colour = document.createElement("i");
    colour.className = `k-${kind}`;
    item.append(colour, names[kind]);
    key.append(item);
  }
}

function drawLateness(late, now) {
  const svg = byId("late-plot"), all = group(svg, "bars"), most = Math.max(1, ...late.counts), total = late.counts.reduce((a, b) => a + b, 0);
  all.replaceChildren();
  late.counts.forEach((count, i) => {
    const height = count ? (8 + 70 * Math.log10(count)) / Math.max(1, Math.log10(most) + 0.01) : 0, x = 4 + i * 27;
    const h = Math.min(height, 78);
    shape(all, "rect", { x, y: 88 - h, width: 24, height: h });
    if (count) shape(all, "text", { x: x + 12, y: 85 - h, "text-anchor": "middle" }, String(count));
    shape(all, "text", { x, y: 98, "text-anchor": "middle" }, String(late.edges_ms[i]));
  });
  shape(all, "text", { x: 296, y: 108, "text-anchor": "end" }, "ms late, ticks of ten minutes, heights logarithmic");
  byId("late-said").textContent = `${total} ticks, 99 of 100 within ${now ? now.lateness_p99_ms.toFixed(2) : "?"} ms`;
}

"use strict";
// The sky, and the beam about the satellite.  North is up; east is right as on a map, or left as one looks up.
const SVG = "http://www.w3.org/2000/svg", HORIZON = 90;
const byId = (id) => document.getElementById(id);
const radians = (degrees) => (degrees * Math.PI) / 180;
let eastSign = 1;

function shape(parent, kind, attributes, text) {
  const one = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) one.setAttribute(name, value);
  if (text !== undefined) one.textContent = text;
  parent.append(one);
  return one;
}
function group(svg, id) {
  return svg.querySelector(`#${id}`) ?? shape(svg, "g", { id });
}
function skyPoint(az, el) {
  const r = (HORIZON * (90 - el)) / 90;
  return [eastSign * r * Math.sin(radians(az)), -r * Math.cos(radians(az))];
}
const put = ([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`;
const lineOf = (points) => (points.length ? `M${points.map(put).join("L")}` : "");
function ring(low, step = 6) {
  const points = [];
  for (let az = 0; az < 360; az += step) points.push(skyPoint(az, typeof low === "number" ? low : low(az)));
  return `${lineOf(points)}z`;
}
function boxPath([, from, to, low, high]) {
  const width = (((to - from) % 360) + 360) % 360 || 360, top = [], bottom = [];
  for (let i = 0; i <= 24; i++) {
    const az = from + (width * i) / 24;
    bottom.push(skyPoint(az, Math.max(0, low)));
    top.unshift(skyPoint(az, Math.min(90, high)));
  }
  return `${lineOf([...bottom, ...top])}z`;
}

function drawBackdrop(back) {
  const svg = byId("sky-plot"), under = group(svg, "under");
  under.replaceChildren();
  shape(under, "path", { d: ring(0), class: "horizon" });
  for (const el of [30, 60]) shape(under, "path", { d: ring(el), class: "grid" });
  for (const az of [0, 45, 90, 135]) shape(under, "path", { d: lineOf([skyPoint(az, 0), skyPoint(az + 180, 0)]), class: "grid" });
  for (const [az, name] of [[0, "N"], [90, "E"], [180, "S"], [270, "W"]]) {
    const [x, y] = skyPoint(az, -7.5);
    shape(under, "text", { x, y: y + 2.5, "text-anchor": "middle" }, name);
  }
  shape(under, "text", { x: 1.5, y: -31 }, "60");
  shape(under, "text", { x: 1.5, y: -61 }, "30");
  if (!back) return;
  const heights = back.skyline.length ? new Map(back.skyline) : null;
  const edge = heights ? (az) => Math.max(back.lowest_deg, heights.get(az % 360) ?? 0) : back.lowest_deg;
  shape(under, "path", { d: `${ring(0, 5)}${ring(edge, 5)}`, class: "mask", "fill-rule": "evenodd" });
  for (const zone of back.keep_outs) shape(under, "path", { d: boxPath(zone), class: "zone" });
  if (back.keyhole_el_deg !== null && back.keyhole_el_deg > 30) {
    shape(under, "circle", { r: (HORIZON * (90 - back.keyhole_el_deg)) / 90, class: "keyhole" });
  }
  const up = back.track.map(([, az, el]) => skyPoint(az, el));
  shape(under, "path", { d: lineOf(up), class: "track" });
  if (up.length > 4) {
    const at = Math.floor(up.length * 0.12), [x, y] = up[at], [u, v] = up[at + 1];
    const turn = (Math.atan2(v - y, u - x) * 180) / Math.PI;
    shape(under, "path", { d: "M-3-3L3 0L-3 3", class: "horizon", transform: `translate(${x} ${y}) rotate(${turn})` });
  }
}

function drawAhead(ahead) {
  const over = group(byId("sky-plot"), "path-ahead");
  over.replaceChildren();
  if (!ahead) return;
  shape(over, "path", { d: lineOf(ahead.ahead.filter(([, el]) => el > -1).map(([az, el]) => skyPoint(az, el))), class: "ahead" });
}

function marker(parent, name, place) {
  const one = parent.querySelector(`.shape-${name}`) ?? shape(parent, "use", { href: `#shape-${name}`, class: `shape-${name}` });
  one.style.display = place ? "" : "none";
  if (place) one.setAttribute("transform", `translate(${put(place)})`);
  return one;
}

function drawSky(now, back, isOld) {
  const over = group(byId("sky-plot"), "markers"), aim = now.aim;
  const disc = over.querySelector(".zone") ?? shape(over, "circle", { class: "zone" });
  const sun = aim?.sun_deg && aim.sun_deg[1] > -1 ? skyPoint(...aim.sun_deg) : null;
  disc.style.display = sun && back?.sun_radius_deg ? "" : "none";
  if (sun && back?.sun_radius_deg) {
    disc.setAttribute("r", back.sun_radius_deg);
    disc.setAttribute("transform", `translate(${put(sun)})`);
  }
  marker(over, "sun", sun);
  marker(over, "satellite", aim?.path_deg && aim.path_deg[1] > -2 ? skyPoint(...aim.path_deg) : null);
  marker(over, "commanded", now.command_az_deg === null ? null : skyPoint(now.command_az_deg, now.command_el_deg));
  marker(over, "measured", now.az_deg === null ? null : skyPoint(now.az_deg, now.el_deg)).classList.toggle("old", isOld);
}

const SPANS = [1, 2, 5, 10, 20, 50, 100]; // beamwidths from the middle to the rim
function drawBeam(now, back, ahead, isOld) {
  const svg = byId("beam-plot"), aim = now.aim, beam = back?.beamwidth_deg;
  const all = group(svg, "all");
  if (!aim || !beam) {
    all.replaceChildren();
    byId("beam-scale").textContent = "";
    return;
  }
  const search = ahead?.searched ?? [];
  const far = Math.max(0.9, ...[aim.beside_deg, ...search.flat()].map((p) => (p ? Math.hypot(...p) / beam + 0.5 : 0)));
  const span = SPANS.find((one) => one >= far) ?? 200, scale = 100 / (span * beam);
  const at = ([right, up]) => [right * scale, -up * scale];
  all.replaceChildren();
  for (const share of [0.25, 0.5, 0.75, 1]) shape(all, "circle", { r: 100 * share, class: share === 1 ? "horizon" : "grid" });
  shape(all, "path", { d: "M-100 0H100M0-100V100", class: "grid" });
  if (aim.heading_deg !== null && aim.path_deg) {
    shape(all, "path", { d: "M0-86V-97M-3-92L0-97L3-92", class: "ahead", transform: `rotate(${aim.heading_deg})` });
  }
  for (const row of search) shape(all, "path", { d: lineOf(row.map(at)), class: "searched" });
  if (aim.spread_deg && aim.heading_deg !== null) {
    const [along, across] = aim.spread_deg.map((one) => Math.min(one * scale, 400));
    shape(all, "ellipse", { rx: Math.max(across, 0.8), ry: Math.max(along, 0.8), class: "sigma", transform: `rotate(${aim.heading_deg})` });
  }
  const place = aim.beside_deg ? at(aim.beside_deg) : null;
  if (place) shape(all, "circle", { r: (beam / 2) * scale, class: "lobe", transform: `translate(${put(place)})` });
  if (aim.path_deg) marker(all, "satellite", [0, 0]);
  if (aim.command_beside_deg && aim.written_age_s < OLD_S && Math.hypot(...aim.command_beside_deg) * scale < 100) marker(all, "commanded", at(aim.command_beside_deg));
  if (place) marker(all, "measured", place).classList.toggle("old", isOld);
  byId("beam-scale").textContent = `rim ${span} beamwidth${span === 1 ? "" : "s"}, ${(span * beam).toPrecision(2)} deg; shaded: half power; dashed: 3 sigma`;
}

"use strict";
// What stands in words and numbers.  Texts go in as text alone: a name is never taken for markup.
const OLD_S = 1.0, OLD_RESTING_S = 2.5;
const STANDS = new Set(["IDLE", "MANUAL", "STOW", "FAULT", "LINK-LOST"]);

function say(id, text) {
  const one = byId(id);
  if (one.textContent !== text) one.textContent = text;
}
const fixed = (value, digits, unit = "") => (value === null || value === undefined ? "-" : `${value.toFixed(digits)}${unit}`);
const turned = (az) => ((az % 360) + 360) % 360;
function clock(seconds) {
  if (seconds === null || seconds === undefined) return "-";
  const s = Math.abs(Math.round(seconds)), two = (n) => String(n).padStart(2, "0");
  const text = s >= 3600 ? `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)}` : `${Math.floor(s / 60)}:${two(s % 60)}`;
  return seconds < -0.5 ? `\u2212${text}` : text;
}
function element(kind, text, name) {
  const one = document.createElement(kind);
  if (text !== undefined) one.textContent = text;
  if (name) one.className = name;
  return one;
}
function isMeasurementOld(now, silent) {
  const limit = STANDS.has(now.state) ? OLD_RESTING_S : OLD_S;
  return !now.is_link_up || now.reading_age_s === null || now.reading_age_s + silent > limit;
}

let saidWord = "";
function showVerdict(now) {
  const box = byId("verdict"), level = now.level.toLowerCase();
  box.className = level;
  const held = now.state.startsWith("HOLD") && now.state_s !== null ? ` ${now.state_s.toFixed(0)} s` : "";
  say("word", `${now.verdict}${held}`);
  const error = now.off_path_deg !== null && now.half_beam_deg ? now.off_path_deg / (2 * now.half_beam_deg) : null;
  const off = error !== null && now.state !== "PREPOSITION" ? `, ${error.toFixed(error < 10 ? 2 : 0)} beamwidths off the path` : "";
  const good = now.inside_s !== null && !STANDS.has(now.state) ? `; good for ${now.inside_s >= now.buffer_s - 0.3 ? ">" : ""}${now.inside_s.toFixed(0)} s without a signal` : "";
  say("why", `${now.why.replaceAll("`", "")}${off}${good}`);
  const isOff = now.state === "IDLE" && now.arming === "disarmed";
  const [steers, ...then] = isOff ? ["nobody", "the daemon, when somebody arms it"] : now.steering.replace(/ \([^)]*\)$/, "").split("; ");
  const next = then.join("; ").replace(/^then /, "").replace(/ (would take|takes) over/, "") || "nothing";
  say("steers", steers);
  say("next-steers", next);
  say("may-move", mayMove(now));
  if (now.verdict !== saidWord) { // changes are announced, ticks never
    saidWord = now.verdict;
    say("heard", `${now.verdict}: ${now.why}`);
    byId("sky-said").textContent = byId("beam-said").textContent = now.headline;
    byId("time-said").textContent = `${now.satellite}, ${now.headline}`;
  }
}
function mayMove(now) {
  if (!now.is_link_up) return "not known: no link";
  if (now.arming !== "armed") return now.arming === "shadow" ? "no: shadow" : "no: disarmed";
  if (now.latch) return "no: latched";
  if (["MANUAL", "STOW", "FAULT"].includes(now.state)) return "not by the daemon";
  if (!STANDS.has(now.state)) return "YES, now";
  if (now.rise_in_s === null) return "not now";
  return now.rise_in_s < 300 ? "within minutes" : `not now; rise in ${clock(now.rise_in_s)}`;
}

function showFigures(now, back, silent) {
  const old = isMeasurementOld(now, silent), aim = now.aim;
  say("az-m", fixed(now.az_deg, 2));
  say("el-m", fixed(now.el_deg, 2));
  say("az-c", now.command_az_deg === null ? "-" : fixed(turned(now.command_az_deg), 2));
  say("el-c", fixed(now.command_el_deg, 2));
  say("az-s", aim?.path_deg ? fixed(turned(aim.path_deg[0]), 2) : "-");
  say("el-s", aim?.path_deg ? fixed(aim.path_deg[1], 2) : "-");
  say("age-m", now.reading_age_s === null ? "never" : `${(now.reading_age_s + silent).toFixed(1)} s`);
  say("age-c", aim?.written_age_s === null || !aim ? "-" : `${(aim.written_age_s + silent).toFixed(1)} s`);
  say("age-s", now.fit_age_s !== null ? `fit ${(now.fit_age_s + silent).toFixed(0)} s` : now.model || "-");
  const isUnwritten = !aim || aim.written_age_s === null || aim.written_age_s + silent > OLD_S;
  for (const id of ["az-m", "el-m", "age-m"]) byId(id).classList.toggle("old-value", old);
  for (const id of ["az-c", "el-c", "age-c"]) byId(id).classList.toggle("old-value", isUnwritten);
  const stops = back && aim && aim.az_turn_deg !== null ? `${(aim.az_turn_deg - back.azimuth_deg[0]).toFixed(0)} / ${(back.azimuth_deg[1] - aim.az_turn_deg).toFixed(0)} deg to the stops` : "";
  facts([
    ["cable", aim && aim.az_turn_deg !== null ? `${aim.az_turn_deg.toFixed(1)} deg, ${stops}` : "-", old],
    ["moves", now.speed_deg_s === null ? "-" : `${now.speed_deg_s.toFixed(2)} deg/s`, old],
    ["signal", signalText(now, back), old],
    ["prediction", predictionText(now)],
    ["correction", now.along_s === null ? "no fit yet" : `${Math.abs(now.along_s).toFixed(2)} s ${now.along_s < 0 ? "early" : "late"}, ${signed(now.across_deg, 3)} deg across`],
    ["nudge", nudgeText(now)], ["held", now.is_held_by_person ? "by a person: autotrack is left for the prediction, until track or the end of the pass" : ""],
    ["wind", now.wind], ["paused", now.paused_until_utc ? `no pass begins before ${now.paused_until_utc}` : ""], ["rehearsed", now.phantom],
    ["sun", now.sun_deg === null ? "" : `${now.sun_deg.toFixed(1)} deg from the beam`],
    ["crossing", now.zenith.replace(/\d{4}-\d\d-\d\dT(\d\d:\d\d:\d\d)Z/g, "$1")], ["search", now.search], ["not fitted", now.rejecting], ["elements", now.elements + (now.elements_problem ? `; ${now.elements_problem}` : "")],
    ["ACU", `${now.acu_mode || "-"}, ${now.arming}${now.disarmed_by ? ` by ${now.disarmed_by}` : ""}`],
  ]);
}
const signed = (value, digits) => (value === null ? "-" : `${value < 0 ? "\u2212" : "+"}${Math.abs(value).toFixed(digits)}`);
function signalText(now, back) {
  if (!now.is_link_up) return "not known";
  if (back && !back.has_signal) return "none is waited for";
  return `${now.is_acquired ? "acquired" : "not acquired"}${now.agc_db !== null ? `, ${now.agc_db.toFixed(1)} dB` : ""}`;
}
function nudgeText(now) {
  if (!now.nudge_along_s && !now.nudge_across_deg) return "";
  return `${signed(now.nudge_along_s, 2)} s late, ${signed(now.nudge_across_deg, 3)} deg across, by a person; until the pass ends or the next fit`;
}
function predictionText(now) {
  if (!now.buffer_kind) return "none yet";
  const sigma = now.sigma_deg !== null && now.half_beam_deg ? `, sigma ${(now.sigma_deg / (2 * now.half_beam_deg)).toFixed(3)} beamwidths` : "";
  return `${now.buffer_kind} for ${now.buffer_s.toFixed(0)} s${sigma}`;
}
function facts(rows) {
  const list = byId("facts");
  const shown = rows.filter(([, text]) => text);
  while (list.children.length > 2 * shown.length) list.lastChild.remove();
  while (list.children.length < 2 * shown.length) list.append(element("dt"), element("dd"));
  shown.forEach(([name, text, old], i) => {
    const [dt, dd] = [list.children[2 * i], list.children[2 * i + 1]];
    if (dt.textContent !== name) dt.textContent = name;
    if (dd.textContent !== text) dd.textContent = text;
    dd.classList.toggle("old-value", Boolean(old));
  });
}

function showCountdowns(now, back, ahead, passed) {
  const until = (tai) => (tai === null || tai === undefined ? null : tai - now.tai_s - passed);
  const rows = [];
  if (now.rise_in_s !== null) {
    rows.push([now.rise_in_s - passed > 0 ? "rise in" : "risen", Math.abs(now.rise_in_s - passed), `${now.rise_utc.slice(11)}`]);
    const top = until(back?.culmination_tai_s);
    if (top > 0) rows.push(["culmination", top, now.culmination_deg ? `${now.culmination_deg.toFixed(1)} deg` : ""]);
    const hole = until(ahead?.crossing_tai_s?.[0]), out = until(ahead?.crossing_tai_s?.[1]);
    if (out > 0) rows.push([hole > 0 ? "keyhole in" : "keyhole for", hole > 0 ? hole : out, ""]);
    const set = now.set_in_s - passed;
    rows.push([set > 0 ? "set in" : "set since", Math.abs(set), now.set_utc.slice(11)]);
  }
  if (now.inside_s !== null && !STANDS.has(now.state)) rows.push(["trust", Math.max(0, now.inside_s - passed), now.inside_s >= now.buffer_s - 0.3 ? "or more" : ""]);
  const list = byId("countdowns");
  while (list.children.length > rows.length) list.lastChild.remove();
  while (list.children.length < rows.length) {
    const item = element("li");
    item.append(element("span"), element("b"), element("span"));
    list.append(item);
  }
  rows.forEach(([name, seconds, more], i) => {
    const [label, value, note] = list.children[i].children;
    label.textContent = name;
    value.textContent = clock(seconds);
    note.textContent = more;
  });
  say("pass-when", now.satellite);
}

function showAlarms(alarms) {
  const list = byId("alarm-list");
  byId("alarms").hidden = !alarms.length;
  byId("alarms").className = alarms.some((one) => !one.ended_utc) ? "" : "quiet";
  list.replaceChildren();
  for (const one of alarms) {
    const state = one.ended_utc ? "over" : one.acknowledged_by ? "seen" : "on", item = element("li", undefined, state);
    const word = one.ended_utc ? `over since ${one.ended_utc.slice(11, 19)}` : `since ${one.began_utc.slice(11, 19)}`;
    item.append(element("span", one.ended_utc ? "\u25CB" : "\u25C6"), element("span", one.text), element("small", `${word}${one.acknowledged_by ? `; seen by ${one.acknowledged_by}` : ""}`));
    if (!one.acknowledged_by && mayOrder) {
      const seen = element("button", "seen", "small");
      seen.type = "button";
      seen.setAttribute("aria-label", `I have seen: ${one.text}`);
      seen.addEventListener("click", () => order({ do: "acknowledge", number: one.number }));
      item.append(seen);
    }
    list.append(item);
  }
}
function showEvents(events) {
  const list = byId("event-list");
  list.replaceChildren(...events.map((one) => {
    const item = element("li", undefined, one.level), when = element("time", one.utc.slice(11, 21));
    item.append(when, element("b", one.event), ` ${one.text}`);
    return item;
  }));
}
function showSchedule(rows, now) {
  const table = byId("passes"), body = element("tbody"), head = element("tr");
  for (const name of ["pass", "rise", "set", "up to", "state", "reason"]) {
    const cell = element("th", name);
    cell.scope = "col";
    head.append(cell);
  }
  const top = element("thead");
  top.append(head);
  for (const one of rows) {
    const line = element("tr");
    const go = one.no_go ? `NO-GO: ${one.no_go}` : one.no_go === "" ? "go" : "";
    for (const text of [one.satellite, one.rise_utc.slice(5, 19).replace("T", " "), one.set_utc.slice(11, 19), `${one.culmination_deg} deg`, one.state, [one.reason, go].filter(Boolean).join("; ")]) line.append(element("td", text));
    line.lastChild.className = one.no_go ? "reason bad-text" : "reason";
    const verb = one.state === "planned" ? "skip" : one.reason.startsWith("excluded") ? "unskip" : "";
    if (verb && mayOrder) {
      const button = element("button", verb, "small"), cell = element("td");
      button.type = "button";
      button.setAttribute("aria-label", `${verb} ${one.satellite} of ${one.rise_utc.slice(11, 16)}`);
      button.addEventListener("click", () => order({ do: "verb", verb, values: { satellite: one.satellite, at: one.at_utc } }));
      cell.append(button);
      line.append(cell);
    }
    body.append(line);
  }
  if (!rows.length) {
    const own = now?.rise_utc ? [`${now.satellite} ${now.rise_utc.slice(11, 16)} ${now.culmination_deg?.toFixed(0)} deg (this one)`] : [];
    for (const text of [...own, ...(now?.next_passes ?? [])]) {
      const line = element("tr"), cell = element("td", text);
      cell.colSpan = 6;
      line.append(cell);
      body.append(line);
    }
  }
  table.replaceChildren(...(rows.length ? [top, body] : [body]));
}
function showTicks(now) {
  const rows = [
    ["late", `half within ${now.lateness_p50_ms.toFixed(2)} ms, 99 of 100 within ${now.lateness_p99_ms.toFixed(2)} ms, worst ${now.lateness_max_ms.toFixed(1)} ms (10 s)`],
    ["ticks", `${now.tick_count}, ${now.skipped_tick_count} skipped`],
    ["writes", `${now.write_count}; ${now.clamped_count} slowed, ${now.limited_count} held at a limit, ${now.refusal_count} refused`],
  ];
  const list = byId("ticks");
  if (!list.children.length) for (const [name] of rows) list.append(element("dt", name), element("dd"));
  rows.forEach(([, text], i) => { list.children[2 * i + 1].textContent = text; });
}

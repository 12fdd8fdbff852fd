"use strict";
// The live line: takes the newest state, draws it at the next frame, and says when it hears nothing.
let line = null, heardAt = 0, now = null, nowAt = 0, newNow = false, retry = 0, pending = {}, isDrawDue = false;
const state = { backdrop: null, ahead: null, states: [], lateness: null, schedule: [], people: null };
const LOST_S = 1.0, THEMES = ["", "light", "dark", "night"];
const THEME_NAMES = { "": "as the system", light: "light", dark: "dark", night: "night, red" };

function connect() {
  const url = new URL("live", location.href);
  url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  const own = (line = new WebSocket(url));
  own.onmessage = (event) => {
    if (line !== own) return;
    own.send("a");
    take(JSON.parse(event.data));
  };
  own.onclose = () => {
    if (line !== own) return;
    line = null;
    unlockedUntil = 0;
    showLock();
    retry = Math.min(retry + 250, 2000);
    setTimeout(connect, retry);
  };
}
function take(said) {
  heardAt = performance.now();
  retry = 0;
  if (said.hello) {
    ({ nonce, may_order: mayOrder } = said.hello);
    orderNumber = 0;
    unlockedUntil = 0;
    makeVerbs(said.hello.verbs);
    strip.length = 0;
    said.strip.forEach(keepRow);
    showLock();
  }
  if (said.replies) heardReplies(said.replies);
  for (const topic of ["backdrop", "ahead", "states", "lateness", "schedule", "people"]) if (said[topic] !== undefined) state[topic] = said[topic];
  if (said.now) {
    now = said.now;
    nowAt = heardAt;
    newNow = true;
    window.acuSeen = { tick: now.tick_count, tai_s: now.tai_s, at: heardAt }; // for the measurement of latency
    watchStop(now);
  }
  pending = { ...pending, ...said };
  if (isDrawDue) return;
  isDrawDue = true;
  requestAnimationFrame(drawPending);
  setTimeout(drawPending, 300); // a page behind others is given no frames, and its title shall be true
}
function drawPending() {
  if (!isDrawDue) return;
  const said = pending;
  isDrawDue = false;
  pending = {};
  draw(said);
}
function draw(said) {
  document.body.classList.remove("waiting");
  if (said.backdrop !== undefined) drawBackdrop(state.backdrop);
  if (said.ahead !== undefined) drawAhead(state.ahead);
  if (said.alarms) showAlarms(said.alarms);
  if (said.events) showEvents(said.events);
  if (said.people) showPeople(state.people);
  if (said.states) keyOfTimeline(state.states);
  if (said.schedule) showSchedule(state.schedule, now);
  if (said.lateness) drawLateness(state.lateness, now);
  if (!newNow || !now) return;
  newNow = false;
  const isOld = isMeasurementOld(now, 0);
  showVerdict(now);
  showFigures(now, state.backdrop, 0);
  drawSky(now, state.backdrop, isOld);
  drawBeam(now, state.backdrop, state.ahead, isOld);
  showHead(now);
  if (keepRow(rowOf(now)) || said.strip) {
    drawStrips();
    drawTimeline(now, state.backdrop, state.states, state.ahead);
    showTicks(now);
    showCountdowns(now, state.backdrop, state.ahead, 0);
    if (!state.schedule.length) showSchedule([], now);
  }
  window.acuShown = { ...window.acuSeen, drawn: performance.now() };
}
function showHead(seen) {
  say("satellite", seen.satellite || "between passes");
  say("station", seen.station);
  say("utc", seen.utc.slice(11, 19));
  document.title = `${seen.verdict} \u2013 ${seen.satellite || seen.station}`;
  const marks = [seen.is_simulation && "SIMULATION", seen.is_rehearsal && "REHEARSAL", seen.arming === "shadow" && "SHADOW"].filter(Boolean);
  const box = byId("marks");
  if (box.textContent !== marks.join("")) box.replaceChildren(...marks.map((text) => element("b", text)));
}
function link(id, level, text) {
  const one = byId(id);
  if (one.className !== level) one.className = level;
  const small = one.querySelector("small");
  if (small && small.textContent !== text) small.textContent = text;
}
function watch() { // ten times a second, whatever comes or does not
  const silent = heardAt ? (performance.now() - heardAt) / 1000 : performance.now() / 1000, isLost = silent > LOST_S;
  const lost = byId("lost");
  document.body.classList.toggle("old", isLost);
  lost.hidden = !isLost;
  if (isLost) say("lost", `CONNECTION LOST for ${silent.toFixed(0)} s \u2013 ${now ? "what stands here was seen last, and is not so now" : "the daemon does not answer"}`);
  link("link-browser", "good", "");
  link("link-daemon", isLost ? "bad" : "good", isLost ? `silent ${silent.toFixed(0)} s` : "live");
  if (now) {
    const passed = (performance.now() - nowAt) / 1000, age = now.reading_age_s === null ? null : now.reading_age_s + passed, isOld = isMeasurementOld(now, passed);
    if (isLost) link("link-acu", "", "not known");
    else link("link-acu", now.is_link_up ? "good" : "bad", now.is_link_up ? "answers" : "no link");
    const trouble = now.latch ? "latched" : now.acu_faults ? "fault" : now.encoder_problem ? "encoder" : "";
    if (isLost) link("link-antenna", "", "not known");
    else link("link-antenna", trouble || !now.is_link_up ? "bad" : isOld ? "watch" : "good", trouble || (age === null ? "never read" : `read ${age.toFixed(1)} s ago`));
    if (passed > 0.25) {
      showFigures(now, state.backdrop, passed);
      drawSky(now, state.backdrop, isOld || isLost);
    }
    const left = now.lease_left_s - passed;
    if (state.people?.lease && left > 0) say("lease", `${state.people.lease.name} by ${state.people.lease.via}${state.people.lease.reason ? `: ${state.people.lease.reason}` : ""}, ${left.toFixed(0)} s left`);
  }
  showLock();
}
function theme(name) {
  if (name) document.documentElement.dataset.theme = name;
  else delete document.documentElement.dataset.theme;
  say("theme", `colours: ${THEME_NAMES[name]}`);
}
function begin() {
  let chosen = localStorage.getItem("theme") ?? "";
  theme(THEMES.includes(chosen) ? chosen : "");
  byId("theme").addEventListener("click", () => {
    chosen = THEMES[(THEMES.indexOf(chosen) + 1) % THEMES.length];
    localStorage.setItem("theme", chosen);
    theme(chosen);
  });
  byId("mirror").addEventListener("click", () => {
    eastSign = -eastSign;
    byId("mirror").textContent = eastSign > 0 ? "east is right" : "east is left";
    byId("mirror").setAttribute("aria-pressed", String(eastSign < 0));
    drawBackdrop(state.backdrop);
    drawAhead(state.ahead);
    if (now) drawSky(now, state.backdrop, false);
  });
  makeStrips();
  startHands();
  drawBackdrop(null);
  connect();
  setInterval(watch, 100);
}
begin();

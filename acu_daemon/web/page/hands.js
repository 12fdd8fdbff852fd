"use strict";
// Stop, and the orders.  STOP goes out at a pointer's or a key's press, by the live line or, without one, by a request.
let mayOrder = false, nonce = "", token = "", orderNumber = 0, replyNumber = 0, unlockedUntil = 0;
const waiting = new Map();
const WAIT_MS = 2000;

// Stop

let stopped = null; // the press that is being shown
function pressStop(event) {
  if (!event.isTrusted) return; // nothing but a hand stops: no script, no page that is loaded again
  const pressed = { at: performance.now(), id: `stop ${++replyNumber}`, said: "", before: now?.stop_sent_utc ?? "" };
  stopped = pressed;
  let isOut = false;
  if (line?.readyState === WebSocket.OPEN) {
    line.send(JSON.stringify({ stop: pressed.id }));
    waiting.set(pressed.id, (reply) => heardStop(pressed, reply.text, reply.ok));
    isOut = true;
  }
  const cut = new AbortController();
  setTimeout(() => cut.abort(), WAIT_MS);
  if (!isOut) {
    fetch("stop", { method: "POST", headers: { "Content-Type": "application/json" }, body: "{}", signal: cut.signal })
      .then((answer) => (answer.ok ? answer.json() : Promise.reject(new Error(String(answer.status)))))
      .then((reply) => heardStop(pressed, reply.text.replace(/^(ok|error) /, ""), reply.text.startsWith("ok")))
      .catch(() => { if (stopped === pressed && !pressed.said) sayStop(`NOT SENT: the daemon does not answer. Press the emergency stop at the antenna.`); });
  } else {
    setTimeout(() => { if (stopped === pressed && !pressed.said) sayStop("SENT, and the daemon has not answered. Press the emergency stop at the antenna."); }, WAIT_MS);
  }
  sayStop("STOP: sending");
}
function heardStop(pressed, text, ok) {
  if (stopped !== pressed) return;
  pressed.heard = performance.now();
  pressed.said = `STOP ${ok ? "sent" : "refused"}${after(pressed.heard - pressed.at)}`;
  if (!ok) pressed.said += `: ${text}`;
  pressed.ok = ok;
  sayStop(pressed.said);
}
const after = (ms) => ` after ${(ms / 1000).toFixed(2)} s`;
function watchStop(now) {
  if (!stopped?.ok || stopped.isOver) return;
  if (now.arming === "armed" && performance.now() - stopped.at > WAIT_MS) { // somebody has armed it since
    stopped.isOver = true;
    return sayStop("");
  }
  const isNew = now.stop_sent_utc && now.stop_sent_utc !== stopped.before;
  let text = stopped.said;
  if (isNew) text += ` \u2014 on the wire ${now.stop_sent_utc.slice(11, 23)}`;
  if (isNew && now.stop_confirmed_utc) {
    text += ` \u2014 the ACU confirms ${now.stop_confirmed_utc.slice(11, 23)}`;
    const isKnown = now.is_link_up && now.speed_deg_s !== null, stands = isKnown && now.speed_deg_s < 0.2;
    if (stands) stopped.stood ||= performance.now();
    if (stands) text += ` \u2014 the antenna stands${after(stopped.stood - stopped.at)}; disarmed until somebody arms it`;
    else text += isKnown ? " \u2014 it still moves" : " \u2014 whether it still moves is not known";
  } else text += now.is_stopping || isNew ? " \u2014 the ACU has not confirmed yet" : "";
  sayStop(text);
}
function sayStop(text) {
  say("stop-said", text);
}

// Orders

function order(said, then) {
  if (line?.readyState !== WebSocket.OPEN) return sayOrder("not sent: no connection", false);
  if (!token) return sayOrder("unlock first: the token is needed", false);
  const id = ++replyNumber, text = JSON.stringify({ ...said, n: ++orderNumber, id });
  waiting.set(id, (reply) => { sayOrder(reply.text, reply.ok); heardOrder(reply); then?.(reply); });
  line.send(JSON.stringify({ order: text, seal: hmac(token, `${nonce}\n${text}`) }));
  setTimeout(() => { if (waiting.delete(id)) sayOrder("no answer: look at what the antenna does", false); }, WAIT_MS);
}
function heardOrder(reply) {
  if (reply.unlocked_s) unlockedUntil = performance.now() + 1000 * reply.unlocked_s;
  if (reply.is_locked) unlockedUntil = 0;
  byId("take-over").hidden = !reply.is_held;
  showLock();
}
function heardReplies(replies) {
  for (const reply of replies) {
    const then = waiting.get(reply.id);
    waiting.delete(reply.id);
    if (then) then(reply);
    else sayOrder(reply.text, reply.ok); // a refused seal carries no number
  }
}
function sayOrder(text, ok) {
  const one = byId("order-said");
  one.className = ok ? "good-text" : "bad-text";
  one.textContent = `${ok ? "\u2713" : "\u2717"} ${text}`;
}
function unlock(takesOver) {
  token = byId("token").value || token;
  order({ do: "unlock", name: byId("name").value, reason: byId("reason").value, takes_over: takesOver });
}
function showLock() {
  const left = (unlockedUntil - performance.now()) / 1000, isOpen = left > 0;
  byId("no-orders").hidden = mayOrder;
  byId("unlock").hidden = !mayOrder || isOpen;
  byId("verbs").hidden = !mayOrder || !isOpen;
  byId("token").required = !token;
  say("lock-state", !mayOrder ? "" : isOpen ? `unlocked for ${left.toFixed(0)} s` : "locked");
}
function makeVerbs(verbs) {
  const box = byId("verbs");
  box.replaceChildren();
  const plain = (text) => text.replaceAll("`", "");
  for (const verb of verbs) {
    const row = element("div", undefined, verb.parameters.length ? "verb wide" : "verb"), fields = [], button = element("button", verb.name), what = element("p", plain(verb.what), "dim");
    button.type = "button";
    what.id = `what-${verb.name}`;
    button.setAttribute("aria-describedby", what.id);
    row.append(button, what);
    for (const one of verb.parameters) {
      const isChoice = one.what.startsWith("yes:"), input = element("input");
      const label = element("label", `${one.name.replace(/_(s|deg)$/, "")}${one.unit ? `, ${one.unit}` : ""}: ${plain(one.what).replace(/^yes: /, "")}`);
      if (isChoice) Object.assign(input, { type: "checkbox", value: "yes" });
      input.name = one.name;
      if (one.unit) Object.assign(input, { type: "number", step: "any", min: one.least, max: one.most });
      if (/UTC/.test(one.what)) input.placeholder = `${new Date().toISOString().slice(0, 16)}:00Z`;
      fields.push(input);
      label.append(input);
      row.append(label);
    }
    button.addEventListener("click", () => {
      const values = {};
      for (const one of fields) {
        if (!one.reportValidity()) return;
        if (one.type === "checkbox" ? one.checked : one.value !== "") values[one.name] = one.type === "number" ? Number(one.value) : one.value;
      }
      order({ do: "verb", verb: verb.name, values });
    });
    box.append(row);
  }
  const lock = element("button", "lock, and give the lease back");
  lock.type = "button";
  lock.addEventListener("click", () => order({ do: "lock" }, () => { unlockedUntil = 0; showLock(); }));
  box.append(lock);
}
function showPeople(people) {
  const held = people.lease;
  say("lease", held ? `${held.name} by ${held.via}${held.reason ? `: ${held.reason}` : ""}` : "free");
  say("people", `${people.names.length} page${people.names.length === 1 ? "" : "s"} open: ${people.names.join(", ")}`);
}
function startHands() {
  const stop = byId("stop");
  stop.addEventListener("pointerdown", (event) => { if (event.button === 0) pressStop(event); });
  stop.addEventListener("click", (event) => { if (event.detail === 0) pressStop(event); }); // a key, or a reader of the screen
  byId("unlock").addEventListener("submit", (event) => { event.preventDefault(); unlock(false); });
  byId("take-over").addEventListener("click", () => unlock(true));
  showLock();
}

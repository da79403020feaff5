"use strict";

// Controls and bars of the operator. What is held is sent when it changes and twenty times a second;
// the reply is what the bars and lines show.
const PERIOD = 40; // ms between two messages
const PATIENCE = 1000; // ms without a reply after which the page says so
const STOOD_STILL = 1.5 * PATIENCE; // ms; a page that runs notices a missing reply sooner
const STATES = { free: "", limit: "limit", singular: "singular" };
const KEYS = new Map(TCS.keys.map((one) => [one.code, one]));

const holders = new Map(); // code of a key -> what holds it: "key", or the number of a pointer
const tapped = new Set(); // keys that went down since the last message
const clicks = {}; // presses so far of keys that switch
const caps = new Map(); // code of a key -> its button on the page
const moved = new Map(); // sliders that were moved, until the reply says so
const shown = new Map(); // name of a slider -> its input and output
let gamepad = {}; // as Meshcat names its parts; empty without one
let device = null; // an XR controller in its place
const pageName = `${Date.now()}-${Math.random()}`;
let messages = 0;
let wake = () => {};

function press(code, holder) {
  const key = KEYS.get(code);
  if (!holders.has(code)) holders.set(code, new Set());
  if (holders.get(code).has(holder)) return;
  holders.get(code).add(holder);
  if (key.hold) tapped.add(code);
  else clicks[code] = (clicks[code] || 0) + 1;
  showKeys();
}

function release(code, holder) {
  const of = holders.get(code);
  if (!of || !of.delete(holder)) return;
  if (!of.size) holders.delete(code);
  showKeys();
}

function releaseAll() {
  holders.clear();
  tapped.clear();
  showKeys();
}

function showKeys() {
  for (const [code, cap] of caps) cap.setAttribute("aria-pressed", holders.has(code));
  wake();
}

// Meshcat would count a press, and not the release: it gets none of these keys.
function onKey(event) {
  const code = event.code;
  const cap = event.target.closest ? event.target.closest("#desk [data-code]") : null;
  const typed = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName || "") && event.target.type !== "range";
  if (cap && code === "Enter") {
    event.preventDefault();
    if (event.type === "keydown") press(cap.dataset.code, "enter");
    else release(cap.dataset.code, "enter");
    return;
  }
  if (event.type === "keyup") release(code, "key");
  if (!KEYS.has(code) || typed || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  if (event.type === "keydown" && !event.repeat) press(code, "key");
}

addEventListener("keydown", onKey, true);
addEventListener("keyup", onKey, true);
addEventListener("blur", releaseAll);
addEventListener("pagehide", () => {
  releaseAll();
  navigator.sendBeacon("link", message({ leaves: true }));
});
document.addEventListener("visibilitychange", () => {
  if (!document.hidden) return;
  releaseAll();
  readGamepad();
});

// A page in the background is told nothing of a gamepad: it has none.
function readGamepad() {
  const pads = document.hidden ? [] : [...(navigator.getGamepads ? navigator.getGamepads() : [])];
  const pad = pads.find((one) => one && one.connected);
  const rounded = (value) => Math.max(-1, Math.min(1, Math.round(value * 100) / 100));
  const now = !pad ? {} : {
    index: pad.index, axes: [...pad.axes].map(rounded),
    button_values: pad.buttons.map((one) => rounded(one.value)),
  };
  const changed = JSON.stringify(now) !== JSON.stringify(gamepad);
  gamepad = now;
  if (changed) wake();
}

function sliderRow(slider) {
  const properties = { type: "range", min: slider.low, max: slider.high, step: slider.step };
  const input = element("input", { ...properties, value: slider.value, "data-slider": slider.name });
  const output = element("output", {}, String(slider.value));
  input.addEventListener("input", () => {
    output.textContent = input.value;
    moved.set(slider.name, Number(input.value));
    wake();
  });
  shown.set(slider.name, { input, output });
  return element("label", {}, element("span", {}, slider.name), input, output);
}

function showSliders(values) {
  for (const [name, value] of Object.entries(values)) {
    const row = shown.get(name);
    if (!row || moved.has(name) || Number(row.input.value) === value) continue;
    row.input.value = value;
    row.output.textContent = row.input.value;
  }
}

function element(name, properties = {}, ...content) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) made.setAttribute(key, value);
  made.append(...content);
  return made;
}

function keyCap(key) {
  const properties = { type: "button", "data-code": key.code, "aria-pressed": "false" };
  const cap = element("button", properties, element("kbd", {}, key.key), ` ${key.name}`);
  cap.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    cap.setPointerCapture(event.pointerId);
    press(key.code, event.pointerId);
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
    cap.addEventListener(end, (event) => release(key.code, event.pointerId));
  }
  cap.addEventListener("contextmenu", (event) => event.preventDefault());
  // A screen reader clicks: as a short press.
  cap.addEventListener("click", (event) => {
    if (event.detail) return;
    press(key.code, "click");
    release(key.code, "click");
  });
  caps.set(key.code, cap);
  return cap;
}

function keyGroups() {
  const names = [...new Set(TCS.keys.map((key) => key.group))];
  return names.map((name) => {
    const of = TCS.keys.filter((key) => key.group === name);
    const title = element("h2", {}, name);
    return element("section", {}, title, element("div", { class: "caps" }, ...of.map(keyCap)));
  });
}

function jointBar(joint, number) {
  const name = `joint ${number + 1}`;
  const fill = element("div", { class: "fill" });
  const mark = element("div", { class: "mark" });
  const word = element("span", { class: "word" });
  const track = element("div", { class: "track" }, fill, mark, word);
  const meter = element("div", {
    role: "meter", "aria-label": name,
    "aria-valuemin": joint.low, "aria-valuemax": joint.high, "aria-valuenow": joint.low,
  });
  const low = joint.bounded ? `${joint.low}°` : "continuous";
  const high = joint.bounded ? `${joint.high}°` : "";
  const value = element("span", { class: "value" });
  const ends = element("div", { class: "ends" }, element("span", {}, low), element("span", {}, high));
  meter.append(element("div", { class: "name" }, element("span", {}, name), value), track, ends);
  meter.classList.toggle("continuous", !joint.bounded);
  return { meter, fill, mark, word, value, joint };
}

const bars = TCS.joints.map(jointBar);
const modeLine = element("p", { id: "mode" });
const messageLine = element("p", { id: "message", role: "status" });

function showBar(bar, fraction, state) {
  const degrees = Math.round(bar.joint.low + fraction * (bar.joint.high - bar.joint.low));
  const text = `${degrees}°`;
  bar.fill.style.width = `${100 * fraction}%`;
  bar.mark.style.left = `${100 * fraction}%`;
  if (bar.value.textContent !== text || bar.meter.dataset.state !== state) {
    bar.value.textContent = text;
    bar.word.textContent = STATES[state];
    bar.meter.dataset.state = state;
    bar.meter.setAttribute("aria-valuenow", degrees);
    const words = { free: "", limit: ", at its limit", singular: ", singular posture" };
    bar.meter.setAttribute("aria-valuetext", `${degrees} degrees${words[state]}`);
  }
}

function setText(line, text) {
  if (line.textContent !== text) line.textContent = text;
}

function show(readout) {
  showSliders(readout.sliders);
  readout.fractions.forEach((fraction, i) => showBar(bars[i], fraction, readout.states[i]));
  setText(modeLine, readout.mode);
  const asked = readout.ignored ? "Release the keys: the connection was lost for a while." : "";
  setText(messageLine, readout.message || asked);
}

function message(more = {}) {
  const held = new Set(tapped);
  tapped.clear();
  for (const code of holders.keys()) if (KEYS.get(code).hold) held.add(code);
  messages += 1;
  const sliders = Object.fromEntries(moved);
  const pad = device || gamepad;
  return JSON.stringify({
    page: pageName, number: messages, held: [...held], clicks, sliders, gamepad: pad, ...more,
  });
}

async function exchange() {
  for (;;) {
    const begun = performance.now();
    const changed = new Promise((done) => (wake = done));
    const sent = new Map(moved);
    try {
      const reply = await fetch("link", {
        method: "POST", cache: "no-store", body: message(),
        headers: { "Content-Type": "application/json" }, signal: AbortSignal.timeout(PATIENCE),
      });
      if (!reply.ok) throw new Error(reply.statusText);
      const readout = await reply.json();
      for (const [name, value] of sent) if (moved.get(name) === value) moved.delete(name);
      show(readout);
    } catch (error) {
      const isLate = error.name === "TimeoutError";
      // Where the page itself stood still, the reply may have come in time: it asks again at once.
      if (!isLate || performance.now() - begun < STOOD_STILL) {
        setText(messageLine, "No connection to the arm: it stops, and keys count as released.");
      }
      if (!isLate) await new Promise((done) => setTimeout(done, PATIENCE));
    }
    const rest = PERIOD - (performance.now() - begun);
    if (rest > 0) await Promise.race([changed, new Promise((done) => setTimeout(done, rest))]);
  }
}

function showDesk() {
  const lines = element("div", { id: "lines" }, modeLine, messageLine);
  const meters = element("section", { id: "bars", "aria-label": "joints" });
  meters.append(...bars.map((bar) => bar.meter));
  const keys = element("div", { id: "keys" }, ...keyGroups());
  const sliders = element("details", { id: "sliders" }, element("summary", {}, "sliders"));
  sliders.append(...TCS.sliders.map(sliderRow));
  const title = element("h1", {}, TCS.title);
  const desk = element("main", { id: "desk" }, title, lines, meters, keys, sliders);
  document.body.append(desk);
  // The scene has the height that the desk leaves.
  new ResizeObserver(() => {
    document.body.style.setProperty("--desk", `${desk.offsetHeight}px`);
    dispatchEvent(new Event("resize"));
  }).observe(desk);
}

// Meshcat's controls have their names beside them only.
function nameControls() {
  for (const input of document.querySelectorAll(".dg input:not([aria-label])")) {
    const row = input.closest("li, ul");
    const name = row && row.querySelector(".property-name, .title");
    input.setAttribute("aria-label", name ? name.textContent : "scene");
  }
}

showDesk();
// Meshcat would send gamepads over its own socket, which nothing reads.
handle_gamepads = readGamepad;
exchange();
setInterval(nameControls, 1000);

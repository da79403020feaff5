// The page: what is chosen, and what follows from each change of it.

import { Refusal, cancel, ended, get, post, send } from "./api.js";
import { Editing } from "./editing.js";
import { FloorMap, paint } from "./map.js";
import { by, made, offerColours, options, showCards, showExpert, showGoals, showLegend, showStates, showWhy } from "./panels.js";
import { bodyName, goalText, load, modelName, sentence, t } from "./texts.js";
import { Things, overlap, turned } from "./things.js";
import { Playing } from "./playing.js";
import { View3d } from "./view3d.js";

const PERSONS = {
  default: null,
  female5: { sex: "female", stature_percentile: 5 },
  female50: { sex: "female", stature_percentile: 50 },
  male50: { sex: "male", stature_percentile: 50 },
  male95: { sex: "male", stature_percentile: 95 },
};
const SETTLED = 350; // time after the last change at which places are suggested [ms]
const SIZES = [1, 2];

const page = { files: [], torso: 0, outcome: null, why: null, asked: 0, suggesting: 0, known: null, own: {}, rescored: new Set() };
// What is shown: a score file, its floors by state, the state, and its scene. `whole` has every state, with the changes of the scene.
let [view, whole] = [shownFile(null, 0), shownFile(null, 0)];
const things = new Things();
const map = new FloorMap(by("map"), {
  onPose: (pose, isClick) => move(pose, { best: isClick && by("best").checked }),
  onThing: (name, pose, isEnd) => editing.dragged(name, pose, isEnd),
  onRegion: (first, second) => editing.region(first, second),
});
const editing = new Editing(map, things, {
  get file() { return file().file; },
  get at() { return at(); },
  get states() { return whole.floors.find(Boolean).states; },
  get size() { return sizeOf(whole.floors.find(Boolean)); },
  get place() { return [map.pose.x, map.pose.y]; },
  fault, moved, redraw: showScene, restore, scored, nearest, outdated,
});

const view3d = new View3d(by("canvas3d"), by("marks3d"));
const playing = new Playing(view3d, () => ({ request: placed(), outcome: page.outcome }), fault);

// What is shown, as requests name it.
function placed() {
  const { x, y, yaw } = map.pose;
  return { file: view.file, here: [x, y, yaw], torso: page.torso, at: at() };
}

function shownFile(digest, state) {
  return { file: digest, floors: [], state, scene: null };
}

const sizeOf = ({ x, y, headings_deg, torsos }) => x.length * y.length * headings_deg.length * torsos.length;
const file = () => page.files.find((one) => one.file === by("file").value);
const floor = () => view.floors[view.state] ?? view.floors.find(Boolean);
const at = () => floor().states[view.state];
const fileName = (ending) => `${file().task}-${file().environment}-${file().robot}${things.isChanged || editing.at ? "-changed" : ""}${ending}`.replaceAll(" ", "-");

function fault(error) {
  by("fault").textContent = error instanceof Refusal ? error.message : String(error.message ?? error);
}

async function start() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  const language = wanted.get("language") ?? localStorage.getItem("tcs-language") ?? navigator.language.slice(0, 2);
  by("language").value = language === "de" ? "de" : "en";
  await load(by("language").value);
  say();
  await listFiles(wanted.get("file"));
  if (page.files.length) {
    await openFile(wanted);
  } else {
    by("scoring").open = true;
    by("words").textContent = t("noFile");
  }
  document.body.dataset.ready = "yes";
  page.known = await get("v1/list");
  offerTasks();
}

// Writes every text that is not in the document itself.
function say() {
  document.title = t("title");
  by("map").setAttribute("aria-label", t("mapLabel"));
  by("canvas3d").setAttribute("aria-label", t("view3d"));
  playing.clear();
  options(by("person"), Object.keys(PERSONS).map((key) => [key, t(`persons.${key}`)]), by("person").value || "default");
  by("limits").replaceChildren();
  for (const text of t("limits")) made("li", text, by("limits"));
  offerColours(view.floors);
  showLegend(by("score-of").value);
  editing.say();
}

async function listFiles(chosen) {
  page.files = (await get("v1/files")).filter((one) => !page.rescored.has(one.file));
  options(by("file"), page.files.map((one) => [one.file, one.title]), chosen);
  document.body.toggleAttribute("data-empty", !page.files.length);
}

function offerTasks() {
  const tasks = page.known.tasks.map((one) => [one.name, one.name.replaceAll("_", " ")]);
  options(by("task"), tasks, file()?.task ?? "shaving");
  options(by("robot"), page.known.robots.map((one) => [one.name, one.name]), file()?.robot ?? "pr2");
  offerEnvironments();
  by("task").onchange = offerEnvironments;
}

function offerEnvironments() {
  const task = page.known.tasks.find((one) => one.name === by("task").value);
  const known = (task?.environments ?? page.known.environments.map((one) => one.name)).map((name) => [name, name]);
  options(by("environment"), known, file()?.environment);
  if (page.own.environment) made("option", t("own"), by("environment"), { value: "" });
}

async function openFile(wanted = new URLSearchParams()) {
  editing.clear();
  page.outcome = null;
  view = whole = shownFile(file().file, Number(wanted.get("state") ?? 0));
  by("environmentStates").hidden = true;
  await floorOf(view, view.state);
  options(by("torso"), floor().torsos.map((value) => [value, value.toFixed(2)]), wanted.get("torso"));
  page.torso = Number(by("torso").value);
  map.extent(floor());
  drawFloor();
  map.scene([], null, things);
  map.suggest([]);
  links();
  const given = ["x", "y", "yaw"].map((name) => wanted.get(name)).every((value) => value !== null);
  const first = given || wanted.has("state") ? null : await firstPlace();
  if (first) await showPlace(first);
  else await move(given ? { x: Number(wanted.get("x")), y: Number(wanted.get("y")), yaw: Number(wanted.get("yaw")) } : bestPlace(), { best: !given });
  // The rest arrives while the page is in use.
  const opened = view;
  page.original = opened;
  sceneOf(opened, {}, opened.state).then(() => {
    if (opened !== whole) return;
    editing.offer(opened.scene, opened.scene.states[opened.state]?.outlines ?? [], wanted.get("changes"), wanted.get("at"));
    showScene();
    if (floor().states.length > 1) sceneOf(opened).then(showScene).catch(fault);
  }).catch(fault);
  otherStates(opened).catch(fault);
}

async function floorOf(shown, state) {
  shown.floors[state] ??= await post("floor", { file: shown.file, state });
  return shown.floors[state];
}

function links() {
  by("download").href = `v1/files/${view.file}`;
  by("download").download = fileName(".tcs");
  by("downloadEnvironment").href = `v1/files/${view.file}/environment`;
  by("downloadEnvironment").download = `${file().environment}-changed.yaml`.replaceAll(" ", "-");
  by("page3d").href = `v1/files/${view.file}/view`;
  by("report").href = `v1/files/${view.file}/report`;
}

// Shows scores of the changed scene: of the visible state alone, or of all. A first answer has every second base position, the one of
// the robot among them. `isWanted` says whether the change is still the last one.
async function scored(digest, { isOne, state, isFirst = false, isWanted }) {
  page.rescored.add(digest);
  const states = whole.floors.find(Boolean).states;
  const number = isOne ? 0 : states.findIndex((one) => isSame(one, state));
  const next = shownFile(digest, number);
  await floorOf(next, number);
  if (!isWanted()) return;
  view = next;
  if (!isFirst && (!isOne || states.length < 2)) whole = next;
  await shownAnew(isFirst);
  if (isFirst) return;
  // The map moves outlines by itself; only other postures have other outlines.
  if (Object.keys(things.joints).length || editing.at) {
    sceneOf(next, structuredClone(things.moves)).then(() => next === view && showScene()).catch(fault);
  } else {
    const known = page.original?.scene;
    const number = known?.settings.findIndex((one) => isSame(one, at())) ?? -1;
    if (number >= 0) next.scene = { ...known, states: isOne ? [known.states[number]] : known.states };
    showScene();
  }
  if (!isOne) otherStates(next).catch(fault);
}

const isSame = (state, other) => Object.entries(state).every(([name, value]) => Math.abs(other[name] - value) < 1e-6);

async function shownAnew(isFirst = false) {
  drawFloor();
  showScene();
  listStates();
  links();
  await move(map.pose, { isFirst });
}

// Goes back to the file as it was scored, in the present state or the one that is nearest to it.
async function restore() {
  const state = at();
  view = whole = page.original;
  const { states } = await floorOf(view, 0);
  view.state = stateOf(state, states);
  await floorOf(view, view.state);
  editing.say();
  await shownAnew();
  otherStates(view).catch(fault);
}

// Shows a state of the table while a slider moves.
async function nearest(state) {
  if (view === whole && view.state === state) return;
  view = whole;
  await changeState(state);
}

function drawFloor() {
  offerColours(view.floors);
  showLegend(by("score-of").value);
  map.floor(floor(), by("score-of").value);
}

// Returns the first place of the recommended set, where the page begins; null if no place is reached from anywhere.
async function firstPlace() {
  try {
    return (await post("select", { file: view.file })).members[0];
  } catch (error) {
    if (error instanceof Refusal) return null;
    throw error;
  }
}

// Returns the base position with the greatest score in the visible state.
function bestPlace() {
  const { x, y, reachability, headings_deg } = floor();
  const yaw = headings_deg[0];
  let best = { x: x[0], y: y[0], yaw, value: -1 };
  x.forEach((px, i) => y.forEach((py, j) => {
    if (reachability[i][j] > best.value) best = { x: px, y: py, yaw, value: reachability[i][j] };
  }));
  return best;
}

// Fetches the scene of a file; what was moved is taken back in it, because the map moves the outlines itself.
async function sceneOf(shown, moves = {}, only = null) {
  const job = await post("scene", { file: shown.file, state: only });
  const done = await ended(job.job, () => {});
  if (!done.result) throw new Refusal(done.problem);
  const scene = done.result;
  const person = scene.things.find((one) => one.category === "person")?.name;
  for (const state of scene.states.filter(Boolean)) {
    state.outlines = state.outlines.filter((one) => !things.isAdded(one.thing.replace(/_[b-e]$/, "")));
    for (const one of state.outlines) one.points = one.points.map((point) => things.unmoved(one.thing, point, moves));
    state.goals = state.goals.map(([x, y, z]) => [...things.unmoved(person, [x, y], moves), z]);
  }
  scene.settings = shown.floors.find(Boolean).states;
  if (only !== null) scene.states = scene.settings.map((_, i) => (i === only ? scene.states[0] : null));
  shown.scene = scene;
}

const sceneNow = () => view.scene ?? whole.scene ?? page.lastScene;
const stateNow = () => sceneNow()?.states[view.scene ? view.state : 0];

function showScene() {
  if (view.scene) page.lastScene = view.scene;
  map.scene(stateNow()?.outlines ?? [], sceneNow()?.base, things);
  marks();
  under();
}

// What follows a thing while it is dragged.
function moved() {
  map.placeThings();
  marks();
  under();
}

function marks() {
  const person = sceneNow()?.things.find((one) => one.category === "person")?.name;
  const positions = (stateNow()?.goals ?? []).map((at) => (things.find(person) ? things.moved(person, at) : at));
  const goals = page.outcome?.goals ?? [];
  map.marks(positions.map((position, i) => ({ at: position, number: i, reached: goals[i]?.reached })));
}

// Says what the base is under, e.g. the bed.
function under() {
  const { x, y, yaw } = map.pose;
  const base = map.base.map((point) => turned(point, yaw)).map(([px, py]) => [px + x, py + y]);
  const isFree = page.outcome?.goals.some((goal) => !["body_blocked", "excluded"].includes(goal.reason));
  const names = new Set();
  for (const { thing, points } of isFree ? map.outlines : []) {
    const there = things.find(thing) ? points.map((point) => things.moved(thing, point)) : points;
    if (overlap(base, there)) names.add(modelName(thing));
  }
  by("under").textContent = names.size ? t("under", { things: [...names].join(", ") }) : "";
}

async function otherStates(shown) {
  for (let state = 0; state < shown.floors.find(Boolean).states.length; state++) {
    await floorOf(shown, state);
    if (shown !== view) return;
  }
  listStates();
}

function listStates() {
  offerColours(view.floors);
  if (view.floors.filter(Boolean).length < floor().states.length) return;
  showStates(view.floors, by("score-of").value, view.state, paint, (state) => changeState(state).catch(fault));
}

async function changeState(state) {
  await floorOf(view, state);
  view.state = state;
  drawFloor();
  showScene();
  listStates();
  await move(map.pose);
}

const shownNow = () => `${view.file} ${view.state}`;

// What is in space is not what the rest of the page shows: says so until it is drawn anew.
function outdated() {
  by("building").hidden = false;
  by("canvas3d").dataset.old = "yes";
}

// Shows the place in space, the arm at the chosen goal or at the one of greatest dexterity.
async function space() {
  playing.clear();
  by("space").hidden = !view3d.isPossible;
  if (!view3d.isPossible) return;
  view3d.contact = [];
  const number = page.asked;
  const goal = by("armAt").value;
  const drawn = shownNow();
  const found = await post("posture", { ...placed(), ...(goal ? { goal: Number(goal) } : {}) });
  if (number !== page.asked) return;
  by("building").hidden = true;
  delete by("canvas3d").dataset.old;
  page.drawn = drawn;
  view3d.map(map.canvas, map.painted);
  view3d.scene(found, page.outcome.goals);
  if (page.lookedAt !== file().file) view3d.look(found.goals, [map.pose.x, map.pose.y]);
  page.lookedAt = file().file;
}

// Puts the robot somewhere, and shows what can be done from there; of a first answer the words alone, for the rest takes time.
async function move(pose, { best = false, torso = page.torso, isFirst = false } = {}) {
  const yaw = ((pose.yaw % 360) + 360) % 360;
  page.torso = torso;
  const { x, y } = map.within(pose);
  pose = { x, y };
  map.place({ x, y, yaw });
  if (page.drawn !== shownNow()) outdated();
  const number = ++page.asked;
  const request = { file: view.file, here: [pose.x, pose.y, yaw], torso, at: at(), best };
  let outcome;
  try {
    outcome = await post("outcome", request);
  } catch (error) {
    if (number === page.asked) fault(error);
    return;
  }
  if (number !== page.asked) return;
  const [member] = outcome.members;
  if (best) {
    page.torso = member.torso;
    map.place({ x: pose.x, y: pose.y, yaw: member.base_yaw_deg });
  }
  show(outcome);
  clearTimeout(page.suggesting);
  if (isFirst) return;
  space().catch(fault);
  page.suggesting = setTimeout(() => suggest(number).catch(fault), SETTLED);
}

function show(outcome) {
  page.outcome = outcome;
  by("fault").textContent = "";
  by("why").hidden = true;
  const blocked = outcome.goals.every((goal) => goal.reason === "body_blocked");
  by("words").textContent = blocked ? t("blocked") : `${sentence(outcome)}${outcome.refined ? ` ${t("refinedHere")}` : ""}`;
  const { x, y, yaw } = map.pose;
  by("x").value = x.toFixed(3);
  by("y").value = y.toFixed(3);
  by("yaw").value = yaw.toFixed(1);
  by("torso").value = floor().torsos.reduce((a, b) => (Math.abs(b - page.torso) < Math.abs(a - page.torso) ? b : a));
  showGoals(outcome, (goal) => why(goal).catch(fault), (goal) => fixOf(goal).catch(fault));
  const goals = outcome.goals.filter((goal) => goal.reached).map((goal) => [String(goal.goal), goalText(goal)]);
  options(by("armAt"), [["", t("bestGoal")], ...goals], by("armAt").value);
  showExpert(outcome, command());
  marks();
  under();
  const hash = { file: file().file, state: view === whole ? view.state : 0, x: x.toFixed(3), y: y.toFixed(3), yaw: yaw.toFixed(1), torso: page.torso };
  if (things.isChanged) hash.changes = things.saved();
  if (editing.at) hash.at = JSON.stringify(editing.at);
  history.replaceState(null, "", `#${new URLSearchParams(hash)}`);
}

function command() {
  const { x, y, yaw } = map.pose;
  const settings = Object.entries(at()).map(([name, value]) => ` --at ${name}=${value}`).join("");
  const weights = Object.entries(weightsGiven()).map(([name, value]) => ` --${name} ${value}`).join("");
  const here = `--here ${x.toFixed(3)} ${y.toFixed(3)} ${yaw.toFixed(1)} --torso ${page.torso}${settings}`;
  const name = fileName(".tcs");
  // The goal that was asked about, or the first one that is not reached.
  const goal = page.why ?? Math.max(page.outcome.goals.findIndex((one) => !one.reached), 0);
  const scoring = `tcs score ${file().task} --environment ${by("downloadEnvironment").download} --robot ${file().robot} --out ${name}\n`;
  return `${things.isChanged || editing.at ? scoring : ""}tcs select ${name} ${here}${weights}\ntcs explain ${name} --goal ${goal + 1} ${here}`;
}

function explained(goal) {
  page.why = goal.goal;
  showExpert(page.outcome, command());
  const { x, y, yaw } = map.pose;
  return post("explain", { file: view.file, goal: goal.goal, here: [x, y, yaw], torso: page.torso, at: at() });
}

async function why(goal) {
  const explanation = await explained(goal);
  view3d.contact = (goal.pair ?? []).map((name) => ({ name, text: bodyName(name, (thing) => things.find(thing)) }));
  view3d.draw();
  showWhy(goal, explanation, page.outcome.goals, view3d.contact.map(({ text }) => text), (fix) => go(fix.members[0]));
}

async function fixOf(goal) {
  const explanation = await explained(goal);
  const fix = explanation.nearest_reaching;
  if (fix && !fix.lost_goals.length) await go(fix.members[0]);
  else showWhy(goal, explanation, page.outcome.goals, [], () => go(fix.members[0]));
}

// Returns the number of the state of the environment that is nearest to that of a configuration.
function stateOf(member, states = floor().states) {
  const distance = (settings) => Object.entries(settings).reduce((sum, [name, value]) => sum + Math.abs(member[name] - value) / (name.endsWith("_deg") ? 60 : 1), 0);
  return states.reduce((best, settings, i, all) => (distance(settings) < distance(all[best]) ? i : best), 0);
}

// Shows a configuration: its base pose, torso height and state of the environment.
async function showPlace(member) {
  const state = stateOf(member);
  const pose = { x: member.base_x, y: member.base_y, yaw: member.base_yaw_deg };
  page.torso = member.torso;
  map.place(pose);
  if (state !== view.state) await changeState(state);
  else await move(pose);
}

async function go(member) {
  await showPlace(member);
  by("map").focus({ preventScroll: true });
}

// The weights that an expert has changed: with any of them the utility decides, not the recommendation.
function weightsGiven() {
  const names = ["alpha", "beta", "gamma"];
  if (names.every((name) => by(name).value === by(name).defaultValue)) return {};
  return Object.fromEntries(names.map((name) => [name, Number(by(name).value)]));
}

async function suggest(number) {
  const { x, y, yaw } = map.pose;
  const asked = { file: view.file, here: [x, y, yaw], torso: page.torso, at: at(), ...weightsGiven() };
  const choices = [];
  // The recommended set first; others have fewer places, or reach more.
  for (const size of [{}, ...SIZES.map((max_members) => ({ max_members }))]) {
    try {
      const choice = await post("select", { ...asked, ...size });
      const isOther = choices.every((other) => choice.members.length < other.members.length || choice.reachability > other.reachability + 1e-9);
      if (isOther) choices.push(choice);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
    }
  }
  if (number === page.asked) showCards(choices, (member) => go(member).catch(fault), (choice) => map.suggest(choice.members));
}

// Opens a file of this machine: a score file, or a task or an environment to score, which the service checks.
async function openOwn(chosen) {
  if (!chosen) return;
  if (chosen.name.endsWith(".tcs")) {
    const entry = await send(chosen);
    await listFiles(entry.file);
    await openFile();
    by("jobWords").textContent = t("opened", { name: chosen.name });
    return;
  }
  const text = await chosen.text();
  const kind = /^goals:/m.test(text) ? "task" : "environment";
  page.own[kind] = text;
  const select = by(kind);
  select.querySelector("[value='']")?.remove();
  made("option", chosen.name, select, { value: "" });
  select.value = "";
  by("jobWords").textContent = t(kind === "task" ? "ownTask" : "ownEnvironment", { name: chosen.name });
}

async function scoreNow() {
  const person = PERSONS[by("person").value];
  const request = { robot: by("robot").value };
  for (const kind of ["task", "environment"]) {
    if (by(kind).value) request[kind] = by(kind).value;
    else request[`${kind}_yaml`] = page.own[kind];
  }
  const job = await post("score", person ? { ...request, person } : request);
  by("job").hidden = false;
  by("cancel").onclick = () => cancel(job.job).catch(fault);
  const done = await ended(job.job, (state) => {
    const fraction = state.total ? state.done / state.total : 0;
    by("progress").value = fraction;
    const percent = 10 * Math.floor(10 * fraction);
    by("jobWords").textContent = state.note ? t("compiling") : state.state === "queued" ? t("waiting") : t("scoring", { percent });
  });
  by("job").hidden = true;
  by("jobWords").textContent = done.result ? t("done") : done.state === "cancelled" ? t("cancelled") : done.problem;
  if (!done.result) return;
  await listFiles(done.result.file);
  await openFile();
}

async function changeLanguage() {
  localStorage.setItem("tcs-language", by("language").value);
  await load(by("language").value);
  say();
  if (!page.files.length) by("words").textContent = t("noFile");
  if (!page.outcome) return;
  show(page.outcome);
  listStates();
  await suggest(page.asked);
}

by("file").onchange = () => openFile().catch(fault);
by("language").onchange = () => changeLanguage().catch(fault);
by("score").onsubmit = (event) => {
  event.preventDefault();
  scoreNow().catch((error) => { by("job").hidden = true; fault(error); });
};
by("ownFile").onchange = () => openOwn(by("ownFile").files[0]).catch(fault);
by("score-of").onchange = () => { drawFloor(); listStates(); };
by("map").onkeydown = (event) => {
  if (editing.keyed(event)) return event.preventDefault();
  const headings = floor()?.headings_deg ?? [];
  const pose = map.keyed(event, headings.length > 1 ? headings[1] - headings[0] : 15);
  if (!pose) return;
  event.preventDefault();
  move(pose).catch(fault);
};
by("turn").onclick = () => { editing.choose("robot"); by("map").onkeydown(new KeyboardEvent("keydown", { key: "r" })); };
by("pose").onsubmit = (event) => event.preventDefault();
by("pose").onchange = () => {
  const [x, y, yaw] = ["x", "y", "yaw"].map((id) => Number(by(id).value));
  move({ x, y, yaw }, { torso: Number(by("torso").value) });
};
for (const id of ["alpha", "beta", "gamma"]) by(id).onchange = () => { showExpert(page.outcome, command()); suggest(page.asked).catch(fault); };
by("armAt").onchange = () => space().catch(fault);
by("share").onclick = async () => {
  await navigator.clipboard?.writeText(location.href).catch(() => {});
  by("shared").textContent = t("copied");
};
start().catch(fault);

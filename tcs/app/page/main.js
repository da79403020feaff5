// The page: what is chosen, and what follows from each change of it.

import { Refusal, cancel, ended, get, post } from "./api.js";
import { FloorMap, paint } from "./map.js";
import { by, made, options, showCards, showExpert, showGoals, showLegend, showStates, showWhy } from "./panels.js";
import { load, sentence, t } from "./texts.js";

const PERSONS = {
  default: null,
  female5: { sex: "female", stature_percentile: 5 },
  female50: { sex: "female", stature_percentile: 50 },
  male50: { sex: "male", stature_percentile: 50 },
  male95: { sex: "male", stature_percentile: 95 },
};
const SETTLED = 350; // time after the last change at which places are suggested [ms]
const SIZES = [1, 2];

const page = { files: [], floors: [], scene: null, state: 0, torso: 0, outcome: null, asked: 0, suggesting: 0, known: null };
const map = new FloorMap(by("map"), (pose, isClick) => move(pose, { best: isClick && by("best").checked }));

const file = () => page.files.find((one) => one.file === by("file").value);
const floor = () => page.floors[page.state] ?? page.floors.find(Boolean);
const at = () => floor().states[page.state];

function fault(error) {
  by("fault").textContent = error instanceof Refusal ? error.message : String(error);
}

async function start() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  const language = wanted.get("language") ?? localStorage.getItem("tcs-language") ?? navigator.language.slice(0, 2);
  by("language").value = language === "de" ? "de" : "en";
  await load(by("language").value);
  say();
  await listFiles(wanted.get("file"));
  if (page.files.length) await openFile(wanted);
  else by("words").textContent = t("noFile");
  document.body.dataset.ready = "yes";
  page.known = await get("v1/list");
  offerTasks();
}

// Writes every text that is not in the document itself.
function say() {
  document.title = t("title");
  by("map").setAttribute("aria-label", t("mapLabel"));
  options(by("person"), Object.keys(PERSONS).map((key) => [key, t(`persons.${key}`)]), by("person").value || "default");
  by("limits").replaceChildren();
  for (const text of t("limits")) made("li", text, by("limits"));
  showLegend();
}

async function listFiles(chosen) {
  page.files = await get("v1/files");
  options(by("file"), page.files.map((one) => [one.file, one.title]), chosen);
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
  const known = task.environments.map((name) => [name, name]);
  options(by("environment"), known, file()?.environment);
}

async function openFile(wanted = new URLSearchParams()) {
  Object.assign(page, { floors: [], scene: null, state: Number(wanted.get("state") ?? 0), outcome: null });
  by("view").replaceChildren();
  by("environmentStates").hidden = true;
  by("download").href = `v1/files/${file().file}`;
  by("download").download = `${file().task}-${file().environment}-${file().robot}.tcs`;
  page.floors[page.state] = await post("floor", { file: file().file, state: page.state });
  options(by("torso"), floor().torsos.map((value) => [value, value.toFixed(2)]), wanted.get("torso"));
  page.torso = Number(by("torso").value);
  map.floor(floor(), by("score-of").value);
  map.scene([]);
  map.suggest([]);
  const given = ["x", "y", "yaw"].map((name) => wanted.get(name)).every((value) => value !== null);
  const pose = given ? { x: Number(wanted.get("x")), y: Number(wanted.get("y")), yaw: Number(wanted.get("yaw")) } : bestPlace();
  await move(pose, { best: !given });
  // The rest arrives while the page is in use.
  outlines(file().file).catch(fault);
  otherStates(file().file).catch(fault);
}

// Returns the base position with the greatest score, where the page begins.
function bestPlace() {
  const { x, y, reachability, headings_deg } = floor();
  const yaw = headings_deg[0];
  let best = { x: x[0], y: y[0], yaw, value: -1 };
  x.forEach((px, i) => y.forEach((py, j) => {
    if (reachability[i][j] > best.value) best = { x: px, y: py, yaw, value: reachability[i][j] };
  }));
  return best;
}

async function outlines(asked) {
  const job = await post("scene", { file: asked });
  const done = await ended(job.job, () => {});
  if (asked !== file().file) return;
  if (!done.result) throw new Refusal(done.problem);
  page.scene = done.result;
  showScene();
}

function showScene() {
  const state = page.scene?.states[page.state];
  map.scene(state?.outlines ?? [], page.scene?.base);
  marks();
}

function marks() {
  const positions = page.scene?.states[page.state]?.goals ?? [];
  const goals = page.outcome?.goals ?? [];
  map.marks(positions.map((position, i) => ({ at: position, number: i + 1, reached: goals[i]?.reached })));
}

async function otherStates(asked) {
  for (let state = 0; state < floor().states.length; state++) {
    page.floors[state] ??= await post("floor", { file: asked, state });
    if (asked !== file().file) return;
  }
  listStates();
}

function listStates() {
  if (page.floors.filter(Boolean).length < floor().states.length) return;
  showStates(page.floors, by("score-of").value, page.state, paint, (state) => changeState(state));
}

async function changeState(state) {
  page.state = state;
  page.floors[state] ??= await post("floor", { file: file().file, state });
  map.floor(floor(), by("score-of").value);
  showScene();
  listStates();
  await move(map.pose);
}

// Puts the robot somewhere, and shows what can be done from there.
async function move(pose, { best = false, torso = page.torso } = {}) {
  const yaw = ((pose.yaw % 360) + 360) % 360;
  page.torso = torso;
  map.place({ x: pose.x, y: pose.y, yaw });
  const number = ++page.asked;
  const request = { file: file().file, here: [pose.x, pose.y, yaw], torso, at: at(), best };
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
  page.suggesting = setTimeout(() => suggest(number).catch(fault), SETTLED);
}

function show(outcome) {
  page.outcome = outcome;
  by("fault").textContent = "";
  by("why").hidden = true;
  const blocked = outcome.goals.every((goal) => goal.reason === "body_blocked");
  by("words").textContent = blocked ? t("blocked") : sentence(outcome);
  const { x, y, yaw } = map.pose;
  by("x").value = x.toFixed(3);
  by("y").value = y.toFixed(3);
  by("yaw").value = yaw.toFixed(1);
  by("torso").value = floor().torsos.reduce((a, b) => (Math.abs(b - page.torso) < Math.abs(a - page.torso) ? b : a));
  showGoals(outcome, (goal) => why(goal).catch(fault), (goal) => fixOf(goal).catch(fault));
  showExpert(outcome, command());
  marks();
  const hash = { file: file().file, state: page.state, x: x.toFixed(3), y: y.toFixed(3), yaw: yaw.toFixed(1), torso: page.torso };
  history.replaceState(null, "", `#${new URLSearchParams(hash)}`);
}

function command() {
  const { x, y, yaw } = map.pose;
  const settings = Object.entries(at()).map(([name, value]) => ` --at ${name}=${value}`).join("");
  const weights = ["alpha", "beta", "gamma"].map((name) => ` --${name} ${by(name).value}`).join("");
  const here = `--here ${x.toFixed(3)} ${y.toFixed(3)} ${yaw.toFixed(1)} --torso ${page.torso}${settings}`;
  const name = `${file().task}-${file().environment}-${file().robot}.tcs`;
  return `tcs select ${name} ${here}${weights}\ntcs explain ${name} --goal 0 ${here}`;
}

function explained(goal) {
  const { x, y, yaw } = map.pose;
  return post("explain", { file: file().file, goal: goal.goal, here: [x, y, yaw], torso: page.torso, at: at() });
}

async function why(goal) {
  const explanation = await explained(goal);
  showWhy(goal, explanation, page.outcome.goals, (fix) => go(fix.members[0]));
}

async function fixOf(goal) {
  const explanation = await explained(goal);
  const fix = explanation.nearest_reaching;
  if (fix) await go(fix.members[0]);
  else showWhy(goal, explanation, page.outcome.goals, () => {});
}

// Goes to a configuration: its base pose, torso height and state of the environment.
async function go(member) {
  const state = floor().states.findIndex((settings) =>
    Object.entries(settings).every(([name, value]) => Math.abs(member[name] - value) < 1e-6));
  const pose = { x: member.base_x, y: member.base_y, yaw: member.base_yaw_deg };
  page.torso = member.torso;
  map.place(pose);
  if (state >= 0 && state !== page.state) await changeState(state);
  else await move(pose);
  by("map").focus({ preventScroll: true });
}

async function suggest(number) {
  const { x, y, yaw } = map.pose;
  const weights = Object.fromEntries(["alpha", "beta", "gamma"].map((name) => [name, Number(by(name).value)]));
  const asked = { file: file().file, here: [x, y, yaw], torso: page.torso, at: at(), ...weights };
  const choices = [];
  for (const max_members of SIZES) {
    try {
      const choice = await post("select", { ...asked, max_members });
      // A larger set is offered only where it reaches more.
      if (!choices.some((other) => other.reachability >= choice.reachability - 1e-9)) choices.push(choice);
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
    }
  }
  if (number === page.asked) showCards(choices, (member) => go(member).catch(fault), (choice) => map.suggest(choice.members));
}

async function scoreNow() {
  const person = PERSONS[by("person").value];
  const request = { task: by("task").value, environment: by("environment").value, robot: by("robot").value };
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

function show3d() {
  const view = by("view");
  view.replaceChildren();
  const waiting = made("p", t("loading3d"), view, { role: "status" });
  const frame = made("iframe", undefined, view, { title: t("view3d"), sandbox: "allow-scripts", src: `v1/files/${file().file}/view` });
  frame.onload = () => waiting.remove();
}

async function changeLanguage() {
  localStorage.setItem("tcs-language", by("language").value);
  await load(by("language").value);
  say();
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
by("score-of").onchange = () => { map.floor(floor(), by("score-of").value); listStates(); };
by("map").onkeydown = (event) => {
  const headings = floor()?.headings_deg ?? [];
  const pose = map.keyed(event, headings.length > 1 ? headings[1] - headings[0] : 15);
  if (!pose) return;
  event.preventDefault();
  move(pose);
};
by("turn").onclick = () => by("map").onkeydown(new KeyboardEvent("keydown", { key: "r" }));
by("pose").onsubmit = (event) => event.preventDefault();
by("pose").onchange = () => {
  const [x, y, yaw] = ["x", "y", "yaw"].map((id) => Number(by(id).value));
  move({ x, y, yaw }, { torso: Number(by("torso").value) });
};
for (const id of ["alpha", "beta", "gamma"]) by(id).onchange = () => { showExpert(page.outcome, command()); suggest(page.asked).catch(fault); };
by("show3d").onclick = show3d;
by("share").onclick = async () => {
  await navigator.clipboard?.writeText(location.href).catch(() => {});
  by("jobWords").textContent = t("copied");
};
start().catch(fault);

// Changing the scene: things moved with the pointer or the keys, furniture and regions added, sliders; each change is scored again.

import { cancel, ended, post } from "./api.js";
import { by, made, options } from "./panels.js";
import { modelName, setting, t } from "./texts.js";

const PIECES = ["chair", "table", "cabinet", "wall", "door", "region"];
const SETTLED = 150; // time after the last change of a key or a slider at which it is scored [ms]
const LARGE = 20000; // configurations in a state from which on a part of them is scored first
const TURN = 15; // rotation of a thing by one press of R [deg]
const SAME = 1e-4; // difference of two settings that is rounding
const PLACED = /_(x|y|yaw|slide)(_deg)?$/; // joints that dragging stands in for

export class Editing {
  // `view` is what the page shows: its methods `scored`, `restore`, `nearest`, `fault`, and the values `file`, `at`, `states`, the
  // `size` of a state and the `place` of the robot.
  constructor(map, things, view) {
    Object.assign(this, { map, things, view });
    this.jobs = [];
    this.run = 0;
    this.at = null; // settings that are off the table
    by("subject").onchange = () => this.choose(by("subject").value);
    by("addPiece").onclick = () => this.add(by("piece").value);
    by("removePiece").onclick = () => this.remove();
    by("drawRegion").onclick = () => this.draw(!map.isDrawing);
    by("undo").onclick = () => this.undo();
    by("thingPose").onsubmit = (event) => event.preventDefault();
    by("thingPose").onchange = () => this.typed();
  }

  // Takes the scene of the file before any change.
  offer(scene, outlines, saved, at) {
    this.scene = scene;
    this.things.scene(scene, outlines);
    if (at) this.at = this.#settings(JSON.parse(at));
    if (saved) this.things.restore(saved);
    this.say();
    if (!saved && !this.at) return;
    this.map.placeThings();
    if (this.things.isChanged || this.at) this.rescore();
  }

  // The settings of an address that the sliders have, within their limits; null where one is missing.
  #settings(at) {
    const all = this.scene.axes.map(({ name, low, high }) => [name, Math.min(Math.max(at[name], low), high)]);
    return all.length && all.every(([, value]) => Number.isFinite(value)) ? Object.fromEntries(all) : null;
  }

  clear() {
    this.stop();
    this.things.clear();
    [this.scene, this.at] = [null, null];
    by("editing").hidden = true;
    by("changed").textContent = "";
  }

  // Writes everything of the panel that depends on the language or on what there is.
  say() {
    by("editing").hidden = !this.scene;
    if (!this.scene) return;
    options(by("piece"), PIECES.map((name) => [name, t(`pieces.${name}`)]), by("piece").value);
    this.#list();
    this.#sliders();
  }

  #list() {
    const subjects = ["robot", ...this.things.names];
    options(by("subject"), subjects.map((name) => [name, modelName(name)]), this.map.subject);
    this.choose(subjects.includes(this.map.subject) ? this.map.subject : "robot");
  }

  choose(name) {
    this.map.subject = name;
    by("subject").value = name;
    const isThing = name !== "robot";
    by("thingPose").hidden = !isThing;
    by("removePiece").hidden = !isThing || !this.things.isAdded(name);
    if (isThing) {
      const { x, y, turn } = this.things.pose(name);
      [by("thingX").value, by("thingY").value, by("thingTurn").value] = [x.toFixed(2), y.toFixed(2), turn.toFixed(0)];
      const size = this.things.find(name).size;
      const isRegion = this.things.find(name).piece === "region";
      for (const part of ["Width", "Depth"]) {
        by(`thing${part}`).parentNode.hidden = !isRegion;
        if (isRegion) by(`thing${part}`).value = size[part.toLowerCase()].toFixed(2);
      }
    }
    this.map.placeThings();
  }

  typed() {
    const name = this.map.subject;
    const one = this.things.find(name);
    if (one.piece === "region") {
      const size = (id) => Math.min(Math.max(Number(by(id).value) || 0.1, 0.1), 10);
      one.size = { width: size("thingWidth"), depth: size("thingDepth") };
    }
    const [x, y, turn] = ["thingX", "thingY", "thingTurn"].map((id) => Number(by(id).value) || 0);
    this.things.put(name, { x, y, turn });
    this.view.redraw();
    this.later();
  }

  // Moves a thing while it is dragged, and scores where it is let go.
  dragged(name, pose, isEnd) {
    this.things.put(name, pose);
    if (this.map.subject !== name) this.choose(name);
    this.view.moved();
    if (!isEnd) return;
    this.choose(name);
    this.rescore();
  }

  // Applies an arrow key, R or Delete to the chosen thing; returns whether it was one.
  keyed(event) {
    const name = this.map.subject;
    if (name === "robot") return false;
    if (event.key === "Delete" && this.things.isAdded(name)) {
      this.remove();
      return true;
    }
    const { x, y, turn } = this.things.pose(name);
    const pose = this.map.keyed(event, TURN, { x, y, yaw: turn });
    if (!pose) return false;
    this.things.put(name, { x: pose.x, y: pose.y, turn: pose.yaw });
    this.choose(name);
    this.view.moved();
    this.later();
    return true;
  }

  add(piece) {
    const { left, right, low, high } = this.map.bounds;
    const number = this.things.added.length + this.things.regions.length;
    const free = { x: left + (0.2 + 0.05 * (number % 10)) * (right - left), y: low + 0.3 * (high - low), turn: 0 };
    this.#added(this.things.add(piece, free));
  }

  region([ax, ay], [bx, by_]) {
    this.draw(false);
    const size = { width: Math.max(Math.abs(bx - ax), 0.1), depth: Math.max(Math.abs(by_ - ay), 0.1) };
    this.#added(this.things.add("region", { x: (ax + bx) / 2, y: (ay + by_) / 2, turn: 0 }, size));
  }

  #added(name) {
    this.map.subject = name;
    this.#list();
    this.view.redraw();
    this.rescore();
    by("map").focus({ preventScroll: true });
  }

  remove() {
    this.things.remove(this.map.subject);
    this.#list();
    this.view.redraw();
    this.rescore();
  }

  draw(isDrawing) {
    this.map.isDrawing = isDrawing;
    by("drawRegion").setAttribute("aria-pressed", isDrawing);
    if (isDrawing) by("changed").textContent = t("drawHint");
  }

  undo() {
    this.things.reset();
    this.at = null;
    this.say();
    this.view.redraw();
    this.rescore();
  }

  #sliders() {
    const list = by("sliders");
    list.replaceChildren();
    const at = { ...this.view.at, ...this.at };
    for (const { name, low, high } of this.scene.axes) {
      this.#slider(list, name, low, high, at[name], (value, isEnd) => this.#axis(name, value, isEnd));
    }
    for (const { name, low, high, value } of this.scene.joints) {
      if (PLACED.test(name) || high - low < SAME) continue;
      this.#slider(list, name, low, high, this.things.joints[name] ?? value, (chosen, isEnd) => {
        this.things.joints[name] = chosen;
        if (Math.abs(chosen - value) < SAME) delete this.things.joints[name];
        if (isEnd) this.later();
      });
    }
  }

  #slider(list, name, low, high, value, onValue) {
    const label = made("label", undefined, list);
    const text = made("span", setting(name, value), label);
    const step = name.endsWith("_deg") ? 1 : 0.01;
    const slider = made("input", undefined, label, { type: "range", min: low, max: high, step, "data-name": name });
    slider.value = value;
    const chosen = () => {
      const one = Number(slider.value);
      text.textContent = setting(name, one);
      slider.setAttribute("aria-valuetext", text.textContent);
      return one;
    };
    slider.setAttribute("aria-valuetext", text.textContent);
    slider.oninput = () => onValue(chosen(), false);
    slider.onchange = () => onValue(chosen(), true);
  }

  // Shows the nearest scored state at once; what is off the table is scored where the slider is let go.
  #axis(name, value, isEnd) {
    const wanted = { ...this.view.at, ...this.at, [name]: value };
    const distance = (state) => Object.keys(wanted).reduce((sum, key) => sum + Math.abs(state[key] - wanted[key]) / (key.endsWith("_deg") ? 60 : 1), 0);
    const states = this.view.states;
    const nearest = states.reduce((best, state, i) => (distance(state) < distance(states[best]) ? i : best), 0);
    this.at = distance(states[nearest]) < SAME ? null : wanted;
    this.stop();
    this.view.nearest(nearest).catch(this.view.fault);
    if (this.at) by("changed").textContent = t("nearest");
    if (isEnd && this.at) this.later();
  }

  later() {
    this.stop();
    this.waiting = setTimeout(() => this.rescore(), SETTLED);
  }

  stop() {
    clearTimeout(this.waiting);
    this.run++;
    for (const job of this.jobs.splice(0)) cancel(job).catch(() => {});
    document.body.removeAttribute("aria-busy");
  }

  // Scores the changed scene: the visible state first, then the others.
  async rescore() {
    this.stop();
    const run = this.run;
    by("changed").textContent = "";
    if (!this.things.isChanged && !this.at) {
      this.view.restore().catch(this.view.fault);
      return;
    }
    const changes = this.things.request();
    const one = { file: this.view.file, ...changes, at: { ...this.view.at, ...this.at }, only_state: true };
    const isOne = this.view.states.length < 2;
    by("changed").textContent = t("rescoring");
    this.view.outdated();
    const isWanted = () => run === this.run;
    document.body.setAttribute("aria-busy", "true");
    const begun = performance.now();
    const seconds = () => ((performance.now() - begun) / 1000).toFixed(1);
    try {
      if (this.view.size >= LARGE) {
        const some = await this.#scored({ ...one, every: 2, around: this.view.place, max_members: 1 }, run);
        if (!some) return;
        await this.view.scored(some, { isOne: true, isFirst: true, state: one.at, isWanted });
        if (run !== this.run) return;
        by("changed").textContent = t("rescoredFirst", { seconds: seconds() });
        document.body.dataset.answered = seconds();
      }
      const first = await this.#scored(one, run);
      if (!first) return;
      await this.view.scored(first, { isOne: true, state: one.at, isWanted });
      if (run !== this.run) return;
      by("changed").textContent = t(this.at || isOne ? "rescored" : "rescoredOne", { seconds: seconds() });
      document.body.dataset.rescored = seconds();
      if (isOne || this.at) return;
      const whole = await this.#scored({ file: this.view.file, ...changes }, run);
      if (!whole) return;
      await this.view.scored(whole, { isOne: false, state: one.at, isWanted });
      if (run !== this.run) return;
      by("changed").textContent = t("rescoredAll");
    } catch (error) {
      if (run === this.run) {
        by("changed").textContent = "";
        this.view.fault(error);
      }
    } finally {
      if (run === this.run) document.body.removeAttribute("aria-busy");
    }
  }

  async #scored(request, run) {
    const job = await post("rescore", request);
    this.jobs.push(job.job);
    if (run !== this.run) {
      cancel(job.job).catch(() => {});
      return null;
    }
    const done = await ended(job.job, (state) => {
      if (run === this.run && state.note) by("changed").textContent = t("compiling");
    });
    this.jobs = this.jobs.filter((one) => one !== job.job);
    if (run !== this.run || done.state === "cancelled") return null;
    if (!done.result) throw new Error(done.problem);
    return done.result.file;
  }
}

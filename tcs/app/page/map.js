// The map of the floor: scores as colours, furniture and person to scale, the robot to drag and turn.

import { MARKS, grouped, whole } from "./marks.js";

const SVG = "http://www.w3.org/2000/svg";
const SCALE = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]]; // viridis
const COLOURS = { person: "#e3a57f", furniture: "#7b8794", blocked: [196, 202, 209], added: "#8a7350", region: "#b3003b" };
export const IN_SOME_FILES = ["success", "motion"]; // colours that only some files have, and only in places
const HANDLE = 0.62; // distance of the handle from the middle of the base [m]
const DRAG = 4; // movement that makes a click a drag [px]
const UNKNOWN_BASE = [[0.3, 0.3], [-0.3, 0.3], [-0.3, -0.3], [0.3, -0.3]]; // until the outline is there [m]

function colour(fraction) {
  const at = Math.min(Math.max(fraction, 0), 1) * (SCALE.length - 1);
  const low = Math.min(Math.floor(at), SCALE.length - 2);
  return SCALE[low].map((value, i) => Math.round(value + (at - low) * (SCALE[low + 1][i] - value)));
}

// Draws the scores on a canvas, one pixel for each base position, the greatest y at the top.
export function paint(canvas, floor, score) {
  const [columns, rows] = [floor.x.length, floor.y.length];
  [canvas.width, canvas.height] = [columns, rows];
  const context = canvas.getContext("2d");
  const pixels = context.createImageData(columns, rows);
  const values = floor[score];
  const most = score === "manipulability" ? Math.max(...values.flat(), 1e-9) : 1;
  for (let i = 0; i < columns; i++) {
    for (let j = 0; j < rows; j++) {
      const free = floor.free[i][j];
      const value = values?.[i][j] ?? null;
      // White: nothing is reached, or nothing was computed; where something was, none of it has a colour too.
      const isShown = value !== null && (value > 0 || IN_SOME_FILES.includes(score));
      const shown = !free ? COLOURS.blocked : isShown ? colour(value / most) : [255, 255, 255];
      pixels.data.set([...shown, 255], 4 * ((rows - 1 - j) * columns + i));
    }
  }
  context.putImageData(pixels, 0, 0);
}

const stepOf = (list) => (list.length > 1 ? list[1] - list[0] : 0.1);

function boundsOf({ x, y }) {
  const [dx, dy] = [stepOf(x) / 2, stepOf(y) / 2];
  return { left: x[0] - dx, right: x.at(-1) + dx, low: y[0] - dy, high: y.at(-1) + dy };
}

function element(name, attributes, parent, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  parent?.append(made);
  return made;
}

const points = (list) => list.map(([x, y]) => `${x},${-y}`).join(" ");

export class FloorMap {
  // `onPose` is called with {x, y, yaw} [m, deg] and whether the base was put there by a click, `onThing` with the name and the new
  // pose of a thing and whether it was let go, `onRegion` with the corners of a region that was drawn.
  constructor(svg, { onPose, onThing, onRegion }) {
    this.svg = svg;
    Object.assign(this, { onPose, onThing, onRegion });
    this.isDrawing = false;
    this.things = null;
    this.subject = "robot";
    this.pose = { x: 0, y: 0, yaw: 0 };
    this.base = UNKNOWN_BASE;
    this.canvas = document.createElement("canvas");
    this.image = element("image", { preserveAspectRatio: "none" }, svg);
    this.below = element("g", {}, svg);
    this.stops = element("g", { "pointer-events": "none" }, svg);
    this.robot = element("g", {}, svg);
    this.goals = element("g", { "pointer-events": "none" }, svg);
    svg.addEventListener("pointerdown", (event) => this.#down(event));
  }

  // Takes what is drawn, and the step of the arrow keys, from the floor of a file.
  extent(floor) {
    this.step = Math.min(stepOf(floor.x), stepOf(floor.y));
    this.bounds = boundsOf(floor);
    const { left, right, low, high } = this.bounds;
    this.svg.setAttribute("viewBox", `${left} ${-high} ${right - left} ${high - low}`);
    this.#ruler();
  }

  // Draws scores, of all base positions or of some.
  floor(floor, score) {
    paint(this.canvas, floor, score);
    this.painted = boundsOf(floor);
    const { left, right, low, high } = this.painted;
    const place = { x: left, y: -high, width: right - left, height: high - low, href: this.canvas.toDataURL() };
    for (const [key, value] of Object.entries(place)) this.image.setAttribute(key, value);
  }

  // Draws the scene, a group for each thing, in the order of its lowest outline; what stands on a thing moves with it.
  scene(outlines, base, things) {
    this.base = base ?? UNKNOWN_BASE;
    [this.outlines, this.things] = [outlines, things];
    this.#drawThings();
    this.#ruler();
    this.#draw();
  }

  #drawThings() {
    this.below.replaceChildren();
    this.groups = new Map();
    if (!this.things) return;
    const group = (thing) => {
      if (this.groups.has(thing.name)) return this.groups.get(thing.name);
      const above = thing.on ? this.things.find(thing.on) : null;
      const made = element("g", { class: "thing", "data-name": thing.name }, above ? group(above) : this.below);
      this.groups.set(thing.name, made);
      return made;
    };
    const line = { stroke: "#00000088", "stroke-width": 0.01 };
    const isAbove = ({ thing }) => (this.things.find(thing)?.on ? 1 : 0);
    for (const { category, points: list, thing } of [...this.outlines].sort((a, b) => isAbove(a) - isAbove(b))) {
      const parent = this.things.find(thing);
      element("polygon", { points: points(list), fill: COLOURS[category], ...line }, parent ? group(parent) : this.below);
    }
    for (const one of [...this.things.added, ...this.things.regions]) {
      const look = one.piece === "region"
        ? { fill: `${COLOURS.region}22`, stroke: COLOURS.region, "stroke-width": 0.02, "stroke-dasharray": "0.08 0.05" }
        : { fill: COLOURS.added, ...line };
      for (const list of this.things.outlines(one)) element("polygon", { points: points(list), ...look }, group(one));
      if (one.piece === "door") element("path", { d: "M0 .45A.9 .9 0 0 0 .9 -.45L0 -.45", fill: "none", ...line, "stroke-dasharray": "0.04" }, group(one));
    }
    this.placeThings();
  }

  // Moves the groups to where their things are.
  placeThings() {
    for (const [name, group] of this.groups ?? []) {
      if (!this.things.find(name)) continue; // removed, and not yet redrawn
      const { x, y, turn } = this.things.pose(name);
      const [cx, cy] = this.things.find(name).centre ?? [0, 0];
      group.setAttribute("transform", `translate(${x} ${-y}) rotate(${-turn} ${cx} ${-cy})`);
      group.classList.toggle("chosen", name === this.subject);
    }
  }

  #ruler() {
    this.ruler?.remove();
    if (!this.bounds) return;
    const [x, y] = [this.bounds.left + 0.2, -this.bounds.low - 0.2];
    this.ruler = element("g", { "pointer-events": "none" }, this.svg);
    element("line", { x1: x, y1: y, x2: x + 1, y2: y, stroke: "#111", "stroke-width": 0.03 }, this.ruler);
    element("text", { x: x + 0.5, y: y - 0.07, "font-size": 0.16, "text-anchor": "middle", fill: "#111", stroke: "#fff",
      "stroke-width": 0.04, "paint-order": "stroke" }, this.ruler, "1 m");
  }

  // Goals as numbered marks: a disc where reached, a square where not.
  marks(goals) {
    this.goals.replaceChildren();
    const { left, right, low, high } = this.bounds;
    for (const { at, text, reached, wide } of grouped(goals, 0.06)) {
      const half = 0.05 * wide;
      const [x, y] = [whole(at[0], half, left, right), -whole(at[1], 0.05, low, high)];
      const outline = { fill: reached ? MARKS.reached : MARKS.unreached, stroke: "#fff", "stroke-width": 0.012 };
      element("rect", { x: x - half, y: y - 0.05, width: 2 * half, height: 0.1, rx: reached ? 0.05 : 0, ...outline }, this.goals);
      element("text", { x, y: y + 0.026, "font-size": 0.075, "text-anchor": "middle", fill: "#fff" }, this.goals, text);
    }
  }

  suggest(members) {
    this.stops.replaceChildren();
    members.forEach((member, i) => {
      const at = `translate(${member.base_x} ${-member.base_y}) rotate(${-member.base_yaw_deg})`;
      if (member.window) {
        const { x, y } = member.window;
        element("rect", { x: member.base_x - x, y: -member.base_y - y, width: 2 * x, height: 2 * y, class: "window", fill: "#b3003b33",
          stroke: "#b3003b", "stroke-width": 0.012 }, this.stops);
      }
      element("polygon", { points: points(this.base), transform: at, fill: "none", stroke: "#b3003b", "stroke-width": 0.03 }, this.stops);
      element("text", { x: member.base_x, y: -member.base_y + 0.07, "font-size": 0.22, "text-anchor": "middle", fill: "#b3003b",
        stroke: "#fff", "stroke-width": 0.05, "paint-order": "stroke" }, this.stops, i + 1);
    });
  }

  place(pose) {
    this.pose = pose;
    this.#draw();
  }

  #draw() {
    const { x, y, yaw } = this.pose;
    this.robot.replaceChildren();
    this.robot.setAttribute("transform", `translate(${x} ${-y}) rotate(${-yaw})`);
    const line = { stroke: "#111", "stroke-width": 0.03 };
    element("polygon", { points: points(this.base), class: "robot", fill: "#ffffffb0", ...line }, this.robot);
    element("path", { d: `M0 0H${HANDLE}`, ...line }, this.robot);
    element("path", { d: "M.16 .11L.36 0L.16 -.11Z", fill: "#111", class: "robot" }, this.robot);
    element("circle", { cx: HANDLE, cy: 0, r: 0.22, fill: "transparent", class: "handle" }, this.robot);
    element("circle", { cx: HANDLE, cy: 0, r: 0.085, fill: "#fff", class: "handle", ...line }, this.robot);
  }

  #at(event, within = this.svg) {
    const screen = within.getScreenCTM().inverse();
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(screen);
    return [point.x, -point.y];
  }

  #down(event) {
    if (event.button) return;
    const what = event.target.getAttribute("class");
    const thing = event.target.closest(".thing");
    const start = this.#at(event);
    const before = this.pose;
    if (this.isDrawing) return this.#follow(event, this.#rectangle(start));
    if (thing) return this.#follow(event, this.#dragThing(event, thing, start));
    this.#follow(event, {
      move: (moved) => {
        const [x, y] = this.#at(moved);
        if (what === "handle") this.onPose({ ...before, yaw: (Math.atan2(y - before.y, x - before.x) * 180) / Math.PI }, false);
        else if (what) this.onPose({ ...before, ...this.#inside(before.x + x - start[0], before.y + y - start[1]) }, false);
      },
      up: () => {},
      click: () => what !== "handle" && this.onPose({ ...before, ...this.#inside(...start) }, true),
    });
  }

  // Follows a pointer until it is let go: a click if it hardly moved, else moves and an end.
  #follow(event, { move, up, click }) {
    let dragged = false;
    this.svg.setPointerCapture(event.pointerId);
    const moves = (moved) => {
      dragged ||= Math.hypot(moved.clientX - event.clientX, moved.clientY - event.clientY) >= DRAG;
      if (dragged) move(moved);
    };
    const end = (last) => {
      this.svg.removeEventListener("pointermove", moves);
      for (const name of ["pointerup", "pointercancel"]) this.svg.removeEventListener(name, end);
      if (dragged) up(last);
      else click();
    };
    this.svg.addEventListener("pointermove", moves);
    for (const name of ["pointerup", "pointercancel"]) this.svg.addEventListener(name, end);
  }

  #dragThing(event, group, start) {
    const name = group.dataset.name;
    const before = { ...this.things.pose(name) };
    const parent = group.parentNode;
    const begun = this.#at(event, parent);
    const there = (moved) => {
      const [x, y] = this.#at(moved, parent);
      return { ...before, x: before.x + x - begun[0], y: before.y + y - begun[1] };
    };
    return {
      move: (moved) => this.onThing(name, there(moved), false),
      up: (last) => this.onThing(name, there(last), true),
      click: () => this.onPose({ ...this.pose, ...this.#inside(...start) }, true),
    };
  }

  #rectangle([x, y]) {
    const shown = element("rect", { fill: `${COLOURS.region}33`, stroke: COLOURS.region, "stroke-width": 0.02 }, this.svg);
    const corner = (event) => this.#inside(...this.#at(event));
    return {
      move: (event) => {
        const to = corner(event);
        const size = { x: Math.min(x, to.x), y: -Math.max(y, to.y), width: Math.abs(to.x - x), height: Math.abs(to.y - y) };
        for (const [key, value] of Object.entries(size)) shown.setAttribute(key, value);
      },
      up: (event) => {
        const to = corner(event);
        shown.remove();
        this.onRegion([x, y], [to.x, to.y]);
      },
      click: () => shown.remove(),
    };
  }

  #inside(x, y) {
    const { left, right, low, high } = this.bounds;
    const edge = 0.001;
    return { x: Math.min(Math.max(x, left + edge), right - edge), y: Math.min(Math.max(y, low + edge), high - edge) };
  }

  // Returns the pose {x, y, yaw} after an arrow key or R, null for other keys.
  keyed(event, turn, { x, y, yaw } = this.pose) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (steps) return { yaw, x: x + steps[0] * this.step, y: y + steps[1] * this.step };
    if (event.key.toLowerCase() === "r" && !event.ctrlKey && !event.metaKey) return { x, y, yaw: yaw + (event.shiftKey ? -turn : turn) };
    return null;
  }

  // Returns a pose with its position moved into the map.
  within(pose) {
    return { ...pose, ...this.#inside(pose.x, pose.y) };
  }
}

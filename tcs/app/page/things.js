// What can be moved on the floor: models, obstacles, added furniture and keep-out regions, and how far each has been moved.

const RADIANS = Math.PI / 180;
export const REGION = { width: 0.6, depth: 0.6 }; // size of a new keep-out region [m]

export const turned = ([x, y], degrees) => {
  const [cos, sin] = [Math.cos(degrees * RADIANS), Math.sin(degrees * RADIANS)];
  return [cos * x - sin * y, sin * x + cos * y];
};

function middle(outlines) {
  const all = outlines.flat();
  const [xs, ys] = [all.map(([x]) => x), all.map(([, y]) => y)];
  return [(Math.min(...xs) + Math.max(...xs)) / 2, (Math.min(...ys) + Math.max(...ys)) / 2];
}

export class Things {
  constructor() {
    this.clear();
  }

  clear() {
    Object.assign(this, { models: [], added: [], regions: [], pieces: {}, moves: {}, joints: {} });
  }

  // Takes the scene before the changes: things with poses in their parents, and what can be added.
  scene(scene, outlines) {
    this.pieces = scene.pieces;
    this.models = scene.things.map((thing) => {
      const above = scene.things.find((one) => one.name === thing.on);
      const [x, y] = above ? turned([thing.x, thing.y], above.turn_deg) : [thing.x, thing.y];
      const own = outlines.filter((one) => one.thing === thing.name).map((one) => one.points);
      return { ...thing, axis: above?.turn_deg ?? 0, origin: above ? [above.x + x, above.y + y] : [x, y], centre: own.length ? middle(own) : [x, y] };
    });
  }

  get names() {
    return [...this.models, ...this.added, ...this.regions].map((one) => one.name);
  }

  get isChanged() {
    return this.names.some((name) => this.isMoved(name)) || this.added.length + this.regions.length + Object.keys(this.joints).length > 0;
  }

  isMoved(name) {
    return Object.values(this.moves[name] ?? {}).some(Boolean);
  }

  find(name) {
    return [...this.models, ...this.added, ...this.regions].find((one) => one.name === name);
  }

  isAdded(name) {
    return [...this.added, ...this.regions].some((one) => one.name === name);
  }

  // The displacement of a model, or the pose of what was added: x, y [m] and turn [deg].
  pose(name) {
    return this.isAdded(name) ? this.find(name).pose : (this.moves[name] ?? { x: 0, y: 0, turn: 0 });
  }

  put(name, pose) {
    const rounded = { x: +pose.x.toFixed(3), y: +pose.y.toFixed(3), turn: +(((pose.turn % 360) + 540) % 360 - 180).toFixed(1) };
    if (this.isAdded(name)) this.find(name).pose = rounded;
    else this.moves[name] = rounded;
  }

  add(piece, pose, size = REGION) {
    const list = piece === "region" ? this.regions : this.added;
    let number = 1;
    while (this.names.includes(`${piece}_${number}`)) number++;
    list.push({ name: `${piece}_${number}`, piece, pose, size, on: null });
    return `${piece}_${number}`;
  }

  remove(name) {
    this.added = this.added.filter((one) => one.name !== name);
    this.regions = this.regions.filter((one) => one.name !== name);
  }

  reset() {
    Object.assign(this, { added: [], regions: [], moves: {}, joints: {} });
  }

  // Outlines of what was added, in its own frame.
  outlines(one) {
    if (one.piece !== "region") return this.pieces[one.piece] ?? [];
    const { width, depth } = one.size;
    return [[[1, 1], [-1, 1], [-1, -1], [1, -1]].map(([a, b]) => [(a * width) / 2, (b * depth) / 2])];
  }

  // Where a point of a thing is after the moves.
  moved(name, point) {
    const thing = this.find(name);
    const { x, y, turn } = this.pose(name);
    const [cx, cy] = thing.centre ?? [0, 0];
    const [px, py] = turned([point[0] - cx, point[1] - cy], turn);
    const there = [px + cx + x, py + cy + y];
    return thing.on ? this.moved(thing.on, there) : there;
  }

  // Where a point was before moves.
  unmoved(name, point, moves) {
    const thing = this.models.find((one) => one.name === name);
    if (!thing) return point;
    const [px, py] = thing.on ? this.unmoved(thing.on, point, moves) : point;
    const { x, y, turn } = moves[name] ?? { x: 0, y: 0, turn: 0 };
    const [cx, cy] = thing.centre;
    const [qx, qy] = turned([px - x - cx, py - y - cy], -turn);
    return [qx + cx, qy + cy];
  }

  // The changes as the service reads them: a model turns about its origin there, here about its centre.
  request() {
    const move = {};
    for (const { name, origin, centre, axis } of this.models) {
      if (!this.isMoved(name)) continue;
      const { x, y, turn } = this.moves[name];
      const [px, py] = turned([origin[0] - centre[0], origin[1] - centre[1]], turn);
      const [dx, dy] = turned([x + centre[0] + px - origin[0], y + centre[1] + py - origin[1]], -axis);
      move[name] = { x: dx, y: dy, turn_deg: turn };
    }
    const add = this.added.map(({ piece, pose }) => ({ piece, x: pose.x, y: pose.y, turn_deg: pose.turn }));
    const forbid = this.regions.map((one) => this.outlines(one)[0].map((point) => this.moved(one.name, point)));
    return { move, add, joints: { ...this.joints }, forbid };
  }

  // Everything that distinguishes this state, for the address of the page.
  saved() {
    const placed = ({ piece, pose, size }) => ({ piece, pose, ...(piece === "region" ? { size } : {}) });
    return JSON.stringify({ moves: this.moves, joints: this.joints, added: [...this.added, ...this.regions].map(placed) });
  }

  restore(text) {
    const { moves = {}, joints = {}, added = [] } = JSON.parse(text);
    const number = (value) => (Number.isFinite(value) ? value : 0);
    this.reset();
    for (const { name } of this.models) {
      if (moves[name]) this.put(name, { x: number(moves[name].x), y: number(moves[name].y), turn: number(moves[name].turn) });
    }
    for (const [name, value] of Object.entries(joints)) if (Number.isFinite(value)) this.joints[name] = value;
    for (const { piece, pose, size } of added) {
      if (piece !== "region" && !this.pieces[piece]) continue;
      this.add(piece, { x: number(pose.x), y: number(pose.y), turn: number(pose.turn) }, size);
    }
  }
}

// Whether two convex polygons overlap.
export function overlap(first, second) {
  for (const polygon of [first, second]) {
    for (let i = 0; i < polygon.length; i++) {
      const [[ax, ay], [bx, by]] = [polygon[i], polygon[(i + 1) % polygon.length]];
      const along = (list) => list.map(([x, y]) => (x - ax) * (by - ay) - (y - ay) * (bx - ax));
      const [a, b] = [along(first), along(second)];
      if (Math.min(...a) >= Math.max(...b) || Math.min(...b) >= Math.max(...a)) return false;
    }
  }
  return true;
}

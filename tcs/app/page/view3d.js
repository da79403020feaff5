// The scene in space: robot, person, furniture and the coloured floor by WebGL, numbered goals on top of everything.

import { MARKS, grouped, whole } from "./marks.js";
import { cornersOf } from "./solids.js";

const COLOURS = {
  robot: [0.8, 0.82, 0.85], arm: [0.62, 0.66, 0.71], person: [0.89, 0.65, 0.5], furniture: [0.48, 0.53, 0.58], contact: [0.85, 0.2, 0.1],
};
const NAMES = "#8c1d0f"; // of bodies that touch
const FIELD = 0.7; // vertical field of view [rad]
const NEAR = 0.05;
const FAR = 40;
const ASIDE = 1.75; // angle of the first view from the robot [rad]
const TURN = 0.12; // rotation by one press of an arrow key [rad]
const SHADERS = [`
attribute vec3 position; attribute vec3 normal; uniform mat4 body; uniform mat4 camera; uniform vec4 bounds;
varying vec3 out_normal; varying vec2 out_floor;
void main() {
  vec4 at = body * vec4(position, 1.0);
  out_normal = mat3(body) * normal;
  out_floor = (at.xy - bounds.xy) / (bounds.zw - bounds.xy);
  gl_Position = camera * at;
}`, `
precision mediump float; varying vec3 out_normal; varying vec2 out_floor; uniform vec3 colour; uniform sampler2D map; uniform float is_floor;
void main() {
  vec3 n = normalize(out_normal);
  float light = 0.62 + 0.3 * max(dot(n, normalize(vec3(0.4, -0.5, 0.75))), 0.0) + 0.12 * n.z;
  vec3 shown = colour * light;
  if (is_floor > 0.5) {
    bool inside = all(greaterThanEqual(out_floor, vec2(0.0))) && all(lessThanEqual(out_floor, vec2(1.0)));
    shown = inside ? mix(texture2D(map, out_floor).rgb, vec3(1.0), 0.35) : vec3(0.93, 0.94, 0.95);
  }
  gl_FragColor = vec4(shown, 1.0);
}`];

function pose([x, y, z, w, a, b, c]) {
  return [
    1 - 2 * (b * b + c * c), 2 * (a * b + w * c), 2 * (a * c - w * b), 0, 2 * (a * b - w * c), 1 - 2 * (a * a + c * c), 2 * (b * c + w * a), 0,
    2 * (a * c + w * b), 2 * (b * c - w * a), 1 - 2 * (a * a + b * b), 0, x, y, z, 1,
  ];
}

function product(a, b) {
  const found = new Array(16).fill(0);
  for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) for (let k = 0; k < 4; k++) found[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return found;
}

// Returns the middle of the corners of triangles, each a position and a normal.
function middleOf(corners) {
  return [0, 1, 2].map((k) => {
    let [least, most] = [Infinity, -Infinity];
    for (let i = k; i < corners.length; i += 6) [least, most] = [Math.min(least, corners[i]), Math.max(most, corners[i])];
    return (least + most) / 2;
  });
}

const STILL = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

export class View3d {
  // `canvas` is drawn by WebGL, `marks` lies over it.
  constructor(canvas, marks) {
    Object.assign(this, { canvas, marks, groups: [], goals: [], outcomes: [], contact: [], frame: [], bounds: [-2, -2, 2, 2] });
    this.gl = canvas.getContext("webgl", { antialias: true });
    this.isPossible = Boolean(this.gl);
    if (!this.isPossible) return;
    Object.assign(this, { around: -0.9, above: 0.5, far: 3.6, middle: [0, 0, 0.8] });
    this.#prepare();
    canvas.addEventListener("pointerdown", (event) => this.#drag(event));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.1 : 1 / 1.1);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  #prepare() {
    const { gl } = this;
    this.program = gl.createProgram();
    SHADERS.forEach((source, i) => {
      const shader = gl.createShader(i ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    });
    gl.linkProgram(this.program);
    gl.useProgram(this.program);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0.97, 0.975, 0.98, 1);
    this.places = Object.fromEntries(["body", "camera", "bounds", "colour", "map", "is_floor"].map((name) => [name, gl.getUniformLocation(this.program, name)]));
    const floor = [[-9, -9], [9, -9], [9, 9], [-9, -9], [9, 9], [-9, 9]].flatMap(([x, y]) => [x, y, 0, 0, 0, 1]);
    this.floor = this.#buffer(floor);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  }

  #buffer(numbers) {
    const { gl } = this;
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STATIC_DRAW);
    return { buffer, count: numbers.length / 6 };
  }

  // The scores as the colours of the floor.
  map(canvas, { left, right, low, high }) {
    if (!this.isPossible) return;
    const { gl } = this;
    this.bounds = [left, low, right, high];
    gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, true);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, gl.RGB, gl.UNSIGNED_BYTE, canvas);
    this.draw();
  }

  // Takes shapes, poses and goals, as the request `posture` returns them.
  scene(found, outcomes) {
    if (!this.isPossible) return;
    const { gl } = this;
    const key = JSON.stringify(found.shapes);
    if (key !== this.key) {
      for (const { buffer } of this.groups) gl.deleteBuffer(buffer);
      const parts = new Map();
      for (const shape of found.shapes) {
        const name = `${shape.body} ${shape.name} ${shape.category}`;
        if (!parts.has(name)) parts.set(name, { body: shape.body, name: shape.name, category: shape.category, corners: [] });
        for (const number of cornersOf(shape)) parts.get(name).corners.push(number);
      }
      this.groups = [...parts.values()].map(({ corners, ...rest }) => ({ ...rest, middle: middleOf(corners), ...this.#buffer(corners) }));
      this.key = key;
    }
    [this.goals, this.outcomes, this.frame] = [found.goals, outcomes, found.frames[0]];
    this.draw();
  }

  // The camera shows the goals in the middle, from that side of the robot from which they are not hidden.
  look(goals, [x, y]) {
    const mean = (k) => goals.reduce((sum, goal) => sum + goal[k], 0) / goals.length;
    this.middle = [mean(0), mean(1), Math.min(mean(2), 0.85)];
    const robot = Math.atan2(y - this.middle[1], x - this.middle[0]);
    const outwards = Math.atan2(-mean(4), -mean(3));
    this.around = [robot - ASIDE, robot + ASIDE].reduce((a, b) => (Math.cos(a - outwards) > Math.cos(b - outwards) ? a : b));
    this.draw();
  }

  #camera() {
    const [ca, sa, cb, sb] = [Math.cos(this.around), Math.sin(this.around), Math.cos(this.above), Math.sin(this.above)];
    const [right, up, back] = [[-sa, ca, 0], [-sb * ca, -sb * sa, cb], [cb * ca, cb * sa, sb]];
    const eye = this.middle.map((value, k) => value + this.far * back[k]);
    const dot = (axis) => -axis.reduce((sum, value, k) => sum + value * eye[k], 0);
    const seen = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, dot(right), dot(up), dot(back), 1];
    const f = 1 / Math.tan(FIELD / 2);
    const wide = f / (this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1));
    const lens = [wide, 0, 0, 0, 0, f, 0, 0, 0, 0, (FAR + NEAR) / (NEAR - FAR), -1, 0, 0, (2 * FAR * NEAR) / (NEAR - FAR), 0];
    return product(lens, seen);
  }

  draw() {
    if (!this.isPossible || this.isWaiting) return;
    this.isWaiting = true;
    requestAnimationFrame(() => {
      this.isWaiting = false;
      this.#drawNow();
    });
  }

  #drawNow() {
    const { gl, canvas, places } = this;
    const density = Math.min(devicePixelRatio, 2);
    [canvas.width, canvas.height] = [canvas.clientWidth * density, canvas.clientHeight * density];
    if (!canvas.width) return;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.key) return; // The floor has no colours yet.
    const camera = this.#camera();
    gl.uniformMatrix4fv(places.camera, false, camera);
    gl.uniform4fv(places.bounds, this.bounds);
    gl.uniform1f(places.is_floor, 1);
    this.#part(this.floor, STILL, [1, 1, 1]);
    gl.uniform1f(places.is_floor, 0);
    for (const group of this.groups) {
      const colour = this.contact.some(({ name }) => name === group.name) ? COLOURS.contact : COLOURS[group.category];
      this.#part(group, pose(this.frame[group.body]), colour);
    }
    this.#number(camera, density);
  }

  #part({ buffer, count }, body, colour) {
    const { gl, program, places } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    ["position", "normal"].forEach((name, i) => {
      const at = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 24, 12 * i);
    });
    gl.uniformMatrix4fv(places.body, false, body);
    gl.uniform3fv(places.colour, colour);
    gl.drawArrays(gl.TRIANGLES, 0, count);
  }

  // Returns where a point of space is on the marks [px], null behind the camera.
  #seen(camera, point) {
    const [x, y, , w] = [0, 1, 2, 3].map((row) => [...point, 1].reduce((sum, value, k) => sum + camera[4 * k + row] * value, 0));
    return w > 0 ? [((x / w + 1) / 2) * this.marks.width, ((1 - y / w) / 2) * this.marks.height] : null;
  }

  // Names of the bodies that touch, one below the other at the top, each with a line to its body.
  #names(camera, context, density) {
    Object.assign(context, { lineWidth: 1.5 * density, strokeStyle: NAMES });
    this.contact.forEach(({ name, text }, i) => {
      const group = this.groups.find((one) => one.name === name);
      const body = group && pose(this.frame[group.body]);
      const middle = body && [0, 1, 2].map((row) => [...group.middle, 1].reduce((sum, value, k) => sum + body[4 * k + row] * value, 0));
      const at = middle && this.#seen(camera, middle);
      if (!at) return;
      const half = context.measureText(text).width / 2 + 6 * density;
      const [x, y] = [Math.min(Math.max(at[0], half), this.marks.width - half), (16 + 24 * i) * density];
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(...at);
      context.stroke();
      context.fillStyle = "#fff";
      context.fillRect(x - half, y - 10 * density, 2 * half, 20 * density);
      context.fillStyle = NAMES;
      context.fillText(text, x, y);
    });
  }

  // Numbers of the goals over everything: discs where reached, squares where not.
  #number(camera, density) {
    const { marks } = this;
    [marks.width, marks.height] = [this.canvas.width, this.canvas.height];
    const context = marks.getContext("2d");
    Object.assign(context, { font: `bold ${13 * density}px system-ui, sans-serif`, textAlign: "center", textBaseline: "middle" });
    const size = 10 * density;
    this.#names(camera, context, density);
    context.strokeStyle = "#fff";
    const seen = this.goals.map((goal, number) => {
      const at = this.#seen(camera, goal.slice(0, 3));
      return at && { at, number, reached: Boolean(this.outcomes[number]?.reached) };
    });
    for (const { at: middle, text, reached, wide } of grouped(seen.filter(Boolean), 1.6 * size)) {
      const half = size * wide;
      const at = [whole(middle[0], half, 0, marks.width), whole(middle[1], size, 0, marks.height)];
      context.fillStyle = reached ? MARKS.reached : MARKS.unreached;
      context.beginPath();
      context.roundRect(at[0] - half, at[1] - size, 2 * half, 2 * size, reached ? size : 0);
      context.fill();
      context.stroke();
      context.fillStyle = "#fff";
      context.fillText(text, ...at);
    }
  }

  zoom(factor) {
    this.far = Math.min(Math.max(this.far * factor, 0.8), 12);
    this.draw();
  }

  turn(around, above) {
    this.around += around;
    this.above = Math.min(Math.max(this.above + above, 0.02), 1.5);
    this.draw();
  }

  #drag(event) {
    this.canvas.setPointerCapture(event.pointerId);
    let [x, y] = [event.clientX, event.clientY];
    const move = (moved) => {
      this.turn((x - moved.clientX) / 150, (moved.clientY - y) / 150);
      [x, y] = [moved.clientX, moved.clientY];
    };
    const names = ["pointerup", "pointercancel"];
    const up = () => {
      this.canvas.removeEventListener("pointermove", move);
      for (const name of names) this.canvas.removeEventListener(name, up);
    };
    this.canvas.addEventListener("pointermove", move);
    for (const name of names) this.canvas.addEventListener(name, up);
  }

  #key(event) {
    const turns = { ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, TURN], ArrowDown: [0, -TURN] }[event.key];
    if (turns) this.turn(...turns);
    else if (event.key === "+") this.zoom(1 / 1.2);
    else if (event.key === "-") this.zoom(1.2);
    else return;
    event.preventDefault();
  }
}

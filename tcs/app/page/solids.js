// Triangles of spheres, capsules and boxes, as positions and normals in the frame of their body.

const AROUND = 20; // corners around a round shape
const RINGS = 6; // rings of a half sphere
const ROUNDED = 0.012; // most by which the edges of a box look rounded [m]

export function rotated([w, x, y, z], [a, b, c]) {
  const [u, v, s] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * u + y * s - z * v, b + w * v + z * u - x * s, c + w * s + x * v - y * u];
}

// Returns points with normals: a surface of rings, each a radius, a height and the slope of its normal.
function lathe(rings) {
  const grid = rings.map(([radius, height, out, up]) => Array.from({ length: AROUND + 1 }, (_, i) => {
    const angle = (2 * Math.PI * i) / AROUND;
    const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
    return [[radius * cos, radius * sin, height], [out * cos, out * sin, up]];
  }));
  const found = [];
  for (let i = 0; i + 1 < grid.length; i++) {
    for (let j = 0; j < AROUND; j++) {
      const [a, b, c, d] = [grid[i][j], grid[i][j + 1], grid[i + 1][j + 1], grid[i + 1][j]];
      found.push(a, b, c, a, c, d);
    }
  }
  return found;
}

function round(radius, half) {
  const rings = [];
  for (const side of [-1, 1]) {
    for (let i = 0; i <= RINGS; i++) {
      const up = (Math.PI / 2) * (side < 0 ? i / RINGS - 1 : i / RINGS);
      rings.push([radius * Math.cos(up), side * half + radius * Math.sin(up), Math.cos(up), Math.sin(up)]);
    }
  }
  return lathe(rings);
}

function box(half) {
  const edge = Math.min(ROUNDED, ...half.map((one) => one / 3));
  const found = [];
  for (let axis = 0; axis < 3; axis++) {
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    for (const side of [-1, 1]) {
      // A flat middle, and a rim whose normals lean outwards.
      const at = (list) => list.map((k) => [-half[k], edge - half[k], half[k] - edge, half[k]]);
      const [us, vs] = at([u, v]);
      const corner = (i, j) => {
        const [point, normal] = [[0, 0, 0], [0, 0, 0]];
        const lean = (k) => (k === 0 ? -1 : k === 3 ? 1 : 0);
        [point[axis], point[u], point[v]] = [side * half[axis], us[i], vs[j]];
        [normal[axis], normal[u], normal[v]] = [side, lean(i), lean(j)];
        const length = Math.hypot(...normal);
        return [point, normal.map((one) => one / length)];
      };
      for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) {
        const [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        found.push(...(side > 0 ? [a, b, c, a, c, d] : [a, c, b, a, d, c]));
      }
    }
  }
  return found;
}

// Returns position and normal of each corner of a shape in its body, six numbers each.
export function cornersOf({ type, size, at }) {
  const [p, q] = [at.slice(0, 3), at.slice(3)];
  const own = type === "box" ? box(size) : round(size[0], type === "capsule" ? size[1] : 0);
  const found = [];
  for (const [point, normal] of own) {
    const there = rotated(q, point);
    found.push(there[0] + p[0], there[1] + p[1], there[2] + p[2], ...rotated(q, normal));
  }
  return found;
}

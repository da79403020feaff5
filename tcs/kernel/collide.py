"""Exact tests whether two shapes are closer than a gap, for spheres, capsules and boxes.

Every shape is a core (point, segment, box) grown by a radius (0 for boxes), so each test compares a
distance between cores. Distances are exact, not bounds, so that results agree with Drake's.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray, IntArray, Shapes
from tcs.kernel.cache import inner, jit

Vector = tuple[float, float, float]

PARALLEL = 1e-12
"""Squared sine below which two edges are parallel, so that their cross product gives no axis."""
ROUNDING = 1e-9
"""Growth of what encloses shapes [m], so that rounding never leaves a shape outside."""


# Columns of packed shapes. A shape is one row of floats, so that inner loops read a single array.
TYPE, BOUND, SIZE, CENTRE, ROTATION, COLUMNS = 0, 1, 2, 5, 8, 17
"""Type; radius of the bounding sphere about the centre [m]; three sizes as in `Shapes`
[m]; centre [m]; rotation matrix row by row."""


def pack(shapes: Shapes, order: IntArray | None = None) -> FloatArray:
    """Return shapes as rows, shape (states, n, COLUMNS), in `order` if one is given."""
    states, n = shapes.p.shape[:2]
    types, size = shapes.type, shapes.size
    length = np.linalg.norm(size, axis=1)
    sphere = np.where(types == CAPSULE, size[:, 0] + size[:, 1], size[:, 0])
    rows = np.empty((states, n, COLUMNS))
    rows[..., TYPE] = types
    rows[..., BOUND] = np.where(types == BOX, length, sphere)
    rows[..., SIZE : SIZE + 3] = size
    rows[..., CENTRE : CENTRE + 3] = shapes.p
    rows[..., ROTATION:] = shapes.R.reshape(states, n, 9)
    return rows if order is None else np.ascontiguousarray(rows[:, order])


@jit
def move(R: FloatArray, p: FloatArray, local: FloatArray, i: int, out: FloatArray, k: int) -> None:
    """Place row i of `local` at the pose (R, p), as row k of `out`."""
    for c in range(CENTRE):
        out[k, c] = local[i, c]
    x, y, z = local[i, CENTRE], local[i, CENTRE + 1], local[i, CENTRE + 2]
    for r in range(3):
        a, b, c_ = R[r, 0], R[r, 1], R[r, 2]
        out[k, CENTRE + r] = p[r] + a * x + b * y + c_ * z
        for c in range(3):
            out[k, ROTATION + 3 * r + c] = (
                a * local[i, ROTATION + c]
                + b * local[i, ROTATION + 3 + c]
                + c_ * local[i, ROTATION + 6 + c]
            )


@jit
def spheres_overlap(a: FloatArray, i: int, b: FloatArray, j: int, gap: float) -> bool:
    """Return whether the bounding spheres of two shapes are closer than `gap` [m].

    Call it before `closer`: it rules out nearly every pair. It is a separate function because numba
    counts references to arrays in functions that call others, which costs more than these sums.
    """
    x = b[j, CENTRE] - a[i, CENTRE]
    y = b[j, CENTRE + 1] - a[i, CENTRE + 1]
    z = b[j, CENTRE + 2] - a[i, CENTRE + 2]
    apart = a[i, BOUND] + b[j, BOUND] + gap
    return x * x + y * y + z * z < apart * apart


@jit
def sphere_is_near(a: FloatArray, i: int, b: FloatArray, j: int, gap: float) -> bool:
    """Return whether the bounding sphere of shape i of a is closer than `gap` [m] to shape j of b.

    It costs less than `closer`, and rules out what is beside a shape that is long or flat, and
    therefore within its bounding sphere. Rounding never rules out shapes that are closer.
    """
    x = a[i, CENTRE] - b[j, CENTRE]
    y = a[i, CENTRE + 1] - b[j, CENTRE + 1]
    z = a[i, CENTRE + 2] - b[j, CENTRE + 2]
    hx, hy, hz, radius = core(b, j)
    u = b[j, ROTATION] * x + b[j, ROTATION + 3] * y + b[j, ROTATION + 6] * z
    v = b[j, ROTATION + 1] * x + b[j, ROTATION + 4] * y + b[j, ROTATION + 7] * z
    w = b[j, ROTATION + 2] * x + b[j, ROTATION + 5] * y + b[j, ROTATION + 8] * z
    apart = a[i, BOUND] + radius + gap + ROUNDING
    return square_beyond(u, v, w, hx, hy, hz) < apart * apart


@inner
def core(rows: FloatArray, i: int) -> tuple[float, float, float, float]:
    """Return the half sizes of a shape's core along its axes, and the radius around it [m]."""
    if rows[i, TYPE] == BOX:
        return rows[i, SIZE], rows[i, SIZE + 1], rows[i, SIZE + 2], 0.0
    return 0.0, 0.0, rows[i, SIZE + 1] if rows[i, TYPE] == CAPSULE else 0.0, rows[i, SIZE]


@inner
def square_beyond(x: float, y: float, z: float, hx: float, hy: float, hz: float) -> float:
    """Return the squared distance of a point from a box around the origin of half sizes h [m^2]."""
    x, y, z = max(abs(x) - hx, 0.0), max(abs(y) - hy, 0.0), max(abs(z) - hz, 0.0)
    return x * x + y * y + z * z


@jit
def closer(a: FloatArray, i: int, b: FloatArray, j: int, gap: float) -> bool:
    """Return whether shape i of a and shape j of b are closer than `gap` > 0 [m]."""
    if a[i, TYPE] > b[j, TYPE]:
        a, i, b, j = b, j, a, i
    if a[i, TYPE] == BOX:
        return _boxes_closer(a, i, b, j, gap)
    reach = a[i, SIZE] + gap
    half_a = a[i, SIZE + 1] if a[i, TYPE] == CAPSULE else 0.0
    if b[j, TYPE] == BOX:
        return _segment_box(a, i, half_a, b, j) < reach * reach
    reach += b[j, SIZE]
    half_b = b[j, SIZE + 1] if b[j, TYPE] == CAPSULE else 0.0
    return _segments(a, i, half_a, b, j, half_b) < reach * reach


@inner
def _segments(a: FloatArray, i: int, half_a: float, b: FloatArray, j: int, half_b: float) -> float:
    """Return the squared distance between two segments along the shapes' z axes [m^2]."""
    dx, dy, dz = between_segments(a, i, half_a, b, j, half_b)
    return dx * dx + dy * dy + dz * dz


@inner
def between_segments(
    a: FloatArray, i: int, half_a: float, b: FloatArray, j: int, half_b: float
) -> tuple[float, float, float]:
    """Return the shortest vector from segment i to segment j along the shapes' z axes [m]."""
    ux, uy, uz = a[i, ROTATION + 2], a[i, ROTATION + 5], a[i, ROTATION + 8]
    vx, vy, vz = b[j, ROTATION + 2], b[j, ROTATION + 5], b[j, ROTATION + 8]
    x, y, z = (
        b[j, CENTRE] - a[i, CENTRE],
        b[j, CENTRE + 1] - a[i, CENTRE + 1],
        b[j, CENTRE + 2] - a[i, CENTRE + 2],
    )
    c = ux * vx + uy * vy + uz * vz
    along_a = ux * x + uy * y + uz * z
    along_b = vx * x + vy * y + vz * z
    sine = 1.0 - c * c
    s = 0.0
    if sine > PARALLEL:
        s = min(max((along_a - c * along_b) / sine, -half_a), half_a)
    t = s * c - along_b
    if abs(t) > half_b:
        t = half_b if t > 0.0 else -half_b
        s = min(max(t * c + along_a, -half_a), half_a)
    elif sine <= PARALLEL:
        s = min(max(t * c + along_a, -half_a), half_a)
        t = min(max(s * c - along_b, -half_b), half_b)
    return x + t * vx - s * ux, y + t * vy - s * uy, z + t * vz - s * uz


@inner
def _segment_box(a: FloatArray, i: int, half: float, b: FloatArray, j: int) -> float:
    """Return the squared distance from a segment along shape i's z axis to box j [m^2]."""
    x, y, z = between_box_and_segment(a, i, half, b, j)
    return x * x + y * y + z * z


@inner
def between_box_and_segment(
    a: FloatArray, i: int, half: float, b: FloatArray, j: int
) -> tuple[float, float, float]:
    """Return the shortest vector from box j to a segment along shape i's z axis, in the box [m]."""
    x, y, z = (
        a[i, CENTRE] - b[j, CENTRE],
        a[i, CENTRE + 1] - b[j, CENTRE + 1],
        a[i, CENTRE + 2] - b[j, CENTRE + 2],
    )
    ux, uy, uz = a[i, ROTATION + 2], a[i, ROTATION + 5], a[i, ROTATION + 8]
    px = b[j, ROTATION] * x + b[j, ROTATION + 3] * y + b[j, ROTATION + 6] * z
    py = b[j, ROTATION + 1] * x + b[j, ROTATION + 4] * y + b[j, ROTATION + 7] * z
    pz = b[j, ROTATION + 2] * x + b[j, ROTATION + 5] * y + b[j, ROTATION + 8] * z
    dx = half * (b[j, ROTATION] * ux + b[j, ROTATION + 3] * uy + b[j, ROTATION + 6] * uz)
    dy = half * (b[j, ROTATION + 1] * ux + b[j, ROTATION + 4] * uy + b[j, ROTATION + 7] * uz)
    dz = half * (b[j, ROTATION + 2] * ux + b[j, ROTATION + 5] * uy + b[j, ROTATION + 8] * uz)
    return _line_box(
        px - dx, py - dy, pz - dz, 2.0 * dx, 2.0 * dy, 2.0 * dz,
        b[j, SIZE], b[j, SIZE + 1], b[j, SIZE + 2],
    )  # fmt: skip


@inner
def _beyond(x: float, h: float) -> float:
    """Return how far x lies outside [-h, h], signed."""
    return max(x - h, 0.0) + min(x + h, 0.0)


@inner
def _line_box(
    px: float, py: float, pz: float,
    dx: float, dy: float, dz: float,
    hx: float, hy: float, hz: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Return the shortest vector from the box of half sizes h to p + t d, t in [0, 1].

    Half the derivative of the squared distance, g(t) = d . beyond(p + t d), grows with t and is
    linear between the values of t at which a coordinate passes a face: find the interval between
    two such values that contains the root, then interpolate.
    """
    low, high = 0.0, 1.0
    g_low = dx * _beyond(px, hx) + dy * _beyond(py, hy) + dz * _beyond(pz, hz)
    t = 0.0
    if g_low < 0.0:
        qx, qy, qz = px + dx, py + dy, pz + dz
        g_high = dx * _beyond(qx, hx) + dy * _beyond(qy, hy) + dz * _beyond(qz, hz)
        t = 1.0
        if g_high > 0.0:
            for face in range(6):
                p, d, h = px, dx, hx
                if face % 3 == 1:
                    p, d, h = py, dy, hy
                elif face % 3 == 2:
                    p, d, h = pz, dz, hz
                if d == 0.0:
                    continue
                cut = ((h if face < 3 else -h) - p) / d
                if low < cut < high:
                    qx, qy, qz = px + cut * dx, py + cut * dy, pz + cut * dz
                    g = dx * _beyond(qx, hx) + dy * _beyond(qy, hy) + dz * _beyond(qz, hz)
                    if g <= 0.0:
                        low, g_low = cut, g
                    else:
                        high, g_high = cut, g
            t = low - g_low * (high - low) / (g_high - g_low)
    return _beyond(px + t * dx, hx), _beyond(py + t * dy, hy), _beyond(pz + t * dz, hz)


@inner
def _boxes_closer(a: FloatArray, i: int, b: FloatArray, j: int, gap: float) -> bool:
    """Return whether two boxes are closer than `gap` [m].

    The 15 separating axes decide nearly every case: if a projected distance is above the gap, the
    boxes are apart; if none is above zero, they overlap. Otherwise the least distance is attained
    on an edge of one box, so the distances of the 24 edges are computed.
    """
    x, y, z = (
        b[j, CENTRE] - a[i, CENTRE],
        b[j, CENTRE + 1] - a[i, CENTRE + 1],
        b[j, CENTRE + 2] - a[i, CENTRE + 2],
    )
    ax, ay, az = a[i, SIZE], a[i, SIZE + 1], a[i, SIZE + 2]
    bx, by, bz = b[j, SIZE], b[j, SIZE + 1], b[j, SIZE + 2]
    tx = a[i, ROTATION] * x + a[i, ROTATION + 3] * y + a[i, ROTATION + 6] * z
    m00 = (
        a[i, ROTATION] * b[j, ROTATION]
        + a[i, ROTATION + 3] * b[j, ROTATION + 3]
        + a[i, ROTATION + 6] * b[j, ROTATION + 6]
    )
    m01 = (
        a[i, ROTATION] * b[j, ROTATION + 1]
        + a[i, ROTATION + 3] * b[j, ROTATION + 4]
        + a[i, ROTATION + 6] * b[j, ROTATION + 7]
    )
    m02 = (
        a[i, ROTATION] * b[j, ROTATION + 2]
        + a[i, ROTATION + 3] * b[j, ROTATION + 5]
        + a[i, ROTATION + 6] * b[j, ROTATION + 8]
    )
    most = abs(tx) - (ax + abs(m00) * bx + abs(m01) * by + abs(m02) * bz)
    if most >= gap:
        return False
    ty = a[i, ROTATION + 1] * x + a[i, ROTATION + 4] * y + a[i, ROTATION + 7] * z
    m10 = (
        a[i, ROTATION + 1] * b[j, ROTATION]
        + a[i, ROTATION + 4] * b[j, ROTATION + 3]
        + a[i, ROTATION + 7] * b[j, ROTATION + 6]
    )
    m11 = (
        a[i, ROTATION + 1] * b[j, ROTATION + 1]
        + a[i, ROTATION + 4] * b[j, ROTATION + 4]
        + a[i, ROTATION + 7] * b[j, ROTATION + 7]
    )
    m12 = (
        a[i, ROTATION + 1] * b[j, ROTATION + 2]
        + a[i, ROTATION + 4] * b[j, ROTATION + 5]
        + a[i, ROTATION + 7] * b[j, ROTATION + 8]
    )
    most = max(most, abs(ty) - (ay + abs(m10) * bx + abs(m11) * by + abs(m12) * bz))
    if most >= gap:
        return False
    tz = a[i, ROTATION + 2] * x + a[i, ROTATION + 5] * y + a[i, ROTATION + 8] * z
    m20 = (
        a[i, ROTATION + 2] * b[j, ROTATION]
        + a[i, ROTATION + 5] * b[j, ROTATION + 3]
        + a[i, ROTATION + 8] * b[j, ROTATION + 6]
    )
    m21 = (
        a[i, ROTATION + 2] * b[j, ROTATION + 1]
        + a[i, ROTATION + 5] * b[j, ROTATION + 4]
        + a[i, ROTATION + 8] * b[j, ROTATION + 7]
    )
    m22 = (
        a[i, ROTATION + 2] * b[j, ROTATION + 2]
        + a[i, ROTATION + 5] * b[j, ROTATION + 5]
        + a[i, ROTATION + 8] * b[j, ROTATION + 8]
    )
    most = max(most, abs(tz) - (az + abs(m20) * bx + abs(m21) * by + abs(m22) * bz))
    s = tx * m00 + ty * m10 + tz * m20
    most = max(most, abs(s) - (bx + abs(m00) * ax + abs(m10) * ay + abs(m20) * az))
    s = tx * m01 + ty * m11 + tz * m21
    most = max(most, abs(s) - (by + abs(m01) * ax + abs(m11) * ay + abs(m21) * az))
    s = tx * m02 + ty * m12 + tz * m22
    most = max(most, abs(s) - (bz + abs(m02) * ax + abs(m12) * ay + abs(m22) * az))
    if most >= gap:
        return False
    most = max(most, _edge_gap(ty, tz, m10, m20, ay, az, by, bz, m02, m01))
    most = max(most, _edge_gap(ty, tz, m11, m21, ay, az, bx, bz, m02, m00))
    most = max(most, _edge_gap(ty, tz, m12, m22, ay, az, bx, by, m01, m00))
    most = max(most, _edge_gap(tz, tx, m20, m00, az, ax, by, bz, m12, m11))
    most = max(most, _edge_gap(tz, tx, m21, m01, az, ax, bx, bz, m12, m10))
    most = max(most, _edge_gap(tz, tx, m22, m02, az, ax, bx, by, m11, m10))
    most = max(most, _edge_gap(tx, ty, m00, m10, ax, ay, by, bz, m22, m21))
    most = max(most, _edge_gap(tx, ty, m01, m11, ax, ay, bx, bz, m22, m20))
    most = max(most, _edge_gap(tx, ty, m02, m12, ax, ay, bx, by, m21, m20))
    if most >= gap:
        return False
    if most <= 0.0:
        return True
    return _an_edge_is_closer(a, i, b, j, gap) or _an_edge_is_closer(b, j, a, i, gap)


@inner
def _edge_gap(
    t1: float, t2: float, m1: float, m2: float,
    a1: float, a2: float, b1: float, b2: float, k1: float, k2: float,
) -> float:  # fmt: skip
    """Return the projected distance [m] of two boxes along the cross product of two edges.

    The axis is a_i x b_j. (1, 2) are the cyclic successors of i: t, a and m hold the offset, the
    half sizes and b_j along them. b1, b2 are the half sizes of the other two edges of b, and
    k1, k2 the components along a_i of the edges of b that are crossed with them.
    """
    sine = m1 * m1 + m2 * m2
    if sine < PARALLEL:
        return -np.inf
    spread = a1 * abs(m2) + a2 * abs(m1) + b1 * abs(k1) + b2 * abs(k2)
    return (abs(t2 * m1 - t1 * m2) - spread) / np.sqrt(sine)


@inner
def _an_edge_is_closer(a: FloatArray, i: int, b: FloatArray, j: int, gap: float) -> bool:
    """Return whether one of the 12 edges of box i is closer than `gap` [m] to box j."""
    centre = _in_frame(
        b, j,
        a[i, CENTRE] - b[j, CENTRE],
        a[i, CENTRE + 1] - b[j, CENTRE + 1],
        a[i, CENTRE + 2] - b[j, CENTRE + 2],
    )  # fmt: skip
    u, v, w = _half_edge(a, i, b, j, 0), _half_edge(a, i, b, j, 1), _half_edge(a, i, b, j, 2)
    half = b[j, SIZE], b[j, SIZE + 1], b[j, SIZE + 2]
    square = gap * gap
    return (
        _a_parallel_edge_is_closer(centre, u, v, w, half, square)
        or _a_parallel_edge_is_closer(centre, v, w, u, half, square)
        or _a_parallel_edge_is_closer(centre, w, u, v, half, square)
    )


@inner
def _in_frame(b: FloatArray, j: int, x: float, y: float, z: float) -> Vector:
    """Return a vector in the frame of shape j."""
    return (
        b[j, ROTATION] * x + b[j, ROTATION + 3] * y + b[j, ROTATION + 6] * z,
        b[j, ROTATION + 1] * x + b[j, ROTATION + 4] * y + b[j, ROTATION + 7] * z,
        b[j, ROTATION + 2] * x + b[j, ROTATION + 5] * y + b[j, ROTATION + 8] * z,
    )


@inner
def _half_edge(a: FloatArray, i: int, b: FloatArray, j: int, m: int) -> Vector:
    """Return half of an edge of box i along its axis m, in the frame of shape j [m]."""
    size, at = a[i, SIZE + m], ROTATION + m
    return _in_frame(b, j, size * a[i, at], size * a[i, at + 3], size * a[i, at + 6])


@inner
def _a_parallel_edge_is_closer(
    centre: Vector, along: Vector, second: Vector, third: Vector, half: Vector, square: float
) -> bool:
    """Return whether one of four parallel edges of a box is closer to another box than a distance.

    Args:
        centre: Centre of the box, in the frame of the other one [m].
        along: Half of these edges.
        second: Half of an edge of another direction.
        third: Half of an edge of the third direction.
        half: Half sizes of the other box [m].
        square: Square of the distance [m^2].
    """
    dx, dy, dz = along
    hx, hy, hz = half
    # Of most edges, one coordinate alone is far enough from the box.
    ex, ey, ez = hx + abs(dx), hy + abs(dy), hz + abs(dz)
    for n in range(4):
        f, g = 1.0 - 2.0 * (n & 1), 1.0 - (n & 2)
        x = centre[0] + f * second[0] + g * third[0]
        y = centre[1] + f * second[1] + g * third[1]
        z = centre[2] + f * second[2] + g * third[2]
        if square_beyond(x, y, z, ex, ey, ez) >= square:
            continue
        x, y, z = _line_box(x - dx, y - dy, z - dz, 2.0 * dx, 2.0 * dy, 2.0 * dz, hx, hy, hz)
        if x * x + y * y + z * z < square:
            return True
    return False

r"""Upper bound of the dexterity of an arm, over all of its joint angles.

Kinematic isotropy is det(J J^T)^(1/6) / (trace(J J^T) / 6). Let the last three axes meet in the
wrist centre at right angles (5 and 6, 6 and 7), and let c be |z5 . z7|. The determinant does not
depend on the reference point of J. At the wrist centre the last three columns have no linear part,
so with the linear columns A of the first four joints, their minors m and N = sum of (+-) m_i z_i

    det(J J^T) = |m|^2 det(Z Z^T) + N^T adj(Z Z^T) N <= |m|^2 (1 - c^2) + |N|^2 (1 + c),

Z being the last three axes, since Z Z^T has the eigenvalues 1 - c, 1 and 1 + c. The trace is 7 plus
the squares of the columns' linear parts at the tool; with the tool at a distance L of the wrist
centre, these are at least (|A_i| - L)^2 for the first four, and L^2 (2 - c) in all for the last
three. Both sides depend on joints 2, 3 and 4 and on c alone. Branch and bound over these angles, in
interval arithmetic, gives the bound.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import numpy as np

from tcs.kernel.arrays import Chain, FloatArray

ISOTROPIES = ("isotropy", "isotropy-limited", "isotropy-limited-thesis")
"""Measures that are the isotropy times a factor of at most 1."""
RESOLUTION = 4e-3
"""Difference from the greatest relaxed isotropy at which branching ends."""
ROUNDING = 1e-6
"""Excess of the bound, above all rounding of the interval arithmetic."""
MEETS = 1e-9
"""Distance [m], or cosine, up to which axes meet at right angles."""
FIRST_CELLS = 0.2
"""Greatest width of the first boxes [rad]."""
MOST_BOXES = 200_000
"""Boxes evaluated at a time; with more, branching ends earlier and the bound is greater."""
COSINES = np.linspace(0.0, 1.0, 33)
"""Ends of the intervals of c."""


def dexterity_bound(chain: Chain, measure: str) -> float:
    """Return an upper bound of a dexterity measure over all joint angles of an arm.

    Args:
        chain: The arm.
        measure: Name of the measure.

    Returns:
        At most 1, which bounds every measure. Less for the isotropy, in particular for an arm with
        a spherical wrist.
    """
    if measure not in ISOTROPIES or chain.joints != 7:
        return 1.0
    arrays = (chain.R, chain.p, chain.lower, chain.upper)
    return _isotropy_bound(*(array.tobytes() for array in arrays))


@lru_cache(maxsize=16)
def _isotropy_bound(R: bytes, p: bytes, lower: bytes, upper: bytes) -> float:
    """Return the bound for the bytes of a chain, cached: it takes a second."""
    chain = Chain(
        np.frombuffer(R).reshape(8, 3, 3),
        np.frombuffer(p).reshape(8, 3),
        np.frombuffer(lower),
        np.frombuffer(upper),
    )
    bound = _from_reach(chain)
    if _has_spherical_wrist(chain):
        bound = min(bound, _branch_and_bound(chain))
    return min(1.0, bound + ROUNDING)


def _from_reach(chain: Chain) -> float:
    """Return the bound that follows from the lengths of the links.

    The determinant is at most that of its linear and angular blocks, these at most the cube of a
    third of their traces, T and 7: the isotropy is at most 2 sqrt(7 T) / (7 + T), which increases
    up to T = 7.
    """
    lengths = np.linalg.norm(chain.p, axis=1)
    reach = np.cumsum(lengths[::-1])[::-1][1:]
    linear = min(float(np.sum(reach**2)), 7.0)
    return 2.0 * float(np.sqrt(7.0 * linear)) / (7.0 + linear)


def _has_spherical_wrist(chain: Chain) -> bool:
    """Return whether the last three axes meet in a point, at right angles."""
    offsets = np.linalg.norm(chain.p[5:7], axis=1)
    return bool(np.all(offsets <= MEETS) and np.all(np.abs(chain.R[5:7, 2, 2]) <= MEETS))


@dataclass(frozen=True, eq=False)
class _Interval:
    """Arrays of numbers between two ends."""

    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, value: FloatArray | float) -> Self:
        """Return an exact number."""
        array = np.asarray(value, dtype=np.float64)
        return cls(array, array)

    def __add__(self, other: _Interval) -> _Interval:
        return _Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other: _Interval) -> _Interval:
        return _Interval(self.low - other.high, self.high - other.low)

    def __mul__(self, other: _Interval) -> _Interval:
        ends = [a * b for a in (self.low, self.high) for b in (other.low, other.high)]
        return _Interval(np.minimum.reduce(ends), np.maximum.reduce(ends))

    def square(self) -> _Interval:
        """Return the square, which is not negative."""
        ends = np.abs(self.low), np.abs(self.high)
        crosses = (self.low <= 0.0) & (self.high >= 0.0)
        return _Interval(np.where(crosses, 0.0, np.minimum(*ends)) ** 2, np.maximum(*ends) ** 2)


_Vector = tuple[_Interval, _Interval, _Interval]


def _cosine(angle: _Interval) -> _Interval:
    """Return the cosine of angles whose intervals are narrower than pi."""
    ends = np.cos(angle.low), np.cos(angle.high)
    turn = 2.0 * np.pi
    has_top = np.floor(angle.high / turn) > np.floor(angle.low / turn)
    has_top |= np.mod(angle.low, turn) == 0.0
    has_bottom = np.floor(angle.high / turn - 0.5) > np.floor(angle.low / turn - 0.5)
    return _Interval(
        np.where(has_bottom, -1.0, np.minimum(*ends)), np.where(has_top, 1.0, np.maximum(*ends))
    )


def _turned(v: _Vector, angle: _Interval, sign: float) -> _Vector:
    """Return a vector rotated about z by an angle, or by its negative."""
    c = _cosine(angle)
    s = _cosine(angle - _Interval.of(np.pi / 2.0))
    s = s if sign > 0.0 else _Interval(-s.high, -s.low)
    return c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]


def _moved(R: FloatArray, p: FloatArray, v: _Vector) -> _Vector:
    """Return R v + p."""
    rows = []
    for row, offset in zip(R, p, strict=True):
        total = _Interval.of(offset)
        for factor, part in zip(row, v, strict=True):
            if abs(factor) > 0.0:
                total = total + _Interval.of(factor) * part
        rows.append(total)
    return rows[0], rows[1], rows[2]


def _fixed(v: FloatArray) -> _Vector:
    return _Interval.of(v[0]), _Interval.of(v[1]), _Interval.of(v[2])


def _less(a: _Vector, b: _Vector) -> _Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _cross(a: _Vector, b: _Vector) -> _Vector:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _dot(a: _Vector, b: _Vector) -> _Interval:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _square(a: _Vector) -> _Interval:
    return a[0].square() + a[1].square() + a[2].square()


def _relaxed(chain: Chain, box: _Interval) -> FloatArray:
    """Return an upper bound of the relaxed isotropy in boxes of joints 2, 3, 4, shape (n,).

    Vectors are in the frame of link 2, where joint 2 turns the first axis, and joints 3 and 4 the
    wrist centre: each angle occurs as seldom as possible.
    """
    q2, q3, q4 = (_Interval(box.low[:, i], box.high[:, i]) for i in range(3))
    zero, up = np.zeros(3), np.array([0.0, 0.0, 1.0])
    # Axis 1 and its origin in link 2.
    z1 = _turned(_fixed(chain.R[1].T @ up), q2, -1.0)
    o1 = _turned(_fixed(-chain.R[1].T @ chain.p[1]), q2, -1.0)
    # Axes 3 and 4 and the wrist centre.
    z3, o3 = _fixed(chain.R[2] @ up), _fixed(chain.p[2])
    z4 = _moved(chain.R[2], zero, _turned(_fixed(chain.R[3] @ up), q3, 1.0))
    o4 = _moved(chain.R[2], chain.p[2], _turned(_fixed(chain.p[3]), q3, 1.0))
    wrist = _turned(_fixed(chain.p[4]), q4, 1.0)
    wrist = _turned(_moved(chain.R[3], chain.p[3], wrist), q3, 1.0)
    wrist = _moved(chain.R[2], chain.p[2], wrist)
    axes = [z1, _fixed(up), z3, z4]
    origins = [o1, _fixed(zero), o3, o4]
    linear = [_cross(z, _less(wrist, o)) for z, o in zip(axes, origins, strict=True)]
    squares = _Interval.of(0.0)
    N: _Vector = (_Interval.of(0.0), _Interval.of(0.0), _Interval.of(0.0))
    for k in range(4):
        a, b, c = (linear[i] for i in range(4) if i != k)
        minor = _dot(a, _cross(b, c))
        squares = squares + minor.square()
        signed = _Interval.of((-1.0) ** k) * minor
        part = tuple(signed * component for component in axes[k])
        N = (N[0] + part[0], N[1] + part[1], N[2] + part[2])
    tool = float(np.linalg.norm(chain.p[7]))
    lengths = [np.sqrt(_square(v).low) for v in linear]
    beyond = [np.maximum(0.0, length - tool) ** 2 for length in lengths]
    trace = 7.0 + np.sum(np.broadcast_arrays(*beyond), axis=0)
    return _over_cosines(squares.high, _square(N).high, trace, tool)


def _over_cosines(m: FloatArray, n: FloatArray, trace: FloatArray, tool: float) -> FloatArray:
    """Return the greatest relaxed isotropy over c, given bounds of its parts, shape (n,)."""
    best = np.zeros_like(m)
    for low, high in itertools.pairwise(COSINES):
        determinant = m * (1.0 - low**2) + n * (1.0 + high)
        best = np.maximum(best, determinant ** (1 / 6) * 6.0 / (trace + tool**2 * (2.0 - high)))
    return best


def _branch_and_bound(chain: Chain) -> float:
    """Return the greatest relaxed isotropy, within the resolution above it."""
    low, high = chain.lower[1:4], chain.upper[1:4]
    low, high = np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi)
    counts = np.maximum(1, np.ceil((high - low) / FIRST_CELLS)).astype(int)
    corners = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, counts, strict=True)]
    boxes = _Interval(
        np.stack(np.meshgrid(*(c[:-1] for c in corners), indexing="ij"), axis=-1).reshape(-1, 3),
        np.stack(np.meshgrid(*(c[1:] for c in corners), indexing="ij"), axis=-1).reshape(-1, 3),
    )
    # What a box cannot be shown to stay below: a value that the relaxed isotropy takes.
    taken = 0.0
    while True:
        middle = (boxes.low + boxes.high) / 2.0
        taken = max(taken, float(_relaxed(chain, _Interval(middle, middle)).max()))
        bounds = _relaxed(chain, boxes)
        open_ = bounds > taken + RESOLUTION
        if not np.any(open_):
            return taken + RESOLUTION
        if 2 * np.count_nonzero(open_) > MOST_BOXES:
            return float(bounds.max())
        boxes = _halved(_Interval(boxes.low[open_], boxes.high[open_]))


def _halved(boxes: _Interval) -> _Interval:
    """Return both halves of boxes, cut across their longest edges."""
    rows = np.arange(len(boxes.low))
    edge = np.argmax(boxes.high - boxes.low, axis=1)
    middle = (boxes.low[rows, edge] + boxes.high[rows, edge]) / 2.0
    upper, lower = boxes.low.copy(), boxes.high.copy()
    upper[rows, edge] = lower[rows, edge] = middle
    return _Interval(np.concatenate([boxes.low, upper]), np.concatenate([lower, boxes.high]))

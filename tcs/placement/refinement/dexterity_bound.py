r"""Upper bound of the dexterity of an arm, over all of its joint angles.

Kinematic isotropy is det(J J^T)^(1/6) / (trace(J J^T) / 6). Let the last three axes meet in the
wrist centre at right angles (5 and 6, 6 and 7), and let c >= 0 and s be the cosine and sine of the
angle between axes 5 and 7. The determinant does not depend on the reference point of J. At the
wrist centre the last three columns have no linear part, so with the linear columns A of the first
four joints, their minors m and N = sum of (+-) m_i z_i

    det(J J^T) = |m|^2 det(Z Z^T) + N^T adj(Z Z^T) N,

Z being the last three axes. Let w be the direction of axis 7 across axis 5, a = N . z5 and
b = N . w. Then det(Z Z^T) = s^2, and N^T adj(Z Z^T) N = |N|^2 s^2 + 2 b c (b c - a s) is at most
|N|^2 s^2 + 2 r c (r c + |a| s) with r = |N x z5|. It is also at most |N|^2 (1 + c), as Z Z^T has
the eigenvalues 1 - c, 1 and 1 + c.

The trace is 7 plus the squares of the columns' linear parts at the tool, L t from the wrist centre,
t being axis 7. They are L^2 (2 - c^2) in all for the last three, and |A_i + L z_i x t|^2 for the
others: at least (|A_i| - L)^2 each, and together at least the sum of |A_i|^2, less
2 L (c |V . z5| + s |V x z5|) with V the sum of A_i x z_i, plus L^2 (4 - k) with k the greatest
eigenvalue of the sum of z_i z_i^T.

All of this depends on joints 2, 3 and 4 and on c alone. Branch and bound over these angles, in
interval arithmetic, gives the bound.
"""

from __future__ import annotations

import itertools
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from tcs.kernel.arrays import Chain, FloatArray
from tcs.placement.refinement.intervals import (
    Interval,
    Vector,
    cross,
    dot,
    fixed,
    less,
    moved,
    square_of,
    turned,
)

ISOTROPIES = ("isotropy", "isotropy-limited", "isotropy-limited-thesis")
"""Measures that are the isotropy times a factor of at most 1."""
RESOLUTION = 8e-3
"""Difference from the greatest relaxed isotropy at which branching ends."""
ROUNDING = 1e-6
"""Excess of the bound, above all rounding of the interval arithmetic."""
MEETS = 1e-9
"""Distance [m], or cosine, up to which axes meet at right angles."""
FIRST_CELLS = 0.2
"""Greatest width of the first boxes [rad]."""
MOST_BOXES = 200_000
"""Boxes evaluated at a time; with more, branching ends earlier and the bound is greater."""
ANGLES = np.linspace(0.0, np.pi / 2.0, 49)
"""Ends of the intervals of the angle of axes 5 and 7, or of its supplement [rad]."""


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
    if is_relaxable(chain):
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


def is_relaxable(chain: Chain) -> bool:
    """Return whether the last three axes meet at right angles, and the tool is on the last."""
    offsets = np.append(np.linalg.norm(chain.p[5:7], axis=1), np.abs(chain.p[7, :2]))
    return bool(np.all(offsets <= MEETS) and np.all(np.abs(chain.R[5:7, 2, 2]) <= MEETS))


class _Upper(NamedTuple):
    """The first four joints of an arm in boxes of the angles of joints 2, 3 and 4.

    Vectors are in the frame of link 2, where joint 2 turns the first axis, and joints 3 and 4 the
    wrist centre: each angle occurs as seldom as possible.
    """

    axes: tuple[Vector, ...]
    """Axes of joints 1 to 4."""
    origins: tuple[Vector, ...]
    """A point on each axis."""
    linear: tuple[Vector, ...]
    """Linear columns A at the wrist centre."""
    squares: Interval
    """|m|^2."""
    N: Vector

    @classmethod
    def of(cls, chain: Chain, q2: Interval, q3: Interval, q4: Interval) -> Self:
        """Return the joints at these angles."""
        zero, up = np.zeros(3), np.array([0.0, 0.0, 1.0])
        z1, o1 = _first_axis(chain, q2)
        # Axes 3 and 4 and the wrist centre.
        z3, o3 = fixed(chain.R[2] @ up), fixed(chain.p[2])
        z4 = moved(chain.R[2], zero, turned(fixed(chain.R[3] @ up), q3, 1.0))
        o4 = moved(chain.R[2], chain.p[2], turned(fixed(chain.p[3]), q3, 1.0))
        wrist = _from_link_4(chain, fixed(chain.p[4]), q3, q4)
        axes = (z1, fixed(up), z3, z4)
        origins = (o1, fixed(zero), o3, o4)
        linear = tuple(cross(z, less(wrist, o)) for z, o in zip(axes, origins, strict=True))
        squares = Interval.of(0.0)
        N: Vector = (Interval.of(0.0), Interval.of(0.0), Interval.of(0.0))
        for k in range(4):
            a, b, c = (linear[i] for i in range(4) if i != k)
            minor = dot(a, cross(b, c))
            squares = squares + minor.square()
            signed = Interval.of((-1.0) ** k) * minor
            part = tuple(signed * component for component in axes[k])
            N = (N[0] + part[0], N[1] + part[1], N[2] + part[2])
        return cls(axes, origins, linear, squares, N)


def _from_link_4(
    chain: Chain, v: Vector, q3: Interval, q4: Interval, is_point: bool = True
) -> Vector:
    """Return a point or direction of link 4 in the frame of link 2."""
    offset = 1.0 if is_point else 0.0
    in_3 = moved(chain.R[3], offset * chain.p[3], turned(v, q4, 1.0))
    return moved(chain.R[2], offset * chain.p[2], turned(in_3, q3, 1.0))


class _Relaxed(NamedTuple):
    """Bounds of what the relaxed isotropy is made of, in boxes of joints 2, 3, 4, shapes (n,)."""

    m: FloatArray
    """Greatest |m|^2."""
    n: FloatArray
    """Greatest |N|^2."""
    along: FloatArray
    """Greatest |N . z5|."""
    across: FloatArray
    """Greatest |N x z5|."""
    beyond: FloatArray
    """Least sum of (|A_i| - L)^2."""
    squares: FloatArray
    """Least sum of |A_i|^2."""
    drift_along: FloatArray
    """Greatest |V . z5|, V being the sum of A_i x z_i."""
    drift_across: FloatArray
    """Greatest |V x z5|."""
    turned: FloatArray
    """Least sum of |z_i x t|^2 over unit vectors t."""

    def determinant(self, c: float, s: float) -> FloatArray:
        """Return the greatest determinant with a cosine and a sine of at most c and s."""
        return np.minimum(
            self.m * s**2 + self.n * (1.0 + c),
            (self.m + self.n) * s**2 + 2.0 * self.across * c * (self.across * c + self.along * s),
        )

    def trace(self, c: float, s: float, tool: float) -> FloatArray:
        """Return the least trace with a cosine and a sine of at most c and s.

        Args:
            c: Cosine of the angle of axes 5 and 7.
            s: Sine of the angle.
            tool: Distance of the tool from the wrist centre [m].
        """
        # Linear parts of the first four joints at the tool: each by itself, and all together.
        together = self.squares - 2.0 * tool * (c * self.drift_along + s * self.drift_across)
        first = np.maximum(self.beyond, together + tool**2 * self.turned)
        return np.asarray(7.0 + tool**2 * (2.0 - c**2) + first)


def relaxed_by_angle(chain: Chain, box: Interval) -> FloatArray:
    """Return an upper bound of the relaxed isotropy in boxes of joints 2, 3, 4.

    Returns:
        One for each interval of `ANGLES`, shape (n, intervals).
    """
    parts, tool = _parts(chain, box), float(np.linalg.norm(chain.p[7]))
    found = []
    for low, high in itertools.pairwise(ANGLES):
        c, s = float(np.cos(low)), float(np.sin(high))
        determinant, trace = parts.determinant(c, s), parts.trace(c, s, tool)
        found.append(determinant ** (1 / 6) * 6.0 / trace)
    return np.stack(found, axis=1)


def _relaxed(chain: Chain, box: Interval) -> FloatArray:
    """Return an upper bound of the relaxed isotropy in boxes of joints 2, 3, 4, shape (n,)."""
    return np.asarray(relaxed_by_angle(chain, box).max(axis=1))


def wrist_height(chain: Chain, box: Interval) -> Interval:
    """Return how far the wrist centre is from joint 1, along its axis, in boxes [m]."""
    z1, o1 = _first_axis(chain, box.column(0))
    wrist = _from_link_4(chain, fixed(chain.p[4]), box.column(1), box.column(2))
    return dot(z1, less(wrist, o1))


def forearm(chain: Chain, box: Interval) -> Interval:
    """Return the cosine of the angle between axes 1 and 5, in boxes of joints 2, 3, 4."""
    z1, _ = _first_axis(chain, box.column(0))
    z5 = fixed(chain.R[4][:, 2])
    return dot(z1, _from_link_4(chain, z5, box.column(1), box.column(2), is_point=False))


def _first_axis(chain: Chain, q2: Interval) -> tuple[Vector, Vector]:
    """Return axis 1 and its origin in the frame of link 2."""
    up = np.array([0.0, 0.0, 1.0])
    z1 = turned(fixed(chain.R[1].T @ up), q2, -1.0)
    return z1, turned(fixed(-chain.R[1].T @ chain.p[1]), q2, -1.0)


def _parts(chain: Chain, box: Interval) -> _Relaxed:
    """Return what the relaxed isotropy is made of, in boxes of joints 2, 3, 4."""
    q3, q4 = box.column(1), box.column(2)
    upper = _Upper.of(chain, box.column(0), q3, q4)
    tool = float(np.linalg.norm(chain.p[7]))
    lengths = [np.sqrt(square_of(v).low) for v in upper.linear]
    beyond = [np.maximum(0.0, length - tool) ** 2 for length in lengths]
    z5 = _from_link_4(chain, fixed(chain.R[4][:, 2]), q3, q4, is_point=False)
    drifts = [cross(a, axis) for a, axis in zip(upper.linear, upper.axes, strict=True)]
    x, y, z = (sum((drift[k] for drift in drifts[1:]), drifts[0][k]) for k in range(3))
    V: Vector = (x, y, z)
    squares = sum((square_of(v) for v in upper.linear[1:]), square_of(upper.linear[0]))
    # The greatest eigenvalue of the sum S of z_i z_i^T, from its trace 4 and |S|^2.
    inner = [dot(a, b).square().high for a, b in itertools.combinations(upper.axes, 2)]
    norm = 4.0 + 2.0 * np.sum(np.broadcast_arrays(*inner), axis=0)
    greatest = 4.0 / 3.0 + np.sqrt(2.0 / 3.0 * np.maximum(norm - 16.0 / 3.0, 0.0))
    parts = _Relaxed(
        upper.squares.high,
        square_of(upper.N).high,
        _magnitude(dot(upper.N, z5)),
        np.sqrt(square_of(cross(upper.N, z5)).high),
        np.sum(np.broadcast_arrays(*beyond), axis=0),
        squares.low,
        _magnitude(dot(V, z5)),
        np.sqrt(square_of(cross(V, z5)).high),
        np.maximum(4.0 - greatest, 0.0),
    )
    return _Relaxed(*np.broadcast_arrays(*parts))


def _magnitude(value: Interval) -> FloatArray:
    """Return the greatest absolute value."""
    return np.maximum(np.abs(value.low), np.abs(value.high))


def _branch_and_bound(chain: Chain) -> float:
    """Return the greatest relaxed isotropy, within the resolution above it."""
    return descent(chain)[-1]


def descent(chain: Chain, resolution: float = RESOLUTION) -> list[float]:
    """Return the bounds that successive halvings of the boxes give: each holds by itself.

    Args:
        chain: An arm with a spherical wrist.
        resolution: Difference from the greatest relaxed isotropy at which branching ends.
    """
    boxes = first_boxes(chain)
    # What a box cannot be shown to stay below: a value that the relaxed isotropy takes.
    taken, course = 0.0, []
    while True:
        middle = (boxes.low + boxes.high) / 2.0
        taken = max(taken, float(_relaxed(chain, Interval(middle, middle)).max()))
        bounds = _relaxed(chain, boxes)
        course.append(max(float(bounds.max()), taken + resolution))
        is_open = bounds > taken + resolution
        if not np.any(is_open) or 2 * np.count_nonzero(is_open) > MOST_BOXES:
            return course
        boxes = halved(boxes.rows(is_open))


def first_boxes(chain: Chain) -> Interval:
    """Return boxes that cover the angles of joints 2, 3 and 4."""
    low, high = chain.lower[1:4], chain.upper[1:4]
    low, high = np.where(np.isfinite(low), low, -np.pi), np.where(np.isfinite(high), high, np.pi)
    counts = np.maximum(1, np.ceil((high - low) / FIRST_CELLS)).astype(int)
    corners = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, counts, strict=True)]
    return Interval(
        np.stack(np.meshgrid(*(c[:-1] for c in corners), indexing="ij"), axis=-1).reshape(-1, 3),
        np.stack(np.meshgrid(*(c[1:] for c in corners), indexing="ij"), axis=-1).reshape(-1, 3),
    )


def halved(boxes: Interval) -> Interval:
    """Return both halves of boxes, cut across their longest edges."""
    rows = np.arange(len(boxes.low))
    edge = np.argmax(boxes.high - boxes.low, axis=1)
    middle = (boxes.low[rows, edge] + boxes.high[rows, edge]) / 2.0
    upper, lower = boxes.low.copy(), boxes.high.copy()
    upper[rows, edge] = lower[rows, edge] = middle
    return Interval(np.concatenate([boxes.low, upper]), np.concatenate([lower, boxes.high]))

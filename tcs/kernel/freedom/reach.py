"""The sphere about a point of the arm base within which a point of the tool has to be.

The arm leaves a point of its first axis in place, and a point of its last axis, the wrist, moves
with the tool: their distance is at most the length of the chain between them. Prismatic joints that
come first move that point within their ranges, and bound the wrist along each of them. So most tool
poses out of reach are known by the position of their wrist alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import Chain, FloatArray
from tcs.kernel.freedom.forms import FEWEST_JOINTS
from tcs.kernel.freedom.wrist_places import WristPlaces, no_places, wrist_places

ROUNDS = 200
"""Steps towards the shortest chain."""
SHORTEST = 1e-6
"""Least length that a part of the chain counts with [m]."""
ROUNDING = 1e-9
"""What rounding may add to a distance [m]."""


class WristReach(NamedTuple):
    """Bound of the reach of an arm."""

    pivot: FloatArray
    """The point that stays in place, prismatic joints before it in the middle of their ranges, in
    the arm base A [m], shape (3,)."""
    wrist: FloatArray
    """The wrist in T [m], shape (3,); zero, the tool itself, for an arm of five joints, which turns
    the tool as it needs."""
    span: float
    """Greatest distance of the wrist from the pivot [m]."""
    slabs: FloatArray
    """Unit vectors in A, and the greatest distance of the wrist from the pivot along each, in both
    directions [m], shape (n, 4): one for each prismatic joint before the revolute ones."""
    places: WristPlaces
    """Where joints within their limits take it, known for some arms with a spherical wrist."""


def no_reach() -> WristReach:
    """Return what bounds nothing."""
    return WristReach(np.zeros(3), np.zeros(3), np.inf, np.empty((0, 4)), no_places())


def wrist_reach(chain: Chain) -> WristReach:
    """Return the bound of an arm's reach.

    Any points of the joints' axes give a chain whose length is a bound; those of the shortest one
    are found by weighted least squares (Weiszfeld's method).

    Args:
        chain: The arm.
    """
    R, p = np.asarray(chain.R, dtype=np.float64), np.array(chain.p, dtype=np.float64)
    travel = _travel(chain, slice(0, 7))
    for i in range(7):
        if chain.slides[i]:
            # A prismatic joint counts from the middle of its range.
            p[i] += R[i, :, 2] * chain.slides[i] * 0.5 * (chain.lower[i] + chain.upper[i])
    # Joints before the arm's own remain at 0; link i of the chain has its axis in frame i.
    first = before = 7 - chain.joints
    while chain.slides[first] > 0.0:
        first += 1
    R_AL, p_AL, axes = R[0], p[0], []
    for i in range(first):
        if i >= before:
            axes.append(R_AL[:, 2] * chain.slides[i])
        p_AL, R_AL = p_AL + R_AL @ p[i + 1], R_AL @ R[i + 1]
    own_tool = chain.joints == FEWEST_JOINTS
    parts = list(range(first + 1, 7 + own_tool))
    # Each part of the chain is p + R z s[i] - z s[i - 1], linear in the points s of the axes.
    rows, offsets = np.zeros((len(parts), 3, 7)), np.empty((len(parts), 3))
    for n, i in enumerate(parts):
        offsets[n] = p[i]
        rows[n, 2, i - 1] = -1.0
        if i < 7:
            rows[n, :, i] = R[i, :, 2]
    weight, length, s = np.ones(len(parts)), np.zeros(len(parts)), np.zeros(7)
    for _ in range(ROUNDS):
        A = (weight[:, None, None] * rows).reshape(-1, 7)
        b = (weight[:, None] * offsets).reshape(-1)
        s[:] = np.linalg.lstsq(A, -b, rcond=None)[0]
        length[:] = np.linalg.norm(offsets + rows @ s, axis=1)
        weight[:] = 1.0 / np.sqrt(np.maximum(length, SHORTEST))
    wrist = np.zeros(3) if own_tool else R[7].T @ (np.array([0.0, 0.0, s[6]]) - p[7])
    inside = float(length.sum()) + ROUNDING
    return WristReach(
        pivot=p_AL + R_AL[:, 2] * s[first],
        wrist=wrist,
        span=inside + travel,
        slabs=_slabs(axes, inside + _travel(chain, slice(first, 7)), chain, before),
        places=wrist_places(chain, wrist),
    )


def _travel(chain: Chain, joints: slice) -> float:
    """Return how far prismatic joints move from the middle of their ranges, all together [m]."""
    slides = chain.slides[joints] > 0.0
    ranges = np.where(slides, chain.upper[joints] - chain.lower[joints], 0.0)
    return float(0.5 * np.sum(ranges * chain.slides[joints]))


def _slabs(axes: list[FloatArray], inside: float, chain: Chain, before: int) -> FloatArray:
    """Return the slabs of prismatic joints that come first.

    Args:
        axes: Motion of the wrist for each unit of theirs, in A, shapes (3,).
        inside: Length of the chain behind them [m].
        chain: The arm.
        before: Number of links before them.
    """
    moved = np.array(axes).reshape(-1, 3).T
    if not axes or np.linalg.matrix_rank(moved) < len(axes):
        return np.empty((0, 4))
    # A joint's position is the scalar product of a row and what all of them move.
    rows = np.linalg.pinv(moved)
    size = np.linalg.norm(rows, axis=1)
    joints = slice(before, before + len(axes))
    half = 0.5 * (chain.upper[joints] - chain.lower[joints])
    return np.column_stack([rows / size[:, None], half / size + inside])

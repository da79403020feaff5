"""The sphere about a point of the arm base within which a point of the tool has to be.

The arm leaves a point of its first axis in place, and a point of its last axis, the wrist, moves
with the tool: their distance is at most the length of the chain between them. So most tool poses
out of reach are known by the position of their wrist alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import Chain, FloatArray
from tcs.kernel.freedom.forms import FEWEST_JOINTS

ROUNDS = 200
"""Steps towards the shortest chain."""
SHORTEST = 1e-6
"""Least length that a part of the chain counts with [m]."""
ROUNDING = 1e-9
"""What rounding may add to a distance [m]."""


class WristReach(NamedTuple):
    """Bound of the reach of an arm."""

    pivot: FloatArray
    """The point that stays in place, in the arm base A [m], shape (3,)."""
    wrist: FloatArray
    """The wrist in T [m], shape (3,); zero, the tool itself, for an arm of five joints, which turns
    the tool as it needs."""
    span: float
    """Greatest distance of the wrist from the pivot [m]."""


def wrist_reach(chain: Chain) -> WristReach:
    """Return the bound of an arm's reach.

    Any points of the joints' axes give a chain whose length is a bound; those of the shortest one
    are found by weighted least squares (Weiszfeld's method).

    Args:
        chain: The arm.
    """
    R, p = np.asarray(chain.R, dtype=np.float64), np.array(chain.p, dtype=np.float64)
    travel = 0.0
    for i in range(7):
        if chain.slides[i] == 0.0:
            continue
        # A prismatic joint counts from the middle of its range.
        p[i] += R[i, :, 2] * chain.slides[i] * 0.5 * (chain.lower[i] + chain.upper[i])
        travel += float(chain.slides[i] * 0.5 * (chain.upper[i] - chain.lower[i]))
    # Joints before the arm's own remain at 0; link i of the chain has its axis in frame i.
    first = 7 - chain.joints
    R_AL, p_AL = R[0], p[0]
    for i in range(first):
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
    return WristReach(
        pivot=p_AL + R_AL[:, 2] * s[first],
        wrist=wrist,
        span=float(length.sum()) + travel + ROUNDING,
    )

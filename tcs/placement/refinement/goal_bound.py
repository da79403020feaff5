r"""Upper bound of the dexterity at a goal, over every base pose and torso height.

Where the first axis of an arm is vertical, two facts about a goal do not depend on the base pose:
the height of the wrist centre above the first joint, up to the travel of the torso, and the angle
of axis 7 with the vertical. Only boxes of joints 2, 3 and 4 that allow this height count, and in
them only angles c between axes 5 and 7 that the angles of both with the vertical allow (see
`dexterity_bound`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from tcs.kernel.arrays import BoolArray, Chain, FloatArray
from tcs.placement.refinement.dexterity_bound import (
    ANGLES,
    MEETS,
    first_boxes,
    forearm,
    halved,
    relaxed_by_angle,
    wrist_height,
)
from tcs.placement.refinement.intervals import Interval

RESOLUTION = 8e-3
"""Difference from the greatest relaxed isotropy at which branching ends."""
MOST_BOXES = 60_000
"""Boxes evaluated at a time; with more, branching ends earlier and the bounds are greater."""
MIDDLES = 200
"""Boxes whose middles are evaluated for each goal, those with the greatest bounds."""
SLACK = 1e-6
"""Widening of heights [m] and angles [rad], above all rounding."""


@dataclass(frozen=True, eq=False)
class GoalLimits:
    """What holds at each goal whatever the base pose, in the direction of the first axis."""

    low: FloatArray
    """Least height of the wrist centre above the first joint [m], shape (G,)."""
    high: FloatArray
    """Greatest height [m], shape (G,)."""
    tilt: FloatArray
    """Angle of axis 7 with the first axis [rad], shape (G,)."""

    @classmethod
    def of(
        cls,
        chain: Chain,
        R_BA: FloatArray,
        p_BA: FloatArray,
        goal_R: FloatArray,
        goal_p: FloatArray,
    ) -> Self | None:
        """Return the limits of goals; None if the first axis is not vertical.

        Args:
            chain: The arm.
            R_BA: Rotation of the arm base in B at the lowest and the highest torso, (2, 3, 3).
            p_BA: Its origin [m], shape (2, 3).
            goal_R: Rotations of the goals in W, shape (G, 3, 3).
            goal_p: Their origins [m], shape (G, 3).
        """
        axis = R_BA @ chain.R[0][:, 2]
        up = np.sign(axis[0, 2])
        if np.any(np.abs(axis - [0.0, 0.0, up]) > MEETS):
            return None
        R_W7 = goal_R @ chain.R[7].T
        wrist = goal_p - R_W7 @ chain.p[7]
        joint = p_BA[:, 2] + (R_BA @ chain.p[0])[:, 2]
        heights = up * (wrist[None, :, 2] - joint[:, None])
        return cls(
            heights.min(axis=0) - SLACK,
            heights.max(axis=0) + SLACK,
            np.arccos(np.clip(up * R_W7[:, 2, 2], -1.0, 1.0)),
        )

    def allowed(self, goal: int, height: Interval, along: Interval) -> tuple[BoolArray, BoolArray]:
        """Return which boxes a goal allows, and which of `ANGLES` in them.

        Args:
            goal: Number of the goal.
            height: `wrist_height` of the boxes, shape (n,).
            along: `forearm` of the boxes.

        Returns:
            Shapes (n,) and (n, intervals).
        """
        fits = (height.high >= self.low[goal]) & (height.low <= self.high[goal])
        near = np.arccos(np.clip(along.high, -1.0, 1.0))
        far = np.arccos(np.clip(along.low, -1.0, 1.0))
        tilt = self.tilt[goal]
        low = np.maximum(np.maximum(near - tilt, tilt - far), 0.0) - SLACK
        sums = near + tilt, far + tilt
        crosses = (sums[0] <= np.pi) & (sums[1] >= np.pi)
        ends = [np.minimum(total, 2.0 * np.pi - total) for total in sums]
        high = np.where(crosses, np.pi, np.maximum(*ends)) + SLACK
        first, last = ANGLES[:-1], ANGLES[1:]
        direct = (low[:, None] <= last) & (high[:, None] >= first)
        supplement = (low[:, None] <= np.pi - first) & (high[:, None] >= np.pi - last)
        return fits, direct | supplement


def goal_bounds(chain: Chain, limits: GoalLimits, resolution: float = RESOLUTION) -> FloatArray:
    """Return an upper bound of the isotropy at each goal, shape (G,).

    Args:
        chain: An arm with a spherical wrist.
        limits: What holds at the goals.
        resolution: Difference from the greatest relaxed isotropy at which branching ends.
    """
    boxes, goals = first_boxes(chain), range(limits.tilt.size)
    taken = np.zeros(limits.tilt.size)
    while True:
        bounds = _bounds(chain, limits, boxes)
        # What a box cannot be shown to stay below: a value in the middle of one of the best.
        best = np.unique(np.argsort(-bounds, axis=0, kind="stable")[:MIDDLES])
        middle = (boxes.low[best] + boxes.high[best]) / 2.0
        at_middle = _bounds(chain, limits, Interval(middle, middle))
        taken = np.maximum(taken, at_middle.max(axis=0, initial=0.0))
        found = np.maximum(bounds.max(axis=0, initial=0.0), taken + resolution)
        is_open = np.zeros(len(bounds), dtype=np.bool_)
        for goal in goals:
            is_open |= bounds[:, goal] > taken[goal] + resolution
        if not np.any(is_open) or 2 * np.count_nonzero(is_open) > MOST_BOXES:
            return np.asarray(found)
        boxes = halved(boxes.rows(is_open))


def _bounds(chain: Chain, limits: GoalLimits, boxes: Interval) -> FloatArray:
    """Return the relaxed isotropy that each goal allows in each box, 0 for none, shape (n, G)."""
    relaxed = relaxed_by_angle(chain, boxes)
    height, along = wrist_height(chain, boxes), forearm(chain, boxes)
    found = np.zeros((len(relaxed), limits.tilt.size))
    for goal in range(limits.tilt.size):
        fits, angles = limits.allowed(goal, height, along)
        found[:, goal] = np.where(fits, np.where(angles, relaxed, 0.0).max(axis=1), 0.0)
    return found

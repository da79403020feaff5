"""Scores of configurations, and the codes of reasons."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import IntArray

REACHED, TOO_FAR, JOINT_LIMITS, BODY_BLOCKED = 0, 1, 2, 3
GRIPPER_BLOCKED_BY_ENVIRONMENT, GRIPPER_BLOCKED_BY_ROBOT, ARM_BLOCKED = 4, 5, 6
EXCLUDED, APPROACH_LIMITS, APPROACH_BLOCKED = 7, 8, 9
OTHER_GOAL_UNREACHED, ARMS_BLOCKED = 10, 11
"""Reasons, equal to the values of `tcs.placement.tables.Reason`."""


NEARNESS = np.empty(12, np.int64)
"""How near each reason is to reaching the goal: of several poses, the nearest is reported, and of
several hands the nearest serves."""
NEARNESS[
    [
        EXCLUDED,
        BODY_BLOCKED,
        TOO_FAR,
        GRIPPER_BLOCKED_BY_ENVIRONMENT,
        GRIPPER_BLOCKED_BY_ROBOT,
        JOINT_LIMITS,
        ARM_BLOCKED,
        APPROACH_LIMITS,
        APPROACH_BLOCKED,
        OTHER_GOAL_UNREACHED,
        ARMS_BLOCKED,
        REACHED,
    ]
] = np.arange(12)


JOINTS = 7
"""Joint angles of a posture."""


class Scores(NamedTuple):
    """Scores of configurations, a row for each."""

    reason: NDArray[np.uint8]
    """Codes of reasons, shape (n, goals)."""
    contact: NDArray[np.int32]
    """Contact code or NO_CONTACT, shape (n, goals)."""
    dexterity: NDArray[np.float32]
    """Dexterity measure of the best solution, unchanged where not reached, shape (n, goals)."""
    joints: NDArray[np.float32]
    """Joint angles of the best solution [rad], unchanged where not reached, shape
    (n, goals, 7)."""

    def put(self, rows: IntArray | NDArray[np.bool_], found: Scores) -> None:
        """Replace the scores of some rows."""
        self.reason[rows], self.contact[rows] = found.reason, found.contact
        self.dexterity[rows], self.joints[rows] = found.dexterity, found.joints


def joined(parts: Iterable[Scores]) -> Scores:
    """Return the scores of all rows of one part after the other."""
    return Scores(*map(np.concatenate, zip(*parts, strict=True)))


def new_scores(rows: int, goals: int) -> Scores:
    """Return scores to be filled: dexterity and joints are 0 where nothing is reached."""
    return Scores(
        # No reason and no contact: what is not scored must not count as reached.
        reason=np.full((rows, goals), 255, np.uint8),
        contact=np.full((rows, goals), -9, np.int32),
        dexterity=np.zeros((rows, goals), np.float32),
        joints=np.zeros((rows, goals, JOINTS), np.float32),
    )

"""Scores of a slice of the grid, and the codes of reasons."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

REACHED, TOO_FAR, JOINT_LIMITS, BODY_BLOCKED = 0, 1, 2, 3
GRIPPER_BLOCKED_BY_ENVIRONMENT, GRIPPER_BLOCKED_BY_ROBOT, ARM_BLOCKED = 4, 5, 6
APPROACH_LIMITS, APPROACH_BLOCKED = 8, 9
"""Reasons, equal to the values of `tcs.placement.tables.Reason`."""


class Scores(NamedTuple):
    """Scores of a slice; row 0 is the first configuration of the slice."""

    reason: NDArray[np.uint8]
    """Codes of reasons, shape (n, goals)."""
    contact: NDArray[np.int32]
    """Contact code or NO_CONTACT, shape (n, goals)."""
    dexterity: NDArray[np.float32]
    """Dexterity measure of the best solution, unchanged where not reached, shape (n, goals)."""
    joints: NDArray[np.float32]
    """Joint angles of the best solution [rad], unchanged where not reached, shape
    (n, goals, 7)."""

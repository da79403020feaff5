"""Where the arm stands when a person begins to drive it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.teleop import Arm, Settings
from tcs.teleop.control import smallest_singular_value
from tcs.teleop.flags import share_of_range
from tcs.view.teleop.stage import Stage

FloatArray = NDArray[np.float64]
_CANDIDATES = 8000
_AHEAD = 0.8
"""Cosine between the tool's x axis and straight ahead: within 37 degrees."""
_AREA = ((0.4, 0.75), (-0.3, 0.3), (-0.4, 0.4))
"""Where the tool may be from the shoulder: ahead, left, up, in shares of the arm's length."""


def start_posture(arm: Arm, stage: Stage) -> FloatArray:
    """Return a posture from which there is room to move, the same each time [rad], shape (7,).

    Of many postures drawn within the limits whose tool points ahead, the one with the most room:
    the smallest singular value of the tool's Jacobian times how far the joint closest to a limit
    is from it. Postures in which the robot touches itself are passed over.

    Args:
        arm: The arm.
        stage: Its robot.
    """
    drawn = arm.random_joints(np.random.default_rng(0), _CANDIDATES)
    shoulder = arm.frames[0, :3, 3]
    length = float(np.linalg.norm(arm.frames[1:, :3, 3], axis=1).sum())
    low, high = np.array(_AREA).T * length
    rated = []
    for joints in drawn:
        at = arm.kinematics(joints)
        place = at.p - shoulder
        if at.R[0, 0] < _AHEAD or (place < low).any() or (place > high).any():
            continue
        shares = share_of_range(arm, joints)
        room = float(np.minimum(shares, 1.0 - shares)[arm.bounded].min(initial=0.5))
        rated.append((room * smallest_singular_value(at.jacobian, Settings().length), joints))
    rated.sort(key=lambda one: -one[0])
    for _, joints in rated:
        stage.poses(joints)
        if stage.contacts() is None:
            return np.array(joints)
    # An arm that never points ahead begins in the middle of its range.
    middle: FloatArray = np.where(arm.bounded, 0.5 * (arm.lower + arm.upper), 0.0)
    return middle

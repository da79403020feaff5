"""Start posture of the live page, far from limits and singularities."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.output.view.teleop.robot_display import RobotDisplay
from tcs.teleop import Arm, Settings
from tcs.teleop.control.resolved_rate import smallest_singular_value
from tcs.teleop.control.state import range_fraction

FloatArray = NDArray[np.float64]
_CANDIDATES, _TRIED, _CLIMB = 3000, 20, 500
"""Number of random postures, of the best ones that are refined, and of refinement steps."""
_AHEAD = 0.8
"""Least cosine of the angle between the tool's x axis and the robot's x axis: 37 degrees."""
_AREA = ((0.4, 0.75), (-0.3, 0.3), (-0.4, 0.4))
"""Range of the tool position relative to the shoulder (forward, left, up), in arm lengths."""


def start_posture(arm: Arm, display: RobotDisplay) -> FloatArray:
    """Return a start posture far from limits and singularities [rad], shape (7,).

    The result is deterministic. Of postures within the limits whose tool points forward, it has a
    large product of the smallest singular value of the tool's Jacobian and the distance of the
    closest joint from its limit, as a fraction of its range. Postures in self-contact are skipped.

    Args:
        arm: The arm.
        display: The robot display, which checks contacts.
    """
    rng = np.random.default_rng(0)
    area = _area(arm)
    drawn = [
        (_margin(arm, joints, *area), joints) for joints in arm.random_joints(rng, _CANDIDATES)
    ]
    drawn.sort(key=lambda one: -one[0])
    for found, at in drawn[:_TRIED]:
        best, joints = found, at
        for spread in np.geomspace(0.3, 0.01, _CLIMB):
            near = joints + rng.normal(0.0, spread, len(joints))
            margin = _margin(arm, near, *area)
            if margin > best:
                best, joints = margin, near
        display.poses(joints)
        if best > 0.0 and display.contacts() is None:
            return np.array(joints)
    # Without such a posture, the start is in the middle of the joint ranges.
    low, high = (np.where(arm.bounded, ends, 0.0) for ends in (arm.lower, arm.upper))
    return np.asarray(0.5 * (low + high))


def _area(arm: Arm) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of the tool position in the base frame [m], shapes (3,)."""
    shoulder = arm.frames[0, :3, 3]
    length = float(np.linalg.norm(arm.frames[1:, :3, 3], axis=1).sum())
    low, high = np.array(_AREA).T * length
    return shoulder + low, shoulder + high


def _margin(arm: Arm, joints: FloatArray, low: FloatArray, high: FloatArray) -> float:
    """Return the margin of a posture to limits and singularities; 0 if the tool pose is invalid."""
    at = arm.kinematics(joints)
    if at.R[0, 0] < _AHEAD or (at.p < low).any() or (at.p > high).any():
        return 0.0
    fractions = range_fraction(arm, joints)
    margin = float(np.minimum(fractions, 1.0 - fractions)[arm.bounded].min(initial=0.5))
    return max(margin, 0.0) * smallest_singular_value(at.jacobian, Settings().length)

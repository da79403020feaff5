"""Status of a joint configuration, as reported to the operator: joint limits and singularities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import Arm
from tcs.teleop.control.resolved_rate import smallest_singular_value
from tcs.teleop.control.settings import Mode, Settings

ShortArray = NDArray[np.int8]
POSITION_MODES = (Mode.NULL_SPACE,)
"""Modes whose task is the tool's position alone: three rows of the Jacobian, not six."""


@dataclass(frozen=True, slots=True, eq=False)
class ConfigurationStatus:
    """Joints at their limits, and distance to a singularity.

    Attributes:
        limits: -1 where a joint is at its lower limit, 1 at its upper limit, else 0; shape (7,).
        singular: Whether the task is singular.
        singular_value: Smallest singular value of the task's Jacobian [m/rad].
        worst_joint: The joint closest to a limit as a fraction of its range, counted from 0.
    """

    limits: ShortArray
    singular: bool
    singular_value: float
    worst_joint: int


def range_fraction(arm: Arm, joints: FloatArray) -> FloatArray:
    """Return joint positions as fractions of their ranges: 0 lower, 1 upper, 0.5 without limits.

    Args:
        arm: The arm.
        joints: Joint positions [rad], shape (..., 7).
    """
    bounded = arm.bounded
    span = np.where(bounded, arm.upper - arm.lower, 1.0)
    start = np.where(bounded, arm.lower, joints - 0.5)
    return (joints - start) / span


def configuration_status(
    arm: Arm, joints: FloatArray, jacobian: FloatArray, mode: Mode, settings: Settings
) -> ConfigurationStatus:
    """Return the status of a posture.

    Args:
        arm: The arm.
        joints: Joint positions [rad], shape (7,).
        jacobian: Jacobian of the tool, shape (6, 7).
        mode: The control mode, which determines the task: the tool's position, or its pose.
        settings: Settings of the controller, with the thresholds.
    """
    below, above = joints - arm.lower, arm.upper - joints
    limits = np.zeros(len(joints), np.int8)
    limits[above <= settings.near_limit] = 1
    limits[below <= settings.near_limit] = -1
    rows = jacobian[3:] if mode in POSITION_MODES else jacobian
    value = smallest_singular_value(rows, settings.length)
    # A continuous joint is never the worst.
    margin = np.minimum(below, above)
    fractions = np.where(
        np.isfinite(margin), margin / np.where(arm.bounded, above + below, 1.0), 1.0
    )
    return ConfigurationStatus(limits, value < settings.singular, value, int(fractions.argmin()))

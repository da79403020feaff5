"""The slave: an arm that follows goal poses, position before orientation."""

from __future__ import annotations

import math
from enum import StrEnum

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import Arm
from tcs.teleop.control.resolved_rate import pose_error
from tcs.teleop.control.session import Step, Teleoperation
from tcs.teleop.control.settings import Command, Mode, Settings

PERIOD = 0.04
"""Time between two control periods of the slave [s]: two periods of the master."""
_GAIN = 10.0
"""Commanded velocity per distance to the goal [1/s]: the tool follows with a lag of 0.1 s."""
_FASTEST = (1.5, 0.4)
"""Greatest commanded velocities, angular and linear [rad/s; m/s], as in
`tcs_studies.simulated_recording`."""


class Control(StrEnum):
    """Control of the slave."""

    POSITION_FIRST = "position-first"
    """Position before orientation, as in the thesis: where joints are at their limits, the tool
    loses orientation and keeps its position."""
    NULL_SPACE = "null-space"
    """The same, and the operator moves joint group 1 where the tool does not follow."""
    ASSISTED = "assisted"
    """The same, and the redundancy avoids limits and singularities."""


class Slave:
    """An arm that follows the goal poses of a master."""

    def __init__(self, arm: Arm, joints: FloatArray, control: Control) -> None:
        """Start at rest.

        Args:
            arm: The arm.
            joints: Joint positions [rad], shape (7,).
            control: Control of the redundancy.
        """
        rate = Settings().assist_rate if control is Control.ASSISTED else 0.0
        settings = Settings(period=PERIOD, assist_rate=rate)
        self._session = Teleoperation(arm, joints, settings, Mode.ASSISTED)
        self.step: Step = self._session.step(Command())
        """The last step."""
        self.group_rate = settings.group_rate
        """Rate of joint group 1 [rad/s]."""

    def follow(self, p: FloatArray, R: FloatArray) -> None:
        """Move towards a goal pose for one period.

        Args:
            p: Goal position in the base [m], shape (3,).
            R: Goal orientation in the base, shape (3, 3).
        """
        twist = _GAIN * pose_error(R, p, self.step.R, self.step.p)
        for part, fastest in zip((twist[:3], twist[3:]), _FASTEST, strict=True):
            part *= min(1.0, fastest / max(math.sqrt(part @ part), 1e-12))
        self.step = self._session.step(
            Command(angular=twist[:3], linear=twist[3:], mode=Mode.ASSISTED)
        )

    def turn_group(self, sign: int) -> None:
        """Move joint group 1 for one period while the tool's position is held.

        Args:
            sign: Direction, -1 or 1; 0 lets the group come to rest.
        """
        self.step = self._session.step(Command(group=0, sign=sign, mode=Mode.NULL_SPACE))


def orientation(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return the rotation Rz(yaw) Ry(pitch) Rx(roll), shape (3, 3).

    Args:
        roll: Roll [rad].
        pitch: Pitch [rad].
        yaw: Yaw [rad].
    """
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )

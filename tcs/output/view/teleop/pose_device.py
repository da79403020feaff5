"""Pose device: an XR controller whose motion the tool follows 1:1 while its trigger is held."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.teleop.control.resolved_rate import rotation_vector

FloatArray = NDArray[np.float64]
INDEX = 100
"""Number by which the operator's page marks a pose among the gamepads of Meshcat's socket; those of
a browser are 0 to 3."""
MOST_LINEAR, MOST_ANGULAR = 0.5, 2.0
"""Greatest commanded velocities [m/s, rad/s]; a faster hand is followed with a delay."""
TIMEOUT = 0.15
"""Time without a new pose after which the device counts as lost [s]: ten frames of a headset."""
FASTEST_HAND = 4.0
"""Speed beyond which two poses are not those of one hand [m/s]: tracking was lost between them."""
_BUNCHED = 0.1
"""Distance that is always possible [m]: after a delay, frames of the browser arrive together."""
_HELD = 0.5
"""Value of the trigger from which it counts as held."""
_TIME_CONSTANT = 0.05
"""Time constant with which the commanded motion follows the hand [s]."""
_FARTHEST, _WIDEST = 0.1, 0.5
"""Greatest lag of the commanded motion behind the hand [m, rad]; what is beyond is dropped."""
_ROLL = 0.35
"""Rotation of the controller about its own axis from which it moves a joint group [rad]."""
_SETTLES = 0.3
"""Time after a release for which the clutch stays open for the arm to come to rest [s]."""
_LENGTH = 8
"""Length of a pose in Meshcat's message: number, position, quaternion xyzw."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseState:
    """State of the controller as last reported by the page."""

    number: float
    """Number of the pose; it changes with every frame of the headset."""
    p: FloatArray
    """Position of the hand in the robot's base, up to an offset [m], shape (3,)."""
    R: FloatArray
    """Orientation of the hand in the robot's base, up to a rotation on the right, shape (3, 3)."""
    trigger: bool
    """Whether the trigger, the dead-man switch, is held."""
    side_button: bool
    """Whether the side button is pressed."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseCommand:
    """Command of the pose device."""

    engaged: bool = False
    """Whether the trigger is held, so that the device commands."""
    linear: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Velocity of the tool [m/s]."""
    angular: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Angular velocity of the tool [rad/s]."""
    turn: int = 0
    """Direction of the joint group: the controller is rolled to one side, like a key."""
    next_mode: bool = False
    """Whether the side button was just pressed."""
    clutch: bool = False
    """Whether the trigger was just released: the arm comes to rest, and not at its target."""
    lost: str = ""
    """Why the arm has to stop; empty if it need not."""


def pose_state(
    index: int | None, axes: Sequence[float], buttons: Sequence[float]
) -> PoseState | None:
    """Return the pose in the state of a gamepad of Meshcat; None if there is none.

    Args:
        index: Number of the gamepad; that of a pose is `INDEX`.
        axes: Number of the pose, position, quaternion xyzw.
        buttons: Values of trigger and side button.
    """
    values = np.asarray(axes, dtype=np.float64)
    if index != INDEX or values.shape != (_LENGTH,) or not np.isfinite(values).all():
        return None
    quaternion = values[4:]
    if not abs(float(np.linalg.norm(quaternion)) - 1.0) < 1e-2:
        return None
    pressed = [float(value) >= _HELD for value in buttons] + [False, False]
    return PoseState(
        float(values[0]), values[1:4], Rotation.from_quat(quaternion).as_matrix(), *pressed[:2]
    )


class PoseDevice:
    """A pose device over time: a clutch that is closed while the trigger is held.

    The trigger moves the arm only after it was released with the device in view, so that a device
    that comes back with its trigger held moves nothing.
    """

    def __init__(self, period: float) -> None:
        """Begin without a device.

        Args:
            period: Time of a control step [s].
        """
        self._period = period
        self._last: PoseState | None = None
        self._arrived, self._released = 0.0, -math.inf
        self._ready, self._lost = False, ""
        self._anchor: PoseState | None = None
        """Pose of the hand when the trigger was pressed; None while it is released."""
        self._moved, self._turned = np.zeros(3), np.eye(3)
        """Commanded motion since then."""

    def update(self, pose: PoseState | None, now: float) -> PoseCommand:
        """Return the command of the next control step.

        Args:
            pose: State of the device; None if there is none.
            now: Time [s].
        """
        before, self._last = self._last, pose
        if pose is None:
            return self._stop("XR controller lost: the arm stops") if before else self._idle()
        if before is None or pose.number != before.number:
            glitch = before is not None and _is_glitch(before, pose, now - self._arrived)
            self._arrived = now
            if glitch:
                return self._stop("XR controller: its pose jumped, the arm stops")
        elif now - self._arrived > TIMEOUT:
            return self._stop(f"XR controller: no pose for {TIMEOUT:g} s, the arm stops")
        next_mode = before is not None and pose.side_button and not before.side_button
        if not pose.trigger:
            if self._anchor is not None:
                self._released = now
            self._ready, self._lost = True, ""
            self._drop()
            return PoseCommand(next_mode=next_mode, clutch=now - self._released < _SETTLES)
        if not self._ready:
            return self._idle()
        return self._follow(pose, next_mode)

    def drop_lag(self) -> None:
        """Drop the motion of the hand that was not commanded yet, as the arm does not follow."""
        if self._anchor is not None and self._last is not None:
            self._moved = self._last.p - self._anchor.p
            self._turned = self._last.R @ self._anchor.R.T

    def dismiss(self) -> None:
        """Continue without a lost device."""
        self._lost = ""

    def _follow(self, pose: PoseState, next_mode: bool) -> PoseCommand:
        """Return the velocity that takes the commanded motion to that of the hand."""
        anchor = self._anchor = self._anchor or pose
        moved = pose.p - anchor.p
        turned = pose.R @ anchor.R.T
        ahead = moved - self._moved
        distance = float(np.linalg.norm(ahead))
        if distance > _FARTHEST:
            ahead *= _FARTHEST / distance
        rotation = rotation_vector(turned @ self._turned.T)
        angle = float(np.linalg.norm(rotation))
        if angle > _WIDEST:
            rotation *= _WIDEST / angle
        linear = _limited(ahead / _TIME_CONSTANT, MOST_LINEAR)
        angular = _limited(rotation / _TIME_CONSTANT, MOST_ANGULAR)
        # What is dropped above counts as commanded.
        self._moved = moved - ahead + linear * self._period
        step = Rotation.from_rotvec(angular * self._period).as_matrix()
        self._turned = step @ Rotation.from_rotvec(rotation).as_matrix().T @ turned
        # The controller points along its -z axis; its roll is the rotation about that.
        roll = -float(rotation_vector(turned) @ anchor.R[:, 2])
        turn = int(math.copysign(1.0, roll)) if abs(roll) > _ROLL else 0
        return PoseCommand(True, tuple(linear.tolist()), tuple(angular.tolist()), turn, next_mode)

    def _stop(self, why: str) -> PoseCommand:
        """Stop, and report it if the device was driving; it has to be released to go on."""
        if self._anchor is not None:
            self._lost = (
                f"{why}. Release the trigger to continue, or press the space bar to continue "
                "without it."
            )
        self._ready = False
        self._drop()
        return PoseCommand(lost=self._lost)

    def _idle(self) -> PoseCommand:
        return PoseCommand(lost=self._lost)

    def _drop(self) -> None:
        """Open the clutch."""
        self._anchor = None
        self._moved, self._turned = np.zeros(3), np.eye(3)


def _is_glitch(before: PoseState, pose: PoseState, seconds: float) -> bool:
    """Return whether the hand cannot have moved between two poses that arrived in some time."""
    return float(np.linalg.norm(pose.p - before.p)) > _BUNCHED + FASTEST_HAND * seconds


def _limited(vector: FloatArray, most: float) -> FloatArray:
    """Return a vector, shortened to a greatest length."""
    return vector * min(1.0, most / max(float(np.linalg.norm(vector)), 1e-12))

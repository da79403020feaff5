"""A run: commands and arm states of a teleoperation session, sample by sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import DataFileError
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.teleop.control.settings import Mode
from tcs.teleop.line import Line

IntArray = NDArray[np.int64]
SCRIPTED_TYPE = "scripted"
"""Metadata `operator_type` of a run with a scripted operator."""
NO_GROUP = -1
"""Value of `Run.group` where no joint group was commanded."""
_UNIT_SLACK = 1e-6
"""Tolerance of the length of a quaternion: files store ten digits."""
_FARTHEST = {
    "time": (1e7, "s"),
    "joints": (1e3, "rad"),
    "rates": (1e3, "rad/s"),
    "position": (1e3, "m"),
    "linear": (1e3, "m/s"),
    "angular": (1e3, "rad/s"),
}
"""Greatest magnitude and unit of plausible values; a file with greater ones is damaged."""
_MOST_GROUPS = 100
"""Greatest number of joint groups that settings may define; the paper has four."""


@dataclass(frozen=True, eq=False)
class Run:
    """A run of n samples."""

    joint_names: tuple[str, ...]
    """Names of the joints, from the base outward."""
    time: FloatArray
    """Time since the start of the session [s], ascending, shape (n,)."""
    joints: FloatArray
    """Joint positions [rad], shape (n, 7)."""
    rates: FloatArray
    """Joint rates [rad/s], shape (n, 7)."""
    position: FloatArray
    """Position of the tool in the robot's base [m], shape (n, 3)."""
    quaternion: FloatArray
    """Orientation of the tool in the robot's base, unit quaternion wxyz, shape (n, 4)."""
    linear: FloatArray
    """Commanded velocity of the tool in the robot's base [m/s], shape (n, 3)."""
    angular: FloatArray
    """Commanded angular velocity of the tool in the robot's base [rad/s], shape (n, 3)."""
    group: IntArray
    """Commanded joint group, counted from 0, shape (n,); `NO_GROUP` for none."""
    sign: IntArray
    """Commanded direction of the group: -1, 0 or 1, shape (n,)."""
    clutch: BoolArray
    """Whether the clutch decoupled master and slave, shape (n,)."""
    mode: NDArray[np.str_]
    """Name of the control mode, shape (n,)."""
    limits: IntArray
    """-1 where a joint was at its lower limit, 1 at its upper limit, else 0, shape (n, 7)."""
    singular: BoolArray
    """Whether the task was singular, shape (n,)."""
    stopped: BoolArray
    """Whether the arm did not follow the command, shape (n,)."""
    metadata: Mapping[str, Any] = field(default_factory=dict)
    """Origin of the run, such as robot, condition and seed, as values of JSON."""

    def __post_init__(self) -> None:
        """Check the shapes and make the arrays read-only.

        Raises:
            DataFileError: If shapes do not match, a number is not finite or out of range, a mode is
                unknown, times are not ascending, or a quaternion does not have length 1.
        """
        n, m = len(self.time), len(self.joint_names)
        wide = {"joints": m, "rates": m, "limits": m, "quaternion": 4}
        wide |= dict.fromkeys(("position", "linear", "angular"), 3)
        if n < 2:
            raise DataFileError(f"run: it has {n} samples; at least 2 are needed.")
        for name in ARRAYS:
            array = getattr(self, name)
            expected = (n, wide[name]) if name in wide else (n,)
            if array.shape != expected:
                raise DataFileError(
                    f"run: '{name}' has shape {array.shape}; with {n} times and {m} joints it must "
                    f"be {expected}."
                )
            array.flags.writeable = False
            if array.dtype.kind == "f":
                self._check(np.isfinite(array), f"'{name}' is not finite")
            if name in _FARTHEST:
                farthest, unit = _FARTHEST[name]
                self._check(
                    np.abs(array) <= farthest, f"'{name}' must be within {farthest:g} {unit}"
                )
        self._check(np.isin(self.mode, list(Mode)), f"'mode' must be one of {', '.join(Mode)}")
        for name in ("sign", "limits"):
            self._check(np.isin(getattr(self, name), (-1, 0, 1)), f"'{name}' must be -1, 0 or 1")
        self._check(
            (self.group >= NO_GROUP) & (self.group < _MOST_GROUPS),
            f"'group' must be {NO_GROUP} (none) to {_MOST_GROUPS - 1}",
        )
        rising = np.diff(self.time, prepend=self.time[0] - 1.0) > 0.0
        self._check(rising, "'time' must rise from sample to sample")
        unit = "'quaternion' must have length 1"
        # The square of a huge number would overflow.
        self._check(np.abs(self.quaternion) <= 1.0 + _UNIT_SLACK, unit)
        length = np.linalg.norm(self.quaternion, axis=1)
        self._check(np.abs(length - 1.0) <= _UNIT_SLACK, unit)

    def _check(self, valid: BoolArray, requirement: str) -> None:
        """Raise an error for the first sample that is not valid.

        Args:
            valid: Whether each value is valid, shape (n,) or (n, k).
            requirement: The requirement, for the message.

        Raises:
            DataFileError: If a sample is not valid.
        """
        rows = valid.reshape(len(valid), -1).all(axis=1)
        if not rows.all():
            raise DataFileError(f"run, sample {int(np.argmin(rows))}: {requirement}.")

    def __len__(self) -> int:
        return len(self.time)

    @property
    def step(self) -> float:
        """Mean time from one sample to the next [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self) - 1)

    @property
    def line(self) -> Line | None:
        """The line to follow, in the robot's base; None if the metadata contain none."""
        try:
            return Line(*(tuple(self.metadata[name]) for name in ("line_start", "line_end")))
        except (KeyError, OverflowError, TypeError, ValueError, DataFileError):
            return None

    def hand(self) -> tuple[FloatArray, FloatArray]:
        """Return the path of the operator's hand while it was coupled to the tool.

        The path is the integral of the commanded velocities, from the origin. A decoupled hand
        counts as at rest, as the paper computes effort from the controlled path only.

        Returns:
            Positions [m], shape (n, 3), and roll, pitch, yaw [rad], shape (n, 3), in the robot's
            base.
        """
        from scipy.spatial.transform import Rotation

        moving = (~self.clutch & (self.group == NO_GROUP))[:, None]
        dt = np.diff(self.time, prepend=self.time[0])[:, None]
        position = np.cumsum(np.where(moving, self.linear, 0.0) * dt, axis=0)
        rotations = Rotation.from_rotvec(np.where(moving, self.angular, 0.0) * dt).as_matrix()
        R = np.empty_like(rotations)
        current = np.eye(3)
        for i, rotation in enumerate(rotations):
            current = R[i] = rotation @ current
        angles = Rotation.from_matrix(R).as_euler("xyz", suppress_warnings=True)
        return position, angles


ARRAYS = tuple(one.name for one in fields(Run) if one.name not in ("joint_names", "metadata"))
"""Names of the arrays of a run."""

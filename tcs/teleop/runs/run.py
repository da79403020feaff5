"""A run: what the operator commanded and what the arm did, sample by sample, and its file.

A run's CSV file has a row of names and a row per sample. The arm's joints stand in columns of their
own names, in radians, so that `tcs capability record RUN.csv` makes a map of it as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import DataFileError
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.teleop.control.settings import Mode

IntArray = NDArray[np.int64]
NO_GROUP = -1
"""Stands where no joint group was asked for."""
_UNIT_SLACK = 1e-6
"""How far from 1 a quaternion read from a file may be long: ten digits are written."""
_FARTHEST = 1000.0
"""A joint farther from zero than this [rad], 160 turns, is a broken file's."""


@dataclass(frozen=True, eq=False)
class Run:
    """A run of n samples; poses are those of the tool in the arm's frame of reference."""

    joint_names: tuple[str, ...]
    time: FloatArray
    """From the start of the run [s], shape (n,), rising."""
    joints: FloatArray
    """[rad], shape (n, 7)."""
    rates: FloatArray
    """[rad/s], shape (n, 7)."""
    position: FloatArray
    """[m], shape (n, 3)."""
    quaternion: FloatArray
    """Of length 1, wxyz, shape (n, 4)."""
    linear: FloatArray
    """Commanded velocity of the tool [m/s], shape (n, 3)."""
    angular: FloatArray
    """Commanded angular velocity of the tool [rad/s], shape (n, 3)."""
    group: IntArray
    """Commanded joint group, counted from 0, shape (n,); `NO_GROUP` for none."""
    sign: IntArray
    """The way it was to turn: -1, 0 or 1, shape (n,)."""
    clutch: BoolArray
    """Whether the clutch was pressed, which parts arm and hand, shape (n,)."""
    mode: NDArray[np.str_]
    """Name of the control mode, shape (n,)."""
    limits: IntArray
    """-1 where a joint was at its lower limit, 1 at its upper one, else 0, shape (n, 7)."""
    singular: BoolArray
    """Whether the arm was next to a singularity, shape (n,)."""
    stopped: BoolArray
    """Whether the arm refused to move on, shape (n,)."""
    metadata: Mapping[str, Any] = field(default_factory=dict)
    """Robot, condition, seed and whatever else tells where it is from: plain containers."""

    def __post_init__(self) -> None:
        """Check the shapes and make the arrays read-only.

        Raises:
            DataFileError: If the arrays do not belong together, a number is not finite, a mode is
                not known, a joint is turned beyond reason, the time does not rise, or a quaternion
                is not of length 1.
        """
        n, m = len(self.time), len(self.joint_names)
        wide = {"joints": m, "rates": m, "limits": m, "quaternion": 4}
        wide |= dict.fromkeys(("position", "linear", "angular"), 3)
        if n < 2:
            raise DataFileError(f"a run of {n} samples; it takes two at least.")
        for name in ARRAYS:
            array = getattr(self, name)
            expected = (n, wide[name]) if name in wide else (n,)
            if array.shape != expected:
                raise DataFileError(
                    f"run: '{name}' has shape {array.shape}; with {n} times and {m} joints it must "
                    f"be {expected}."
                )
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                row = int(np.argmax(~np.isfinite(array.reshape(n, -1)).all(axis=1)))
                raise DataFileError(f"run, sample {row}: '{name}' is not finite.")
            array.flags.writeable = False
        known = set(Mode)
        for row, mode in enumerate(self.mode):
            if mode not in known:
                raise DataFileError(
                    f"run, sample {row}: mode '{mode}' is none of {', '.join(Mode)}."
                )
        far = np.abs(self.joints) > _FARTHEST
        if far.any():
            row = int(np.argmax(far.any(axis=1)))
            raise DataFileError(
                f"run, sample {row}: a joint at {np.abs(self.joints[row]).max():g} rad; must be "
                f"within {_FARTHEST:g}."
            )
        if np.any(np.diff(self.time) <= 0.0):
            row = int(np.argmax(np.diff(self.time) <= 0.0)) + 1
            raise DataFileError(f"run, sample {row}: the time {self.time[row]:g} s does not rise.")
        if np.any(np.abs(np.linalg.norm(self.quaternion, axis=1) - 1.0) > _UNIT_SLACK):
            raise DataFileError("run: the tool's quaternions (qw, qx, qy, qz) must have length 1.")

    def __len__(self) -> int:
        return len(self.time)

    @property
    def step(self) -> float:
        """Mean time from one sample to the next [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self) - 1)

    def hand(self) -> tuple[FloatArray, FloatArray]:
        """Return where the hand went while it was coupled to the tool.

        Commanded velocities are summed up from the origin; while the hand is not coupled it counts
        as at rest, as the paper reads effort off the controlled path only.

        Returns:
            Positions [m], shape (n, 3), and roll, pitch, yaw [rad], shape (n, 3), in the frame of
            the tool's poses.
        """
        from scipy.spatial.transform import Rotation

        moving = (~self.clutch & (self.group == NO_GROUP))[:, None]
        dt = np.diff(self.time, prepend=self.time[0])[:, None]
        position = np.cumsum(np.where(moving, self.linear, 0.0) * dt, axis=0)
        turns = Rotation.from_rotvec(np.where(moving, self.angular, 0.0) * dt).as_matrix()
        R = np.empty_like(turns)
        current = np.eye(3)
        for i, turn in enumerate(turns):
            current = R[i] = turn @ current
        angles = Rotation.from_matrix(R).as_euler("xyz", suppress_warnings=True)
        return position, angles


ARRAYS = tuple(one.name for one in fields(Run) if one.name not in ("joint_names", "metadata"))

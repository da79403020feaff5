"""A straight line for the tool to follow, and the posture of the arm at its start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcs.errors import DataFileError
from tcs.kernel.arrays import FloatArray

GOAL_RADIUS = 0.02
"""Radius of the sphere at the end of the line [m]; the paper shows one without its size."""


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line for the tool to follow, in the frame of the tool poses [m]."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Check the ends.

        Raises:
            DataFileError: If an end is not finite, or both are equal.
        """
        ends = np.array([self.start, self.end], dtype=np.float64)
        if ends.shape != (2, 3) or not np.isfinite(ends).all() or self.length <= 0.0:
            raise DataFileError(
                f"line from {self.start} to {self.end}: both ends must be three finite numbers in "
                "metres, and differ."
            )

    @property
    def length(self) -> float:
        """Distance from start to end [m]."""
        return float(np.linalg.norm(np.subtract(self.end, self.start)))

    @property
    def direction(self) -> FloatArray:
        """Unit vector from start to end, shape (3,)."""
        return np.asarray(np.subtract(self.end, self.start) / self.length)

    def at(self, fraction: FloatArray | float) -> FloatArray:
        """Return the point at a fraction of the line [m], shape (..., 3)."""
        along = np.asarray(fraction, dtype=np.float64)[..., None]
        return np.asarray(self.start + along * np.subtract(self.end, self.start))

    def fraction_at(self, position: FloatArray) -> FloatArray:
        """Return the fraction of the line at the projection of a point, shape (...)."""
        return np.asarray((position - np.asarray(self.start)) @ self.direction / self.length)


@dataclass(frozen=True, eq=False)
class Course:
    """A line, and the posture of the arm at its start."""

    line: Line
    """The line in the robot's base [m]."""
    joints: FloatArray
    """Start posture [rad], shape (7,)."""
    blocking: int
    """The joint that blocks the line, counted from 0."""
    turns: tuple[float, ...]
    """Rotations of joint 1 that unblock the line [rad]."""

    def __post_init__(self) -> None:
        """Make the array read-only."""
        self.joints.flags.writeable = False

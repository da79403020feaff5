"""A straight line for the tool to follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcs.errors import DataFileError
from tcs.kernel.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line that the tool is to follow, in the frame of the arm's poses [m]."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Refuse a line that leads nowhere.

        Raises:
            DataFileError: If an end is not finite, or both are the same place.
        """
        ends = np.array([self.start, self.end], dtype=np.float64)
        if ends.shape != (2, 3) or not np.isfinite(ends).all() or self.length <= 0.0:
            raise DataFileError(
                f"line from {self.start} to {self.end}: both ends must be three finite numbers in "
                "metres, and not the same place."
            )

    @property
    def length(self) -> float:
        """From start to end [m]."""
        return float(np.linalg.norm(np.subtract(self.end, self.start)))

    @property
    def direction(self) -> FloatArray:
        """From start to end, of length 1, shape (3,)."""
        return np.asarray(np.subtract(self.end, self.start) / self.length)

    def at(self, share: FloatArray | float) -> FloatArray:
        """Return the point after a share of the way [m], shape (..., 3)."""
        along = np.asarray(share, dtype=np.float64)[..., None]
        return np.asarray(self.start + along * np.subtract(self.end, self.start))

    def fraction_at(self, position: FloatArray) -> FloatArray:
        """Return which share of the way lies behind the foot of a point, shape (...)."""
        return np.asarray((position - np.asarray(self.start)) @ self.direction / self.length)

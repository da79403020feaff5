"""Point distribution model: mean shape, deformation modes and the energy of each mode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class PointDistribution:
    """Shapes as the mean plus a sum of modes: h = mean + modes b.

    A shape is a vector: the coordinates of its landmarks, or its signed distances on a grid.

    Source:
        ITCM thesis, Appendix D.3.4.
    """

    mean: NDArray[Any]
    """Mean shape, shape (size,)."""
    modes: NDArray[Any]
    """Eigenvectors of the covariance, by descending eigenvalue, shape (size, modes)."""
    variance: FloatArray
    """Eigenvalues, shape (modes,)."""

    @classmethod
    def of(cls, shapes: FloatArray) -> PointDistribution:
        """Return the model of some shapes, with all modes that they can have.

        Args:
            shapes: Shape (shapes, size).
        """
        mean = shapes.mean(axis=0)
        _, stretch, modes = np.linalg.svd(shapes - mean, full_matrices=False)
        kept = max(1, min(len(shapes) - 1, len(stretch)))
        variance = stretch[:kept] ** 2 / max(1, len(shapes) - 1)
        modes = modes[:kept].T
        # The sign of an eigenvector is arbitrary: make its largest component positive.
        largest = np.abs(modes).argmax(axis=0)
        signs = np.where(modes[largest, np.arange(kept)] < 0.0, -1.0, 1.0)
        return cls(mean, modes * signs, variance)

    @property
    def energy(self) -> FloatArray:
        """Fraction of the variance in each mode, sum 1, shape (modes,); 0 without variance."""
        total = float(self.variance.sum())
        return self.variance / total if total > 0.0 else np.zeros_like(self.variance)

    def modes_for(self, energy: float) -> int:
        """Return the least number of modes, at least 1, that hold a fraction of the variance."""
        held = np.cumsum(self.energy)
        if held[-1] == 0.0:
            return 1
        # Rounding: a fraction of 1 must be met by all modes.
        return min(int(np.searchsorted(held, energy - 1e-12)) + 1, len(held))

    def part(self, index: NDArray[np.int64]) -> PointDistribution:
        """Return the model of some components of the shapes, in float32."""
        mean, modes = self.mean[index].astype(np.float32), self.modes[index].astype(np.float32)
        return PointDistribution(mean, modes, self.variance)

    def deformation(self, shapes: FloatArray) -> FloatArray:
        """Return the coefficients b of shapes, shape (shapes, modes)."""
        return np.asarray((shapes - self.mean) @ self.modes)

    def shapes(self, deformation: FloatArray) -> FloatArray:
        """Return the shapes of coefficients of the first modes, shape (shapes, size).

        Args:
            deformation: Coefficients, shape (shapes, any number of modes).
        """
        modes = self.modes[:, : deformation.shape[-1]]
        return np.asarray(self.mean + deformation.astype(modes.dtype, copy=False) @ modes.T)

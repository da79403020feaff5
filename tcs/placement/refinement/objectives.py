"""What a refinement compares sets by: their score, and samples of their success under error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.placement.refinement.points import PointScores

TIE = 1e-3
"""Weight of P_R + P_M beside the success: decides among sets of equal success, and is less than
the success of one goal in one of some hundred samples."""


class Features(NamedTuple):
    """What configurations contribute to the objective of a set: the best member counts at each."""

    reached: BoolArray
    """Shape (n, F)."""
    dexterity: NDArray[np.float32]
    """Shape (n, F)."""


@dataclass(frozen=True, eq=False)
class ScoreObjective:
    """P_R + P_M, TCS eq. (1) and (4): each goal is a feature."""

    weights: FloatArray
    """Weights of the goals, sum 1, shape (G,)."""

    def features(self, points: FloatArray, scores: PointScores) -> Features:
        """Return the goals that configurations reach, and their dexterity there."""
        return Features(scores.reached, scores.dexterity)

    def values(self, features: Features) -> FloatArray:
        """Return P_R + P_M of sets."""
        manipulability = features.dexterity.max(axis=1).astype(np.float64) @ self.weights
        return np.asarray(features.reached.any(axis=1) @ self.weights + manipulability)


class Samples(Protocol):
    """Random changes that are the same for all configurations (common random numbers)."""

    @property
    def samples(self) -> int:
        """Number of samples."""

    @property
    def order(self) -> NDArray[np.intp]:
        """Numbers of the samples, the largest changes first, shape (samples,)."""

    def hardest(self, count: int) -> Self:
        """Return the samples with the largest changes."""

    def only(self, rows: NDArray[np.intp]) -> Self:
        """Return some of the samples."""

    def reached(self, points: FloatArray) -> BoolArray:
        """Return which goals each configuration reaches in each sample, shape (n, samples, G)."""

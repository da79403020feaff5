"""What a refinement maximises: the score of a set, or its success under error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.placement.refinement.points import Points, PointScores

TIE = 1e-3
"""Weight of P_R + P_M beside the success: decides among sets of equal success, and is less than
the success of one goal in one of some hundred samples."""


class Features(NamedTuple):
    """What configurations contribute to the objective of a set.

    The objective of a set is the sum, over the features, of `Objective.reach_weights` where any
    member has the feature, and of `dexterity_weights` times the greatest dexterity of a member.
    """

    reached: BoolArray
    """Shape (n, F)."""
    dexterity: NDArray[np.float32]
    """Shape (n, F)."""


class Objective(Protocol):
    """An objective that depends on the best member at each feature."""

    @property
    def reach_weights(self) -> FloatArray:
        """Weights of the features that any member has, shape (F,)."""

    @property
    def dexterity_weights(self) -> FloatArray:
        """Weights of the greatest dexterity of a member, shape (F,)."""

    def features(self, points: Points, scores: PointScores) -> Features:
        """Return what configurations contribute, given their scores."""


def values_of(objective: Objective, features: Features) -> FloatArray:
    """Return the objective of sets, given the features of their members, shapes (n, m, F)."""
    reached = features.reached.any(axis=1) @ objective.reach_weights
    dexterity = features.dexterity.max(axis=1).astype(np.float64) @ objective.dexterity_weights
    return np.asarray(reached + dexterity)


@dataclass(frozen=True, eq=False)
class ScoreObjective:
    """P_R + P_M, TCS eq. (1) and (4): each goal is a feature."""

    weights: FloatArray
    """Weights of the goals, sum 1, shape (G,)."""

    @property
    def reach_weights(self) -> FloatArray:
        """Weights of the goals, shape (G,)."""
        return self.weights

    @property
    def dexterity_weights(self) -> FloatArray:
        """Weights of the goals, shape (G,)."""
        return self.weights

    def features(self, points: Points, scores: PointScores) -> Features:
        """Return the goals that configurations reach, and their dexterity there."""
        return Features(scores.reached, scores.dexterity)


class Samples(Protocol):
    """Random changes that are the same for all configurations (common random numbers)."""

    @property
    def samples(self) -> int:
        """Number of samples."""

    def hardest(self, count: int) -> Self:
        """Return the samples with the largest changes."""

    def reached(self, points: Points) -> BoolArray:
        """Return which goals each configuration reaches in each sample, shape (n, samples, G)."""


@dataclass(frozen=True, eq=False)
class SuccessObjective:
    """Success, the mean of P_R over samples that are the same for all configurations.

    Each goal in each sample is a feature, and each goal without error, with a weight of TIE.
    """

    weights: FloatArray
    """Weights of the goals, sum 1, shape (G,)."""
    perturbed: Samples
    """The samples."""

    @property
    def reach_weights(self) -> FloatArray:
        """Weights of the features, shape (samples * G + G,)."""
        samples = self.perturbed.samples
        return np.concatenate([np.tile(self.weights / samples, samples), TIE * self.weights])

    @property
    def dexterity_weights(self) -> FloatArray:
        """Weights of the dexterity, which counts without error only."""
        return np.concatenate(
            [np.zeros(self.perturbed.samples * self.weights.size), TIE * self.weights]
        )

    def features(self, points: Points, scores: PointScores) -> Features:
        """Return the goals that configurations reach in each sample, and without error."""
        count = len(points.values)
        # A configuration whose body is in contact, or that reaches nothing, is no choice.
        rows = np.flatnonzero(scores.reached.any(axis=1))
        under_error = np.zeros((count, self.perturbed.samples, self.weights.size), dtype=np.bool_)
        under_error[rows] = self.perturbed.reached(Points(points.values[rows], points.arm[rows]))
        flat = under_error.reshape(count, -1)
        dexterity = np.zeros(flat.shape, dtype=np.float32)
        return Features(
            np.concatenate([flat, scores.reached], axis=1),
            np.concatenate([dexterity, scores.dexterity], axis=1),
        )

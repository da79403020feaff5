"""What a refinement maximises: the score of a set, or its success under error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.placement.refinement.displaced import DisplacedBases
from tcs.placement.refinement.points import PointScores
from tcs.placement.tables import Points

TIE = 1e-3
"""Weight of P_R + P_M beside the success: decides among sets of equal success, and is less than
the success of one goal in one of some hundred samples."""
TOC_REACHABILITY, TOC_TOGETHER = 10.0, 0.95
"""Weight of P_R in TOC, and factor of the manipulability of more than one configuration."""
BEFORE_RADIUS = 10.0
"""Weight of P_R beside the radius of the ball [m]: no radius outweighs a goal."""


class Features(NamedTuple):
    """What configurations contribute to the objective of a set: the best member counts at each."""

    reached: BoolArray
    """Shape (n, F)."""
    dexterity: NDArray[np.float32]
    """Shape (n, F)."""


class Objective(Protocol):
    """An objective that depends on the best member at each feature."""

    def features(self, points: Points, scores: PointScores) -> Features:
        """Return what configurations contribute, given their scores."""

    def values(self, features: Features) -> FloatArray:
        """Return the objective of sets, given the features of their members, shapes (n, m, F)."""


@dataclass(frozen=True, eq=False)
class ScoreObjective:
    """P_R + P_M, TCS eq. (1) and (4): each goal is a feature."""

    weights: FloatArray
    """Weights of the goals, sum 1, shape (G,)."""

    def features(self, points: Points, scores: PointScores) -> Features:
        """Return the goals that configurations reach, and their dexterity there."""
        return Features(scores.reached, scores.dexterity)

    def values(self, features: Features) -> FloatArray:
        """Return P_R + P_M of sets."""
        return _score(features.reached, features.dexterity, self.weights)


@dataclass(frozen=True, eq=False)
class TocObjective(ScoreObjective):
    """10 P_R + P_M, the latter times 0.95 for a set of more than one: 10 less the cost of TOC.

    Source:
        A. Kapusta, C. C. Kemp, "Task-centric optimization of configurations for assistive robots",
        Autonomous Robots 43, 2019 (TOC); the constants as in hrl_base_selection in
        gt-ros-pkg/hrl-assistive (BSD), last published state.
    """

    def values(self, features: Features) -> FloatArray:
        """Return 10 P_R + P_M of sets, with the factor of TOC."""
        together = _score(features.reached, features.dexterity, self.weights)
        reachability = features.reached.any(axis=1) @ self.weights
        factor = TOC_TOGETHER if features.reached.shape[1] > 1 else 1.0
        manipulability = together - reachability
        return np.asarray(TOC_REACHABILITY * reachability + factor * manipulability)


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

    def reached(self, points: Points) -> BoolArray:
        """Return which goals each configuration reaches in each sample, shape (n, samples, G)."""


@dataclass(frozen=True, eq=False)
class BallObjective:
    """Radius of the largest ball of displacements of the bases in which no goal is lost.

    Each member may be displaced by itself: a goal is kept as far as the member is that keeps it
    longest. A set that reaches more goals comes first; among equals, P_M decides. Each goal is a
    feature with the radius in place of the dexterity, and another one with the dexterity.
    """

    weights: FloatArray
    """Weights of the goals, sum 1, shape (G,)."""
    displaced: DisplacedBases
    """Displacements in a ball."""

    def features(self, points: Points, scores: PointScores) -> Features:
        """Return the radii at which configurations lose each goal, and their dexterity there."""
        radii = np.zeros(scores.dexterity.shape, dtype=np.float32)
        rows = np.flatnonzero(scores.reached.any(axis=1))
        if rows.size:
            radii[rows] = self.displaced.radii(Points(points.values[rows], points.arm[rows]))
        radii[~scores.reached] = 0.0
        return Features(
            np.concatenate([scores.reached, scores.reached], axis=1),
            np.concatenate([radii, scores.dexterity], axis=1),
        )

    def values(self, features: Features) -> FloatArray:
        """Return the objective of sets."""
        goals = self.weights.size
        reached = features.reached[..., :goals].any(axis=1)
        manipulability = features.dexterity[..., goals:].max(axis=1) @ self.weights
        value = BEFORE_RADIUS * (reached @ self.weights) + TIE * manipulability
        return np.asarray(value + self.radius(features))

    def radius(self, features: Features) -> FloatArray:
        """Return the radius of the ball of sets [m], 0 where nothing is reached, shape (n,)."""
        goals = self.weights.size
        reached = features.reached[..., :goals].any(axis=1)
        kept = np.where(reached, features.dexterity[..., :goals].max(axis=1), np.inf)
        radius = kept.min(axis=1)
        return np.asarray(np.where(np.isfinite(radius), radius, 0.0), dtype=np.float64)


def _score(reached: BoolArray, dexterity: NDArray[np.float32], weights: FloatArray) -> FloatArray:
    """Return P_R + P_M of sets, given what their members reach, shapes (n, m, G)."""
    manipulability = dexterity.max(axis=1).astype(np.float64) @ weights
    return np.asarray(reached.any(axis=1) @ weights + manipulability)

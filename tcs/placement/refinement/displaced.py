"""Goals that configurations reach with the base displaced: a robot does not park exactly."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.model.grid import ROBOT_AXES
from tcs.placement.refinement.points import PointScorer
from tcs.placement.tables import Points

RADIUS = 0.05
"""Greatest displacement of the base on the floor [m]."""
ANGLE = math.radians(5.0)
"""Greatest rotation of the base about its place [rad]."""
BALL = 0.1
"""Radius of the ball of displacements [m]: robots park more exactly."""
LEVER = RADIUS / ANGLE
"""Distance [m] that a radian of heading counts as in the ball: at this distance from the base, the
rotation moves the arm as far."""


@dataclass(frozen=True, eq=False)
class DisplacedBases:
    """The same displacements of the base for every configuration."""

    scorer: PointScorer
    offsets: FloatArray
    """Displacements along x and y [m] and of the heading [rad], shape (samples, 3)."""

    @classmethod
    def drawn(cls, scorer: PointScorer, samples: int, rng: np.random.Generator) -> Self:
        """Return displacements that are uniform in a disc and in an interval of headings."""
        distance = RADIUS * np.sqrt(rng.uniform(size=samples))
        direction = rng.uniform(-np.pi, np.pi, samples)
        turn = rng.uniform(-ANGLE, ANGLE, samples)
        offsets = [distance * np.cos(direction), distance * np.sin(direction), turn]
        return cls(scorer, np.stack(offsets, axis=1))

    @classmethod
    def in_ball(cls, scorer: PointScorer, samples: int, rng: np.random.Generator) -> Self:
        """Return displacements that are uniform in the ball, the nearest first."""
        direction = rng.standard_normal((samples, 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        size = np.sort(BALL * rng.uniform(size=samples) ** (1.0 / 3.0))
        return cls(scorer, direction * size[:, None] / [1.0, 1.0, LEVER])

    @property
    def sizes(self) -> FloatArray:
        """Distance of each displacement from none [m], shape (samples,)."""
        return np.asarray(np.linalg.norm(self.offsets * [1.0, 1.0, LEVER], axis=1))

    def radii(self, points: Points) -> FloatArray:
        """Return the size of the nearest displacement at which each configuration loses a goal.

        Returns:
            Sizes [m], shape (n, G), BALL where it loses the goal in no sample.
        """
        sizes = np.where(self.reached(points), BALL, self.sizes[:, None])
        return np.asarray(sizes.min(axis=1))

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.offsets)

    def hardest(self, count: int) -> Self:
        """Return the samples with the largest displacements."""
        return self.only(np.sort(self.order[:count]))

    @property
    def order(self) -> NDArray[np.intp]:
        """Numbers of the samples, the largest displacements first, shape (samples,)."""
        size = np.sum((self.offsets / [RADIUS, RADIUS, ANGLE]) ** 2, axis=1)
        return np.argsort(-size, kind="stable")

    def only(self, rows: NDArray[np.intp]) -> Self:
        """Return some of the samples."""
        return dataclasses.replace(self, offsets=self.offsets[rows])

    def reached(self, points: Points) -> BoolArray:
        """Return which goals each configuration reaches in each sample, shape (n, samples, G)."""
        count, axes = points.values.shape
        first = axes - len(ROBOT_AXES)
        values = np.repeat(points.values[:, None], self.samples, axis=1)
        values[:, :, first : first + 3] += self.offsets
        flat = Points(values.reshape(-1, axes), np.repeat(points.arm, self.samples))
        return self.scorer.score(flat).reached.reshape(count, self.samples, -1)

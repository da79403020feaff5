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

RADIUS = 0.05
"""Greatest displacement of the base on the floor [m]."""
ANGLE = math.radians(5.0)
"""Greatest rotation of the base about its place [rad]."""


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

    def reached(self, points: FloatArray) -> BoolArray:
        """Return which goals each configuration reaches in each sample, shape (n, samples, G)."""
        count, axes = points.shape
        first = axes - len(ROBOT_AXES)
        values = np.repeat(points[:, None], self.samples, axis=1)
        values[:, :, first : first + 3] += self.offsets
        return self.scorer.score(values.reshape(-1, axes)).reached.reshape(count, self.samples, -1)

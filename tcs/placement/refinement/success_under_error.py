"""Success under error: the samples of a refinement, and sets that must keep their success."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.model.grid import ROBOT_AXES
from tcs.placement.refinement.local_search import Samples, Walk
from tcs.placement.refinement.points import PointScorer
from tcs.placement.tables import tc_reachability

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


HARDEST = 8
"""One in so many samples screens sets during the search: those with the largest errors."""
SLACK = 0.005
"""Fall of the success that is allowed: less than what the samples can tell apart."""


@dataclass(frozen=True, eq=False)
class SuccessFloor:
    """Compares the success of sets with that of the best sets of the grid, in common samples."""

    samples: Samples
    """The samples."""
    weights: FloatArray
    """Weights of the goals, sum 1, shape (G,)."""
    least: FloatArray
    """Least success of a single configuration, and of a set of more, shape (2,)."""

    @classmethod
    def of(
        cls, samples: Samples, weights: FloatArray, single: FloatArray, best: FloatArray
    ) -> Self:
        """Return the floor that the best single configuration and the best set of the grid give."""
        least = successes(samples, weights, [single, best])
        return cls(samples, weights, least)

    def keeps(self, sets: Sequence[FloatArray]) -> BoolArray:
        """Return which sets are at least as sure as the best of the grid, shape (n,)."""
        found = successes(self.samples, self.weights, sets)
        size = np.array([len(points) > 1 for points in sets], dtype=np.int64)
        return np.asarray(found >= self.least[size] - SLACK)

    def keeps_of_sets(self, sets: Sequence[FloatArray]) -> BoolArray:
        """Return which sets are at least as sure as the best set of the grid, whatever their size.

        Returns:
            Shape (n,).
        """
        return np.asarray(successes(self.samples, self.weights, sets) >= self.least[1] - SLACK)


def successes(samples: Samples, weights: FloatArray, sets: Sequence[FloatArray]) -> FloatArray:
    """Return the mean of P_R of sets over samples, shape (n,)."""
    flat = np.concatenate(list(sets))
    # Sets that were drawn around one another share members.
    _, first, which = np.unique(flat, axis=0, return_index=True, return_inverse=True)
    reached = samples.reached(flat[first])
    ends = np.cumsum([len(points) for points in sets])
    members = np.split(which.ravel(), ends[:-1])
    return np.array(
        [tc_reachability(np.logical_or.reduce(reached[of]), weights).mean() for of in members]
    )


@dataclass(frozen=True, eq=False)
class RememberedSamples:
    """Samples that evaluate each configuration once."""

    of: Samples
    """The samples."""
    known: dict[bytes, BoolArray] = field(default_factory=dict)
    """Goals that a configuration reaches in each sample, by its values."""

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.of.samples

    @property
    def order(self) -> NDArray[np.intp]:
        """Numbers of the samples, the largest changes first, shape (samples,)."""
        return self.of.order

    def hardest(self, count: int) -> Self:
        """Return the samples with the largest changes."""
        return type(self)(self.of.hardest(count))

    def only(self, rows: NDArray[np.intp]) -> Self:
        """Return some of the samples."""
        return type(self)(self.of.only(rows))

    def reached(self, points: FloatArray) -> BoolArray:
        """Return which goals each configuration reaches in each sample, shape (n, samples, G)."""
        keys = [row.tobytes() for row in points]
        missing = {key: i for i, key in enumerate(keys) if key not in self.known}
        if missing:
            rows = np.array(list(missing.values()))
            found = self.of.reached(points[rows])
            self.known.update(zip(missing, found, strict=True))
        return np.stack([self.known[key] for key in keys])


def settled(walks: Sequence[Walk], screen: SuccessFloor, judge: SuccessFloor) -> list[Walk]:
    """Return walks moved back until they keep the floor in other samples than those of the search.

    Args:
        walks: The walks.
        screen: The floor in the hardest of these samples, for all walks.
        judge: The floor in all of them, for the best walk.

    Returns:
        The walks that keep the floor, the best first. The walk that started at the best set of the
        grid is among them.
    """
    kept = sorted(_settled(walks, screen), key=_worst_last)
    judged: set[int] = set()
    while id(kept[0]) not in judged:
        first = _settled(kept[:1], judge)
        judged.update(map(id, first))
        kept = sorted([*first, *kept[1:]], key=_worst_last)
    return kept


def at_surest(walks: Sequence[Walk], samples: Samples, weights: FloatArray) -> list[Walk]:
    """Return walks moved back to the place of their course that is the surest in other samples.

    In the samples of a search the last place is always the best: a few of them are easily
    satisfied, by sets next to a loss that others show. Of equal places the last is taken.

    Args:
        walks: The walks.
        samples: Samples that the search did not see.
        weights: Weights of the goals, sum 1, shape (G,).

    Returns:
        The walks, the surest first.
    """
    courses = [[place.values for place, _ in walk.course] for walk in walks]
    found = successes(samples, weights, [points for course in courses for points in course])
    ends = np.cumsum([len(course) for course in courses])
    reached = []
    for walk, values in zip(walks, np.split(found, ends[:-1]), strict=True):
        moves = int(np.argmax(values[::-1]))
        reached.append(float(values[values.size - 1 - moves]))
        walk.move_back(moves)
    return [walks[k] for k in sorted(range(len(walks)), key=lambda k: -reached[k])]


def _worst_last(walk: Walk) -> float:
    return -walk.value


def _settled(walks: Sequence[Walk], floor: SuccessFloor) -> list[Walk]:
    """Return the walks that keep the floor somewhere, moved back to a late place where they do.

    The last place is tried, then those between one that keeps the floor and one that does not, by
    bisection: each walk takes few evaluations.
    """
    keeping = [-1] * len(walks)
    failing = [len(walk.passed) + 1 for walk in walks]
    tried = [len(walk.passed) for walk in walks]
    open_ = list(range(len(walks)))
    while open_:
        keeps = floor.keeps([walks[k].course[tried[k]][0].values for k in open_])
        for k, kept in zip(open_, keeps, strict=True):
            (keeping if kept else failing)[k] = tried[k]
            tried[k] = (keeping[k] + failing[k]) // 2
        open_ = [k for k in open_ if failing[k] - keeping[k] > 1]
    found = [k for k in range(len(walks)) if keeping[k] >= 0]
    for k in found:
        walks[k].move_back(len(walks[k].passed) - keeping[k])
    return [walks[k] for k in found]

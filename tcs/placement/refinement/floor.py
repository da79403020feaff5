"""The least success under error that a refined set keeps: that of the best set of the grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.placement.refinement.objectives import Samples
from tcs.placement.refinement.points import Points
from tcs.placement.refinement.search import Walk
from tcs.placement.tables import tc_reachability

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
    def of(cls, samples: Samples, weights: FloatArray, single: Points, best: Points) -> Self:
        """Return the floor that the best single configuration and the best set of the grid give."""
        least = successes(samples, weights, [single, best])
        return cls(samples, weights, least)

    def keeps(self, sets: Sequence[Points]) -> BoolArray:
        """Return which sets are at least as sure as the best of the grid, shape (n,)."""
        found = successes(self.samples, self.weights, sets)
        size = np.array([len(points.values) > 1 for points in sets], dtype=np.int64)
        return np.asarray(found >= self.least[size] - SLACK)


def successes(samples: Samples, weights: FloatArray, sets: Sequence[Points]) -> FloatArray:
    """Return the mean of P_R of sets over samples, shape (n,)."""
    flat = Points(
        np.concatenate([points.values for points in sets]),
        np.concatenate([points.arm for points in sets]),
    )
    # Sets that were drawn around one another share members.
    rows = np.column_stack([flat.arm, flat.values])
    _, first, which = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    reached = samples.reached(Points(flat.values[first], flat.arm[first]))
    ends = np.cumsum([len(points.values) for points in sets])
    members = np.split(which.ravel(), ends[:-1])
    return np.array(
        [tc_reachability(np.logical_or.reduce(reached[of]), weights).mean() for of in members]
    )


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
    kept = sorted((walk for walk in walks if _settles(walk, screen)), key=_worst_last)
    while not judge.keeps([kept[0].present.points])[0]:
        if not _settles(kept[0], judge):
            del kept[0]
        kept.sort(key=_worst_last)
    return kept


def _worst_last(walk: Walk) -> float:
    return -walk.value


def _settles(walk: Walk, floor: SuccessFloor) -> bool:
    """Move a walk back until it keeps the floor; return whether it does."""
    while not (keeps := bool(floor.keeps([walk.present.points])[0])) and walk.passed:
        walk.move_back()
    return keeps

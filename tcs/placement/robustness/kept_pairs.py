"""Kept pairs of a set table: enumerated in chunks, and drawn uniformly."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, TcsError
from tcs.model.random_streams import named_generator
from tcs.placement.tables import SetTable
from tcs.placement.tables.sets import DISTANCE_TOLERANCE, FRACTION_TOLERANCE

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]

CHUNK = 200_000
"""Pairs formed together: their scores need some 10 MB."""

EQUAL_REACHABILITY = 0.98
"""Sets count as equal in P_R from this fraction of the greatest P_R: hrl_base_selection in
gt-ros-pkg/hrl-assistive (BSD), state of 30 April 2015."""


@dataclass(frozen=True, eq=False)
class Pairs:
    """Kept pairs with their scores."""

    first: IntArray
    """Candidate number of the first member, shape (n,)."""
    second: IntArray
    """Candidate number of the second member, greater than the first, shape (n,)."""
    reachability: FloatArray
    """P_R, shape (n,)."""
    manipulability: FloatArray
    """P_M, shape (n,)."""

    def only(self, which: NDArray[np.bool_] | IntArray) -> Pairs:
        """Return a selection of the pairs."""
        return Pairs(
            self.first[which],
            self.second[which],
            self.reachability[which],
            self.manipulability[which],
        )

    @classmethod
    def joined(cls, parts: Iterable[Pairs]) -> Pairs:
        """Return the pairs of several parts as one."""
        parts = list(parts)
        none: IntArray = np.empty(0, np.int64)
        return cls(
            np.concatenate([none, *(part.first for part in parts)]),
            np.concatenate([none, *(part.second for part in parts)]),
            np.concatenate([np.empty(0), *(part.reachability for part in parts)]),
            np.concatenate([np.empty(0), *(part.manipulability for part in parts)]),
        )


def kept_pairs(
    sets: SetTable, *, least_reachability: float = 0.0, least_sum: float = 0.0
) -> Iterator[Pairs]:
    """Yield the kept pairs with at least these scores, in chunks.

    Args:
        sets: The table.
        least_reachability: Least P_R.
        least_sum: Least P_R + P_M.
    """
    if sets.max_members < 2:
        return
    margin = FRACTION_TOLERANCE
    pairs = sets.pairs
    groups = (pairs.reachability >= least_reachability - margin) & (
        pairs.total >= least_sum - margin
    )
    feasible = (pairs.member_reachability >= least_reachability - margin) & (
        pairs.member_total >= least_sum - margin
    )
    of_cell = [
        cell[feasible[cell]]
        for cell in np.split(sets.by_cell, sets.cell_start[1:-1].astype(np.intp))
    ]
    batch: list[tuple[IntArray, IntArray]] = []
    size = 0
    for one, other in pairs.cells[groups]:
        first = np.repeat(of_cell[one], of_cell[other].size)
        second = np.tile(of_cell[other], of_cell[one].size)
        batch.append((first, second))
        size += first.size
        if size >= CHUNK:
            yield _kept(sets, batch, least_reachability, least_sum)
            batch, size = [], 0
    if batch:
        yield _kept(sets, batch, least_reachability, least_sum)


def _kept(
    sets: SetTable,
    batch: list[tuple[IntArray, IntArray]],
    least_reachability: float,
    least_sum: float,
) -> Pairs:
    """Return the pairs of candidates in a batch that are kept and have these scores."""
    a, b = (np.concatenate(column) for column in zip(*batch, strict=True))
    first, second = np.minimum(a, b), np.maximum(a, b)
    # Within one cell each pair occurs twice, and a candidate is paired with itself.
    once = (first < second) & ((sets.cell[first] != sets.cell[second]) | (a < b))
    if sets.same_environment:
        once &= sets.state[first] == sets.state[second]
    first, second = first[once], second[once]
    reachability, manipulability = np.zeros(first.size), np.zeros(first.size)
    for g, weight in enumerate(sets.weights):
        column = sets.dexterity[:, g].astype(np.float64)
        manipulability += float(weight) * np.maximum(column[first], column[second])
        reachability += float(weight) * (sets.reached[first, g] | sets.reached[second, g])
    limits = sets.limits
    larger = np.maximum(sets.single_manipulability[first], sets.single_manipulability[second])
    kept = (
        (manipulability >= limits.manipulability)
        & (manipulability >= limits.gain * larger)
        & (reachability >= max(limits.reachability, least_reachability))
        & (reachability + manipulability >= least_sum)
    )
    return Pairs(first[kept], second[kept], reachability[kept], manipulability[kept])


def allowed_pairs(
    sets: SetTable, first: NDArray[np.integer[Any]], second: NDArray[np.integer[Any]]
) -> NDArray[np.bool_]:
    """Return which pairs of candidates keep the rules of the table's sets, shape (n, m).

    Args:
        sets: The table.
        first: Rows of the first members, shape (n,).
        second: Rows of the second members, shape (m,).
    """
    at = sets.cell_xy[sets.cell]
    distance = np.hypot(*(at[first][:, None] - at[second]).transpose(2, 0, 1))
    allowed = distance >= sets.min_distance - DISTANCE_TOLERANCE
    if sets.same_environment:
        allowed &= sets.state[first][:, None] == sets.state[second]
    return np.asarray(allowed)


def uniform_sets(
    sets: SetTable, members: int, count: int, seed: int, fraction: float = EQUAL_REACHABILITY
) -> tuple[IntArray, int]:
    """Return sets drawn uniformly from those equal in P_R to the best, and how many there are.

    Args:
        sets: The table.
        members: 1 or 2: singles with at least a fraction of the greatest P_R of a single, or kept
            pairs with at least that fraction of the greatest P_R of any set.
        count: Number of sets to draw, with replacement.
        seed: Seed of the draw.
        fraction: Fraction of the greatest P_R from which sets count as equal; with 1, sums that
            differ by rounding still do.

    Returns:
        Flat configuration indices, shape (count, members); the number of sets to draw from.

    Raises:
        SelectionError: If there is no such set.
        TcsError: If `members` is neither 1 nor 2.
    """
    if members not in (1, 2):
        raise TcsError(f"members is {members}; sets of 1 or 2 can be drawn.")
    singles = sets.single_reachability
    greatest = float(singles.max(initial=0.0))
    rng = named_generator(seed, f"sets of {members}")
    if members == 1:
        pool = np.flatnonzero(singles >= fraction * greatest - FRACTION_TOLERANCE)[:, None]
    else:
        greatest = max(greatest, float(sets.pairs.reachability.max(initial=0.0)))
        least = fraction * greatest - FRACTION_TOLERANCE
        pairs = Pairs.joined(kept_pairs(sets, least_reachability=least))
        pool = np.stack([pairs.first, pairs.second], axis=1)
    if not len(pool):
        raise SelectionError(
            f"No set of {members} has P_R of at least {fraction:g} of the greatest, so "
            "none can be drawn. Draw sets of 1, or evaluate the best set."
        )
    return sets.candidates[pool[rng.integers(len(pool), size=count)]].astype(np.int64), len(pool)

"""Find the best kept pair without going through all of them: best-first branch and bound.

Pairs are grouped by the two base cells of their members. A group's utility is
bounded from its stored score bounds and from the driving alone; groups are
opened in the order of their bounds until no unopened one can win.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.select.travel import Legs
from tcs.select.utility import UtilityWeights, utility
from tcs.select.ways import StraightWays, Ways, WaysAround
from tcs.tables import SetTable

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FIRST_PAIRS = 2_000
"""Pairs opened in the first round, of which most searches need no more; later rounds double, so
that a search which has to open many groups does not spend its time on bookkeeping."""

MOST_PAIRS = 200_000
"""Most pairs opened at once: 14 goals need some 20 MB for them."""

SLACK = 1e-12
"""Relative room for rounding in bounds that are not computed by the very operations of the
utility: a dozen roundings of 1.1e-16 each, with three digits to spare. A bound without it could
end up one bit below the utility it bounds, and lose a tie."""


@dataclass(frozen=True)
class PairIndex:
    """What the search needs of a set table, independent of the query."""

    sets: SetTable
    """The table."""

    @cached_property
    def first(self) -> IntArray:
        """First cell of each group, shape (K,)."""
        return self.sets.pair_cells[:, 0].astype(np.int64)

    @cached_property
    def second(self) -> IntArray:
        """Second cell of each group, shape (K,)."""
        return self.sets.pair_cells[:, 1].astype(np.int64)

    @cached_property
    def manipulability(self) -> FloatArray:
        """Bound on P_M of each group in double precision, shape (K,).

        Products with float32 arrays would round to float32, and might round a bound down.
        """
        return self.sets.pair_manipulability.astype(np.float64)

    @cached_property
    def total(self) -> FloatArray:
        """Bound on P_R + P_M of each group in double precision, shape (K,)."""
        return self.sets.pair_sum.astype(np.float64)

    @cached_property
    def ways(self) -> dict[str, Ways]:
        """Distances between the cells by each of the routes."""
        xy, groups = self.sets.cell_xy, self.sets.pair_cells.astype(np.int64)
        return {
            "straight": StraightWays(xy, groups),
            "around": WaysAround(xy, groups, self.sets.floor),
        }

    @cached_property
    def earliest(self) -> IntArray:
        """Least candidate number in each cell, shape (N,)."""
        return self.sets.by_cell[self.sets.cell_start[:-1]]

    @cached_property
    def isotropy(self) -> FloatArray:
        """Isotropy in double precision, one contiguous row for each goal, shape (G, C)."""
        return np.ascontiguousarray(self.sets.isotropy.T, dtype=np.float64)

    @cached_property
    def reached(self) -> NDArray[np.bool_]:
        """Whether a goal is reached, one contiguous row for each goal, shape (G, C)."""
        return np.ascontiguousarray(self.sets.reached.T)

    @cached_property
    def pairs_within(self) -> IntArray:
        """How many pairs of candidates there are to open in each group, shape (K,)."""
        size = np.diff(self.sets.cell_start)
        return np.asarray(size[self.first] * size[self.second])


@dataclass(frozen=True, slots=True)
class Found:
    """A pair and its utility."""

    utility: float
    a: int
    """Candidate number of the first member."""
    b: int
    """Candidate number of the second, greater than a."""

    def beats(self, other: Found | None) -> bool:
        """Return whether this pair is to be chosen over another: utility, then order."""
        if other is None or self.utility != other.utility:
            return other is None or self.utility > other.utility
        return (self.a, self.b) < (other.a, other.b)


def best_pair(
    index: PairIndex, legs: Legs, weights: UtilityWeights, to_beat: float
) -> Found | None:
    """Return the kept pair with the greatest utility, the first among equals.

    Args:
        index: The sets.
        legs: Travel costs from the current state.
        weights: alpha, beta, gamma.
        to_beat: Utility of the best single; a pair has to be better, not as good.

    Returns:
        The pair, or None when no pair is better than `to_beat`.
    """
    bounds = _bounds(index, legs, weights)
    left = np.flatnonzero(bounds > to_beat)
    best: Found | None = None
    budget = FIRST_PAIRS
    while left.size:
        now, left = _split(index, bounds, left, budget)
        found = _best_within(index, legs, weights, now)
        if found is not None and found.utility > to_beat and found.beats(best):
            best = found
        left = _still_able_to_win(index, bounds, left, best)
        budget = min(2 * budget, MOST_PAIRS)
    return best


def _bounds(index: PairIndex, legs: Legs, weights: UtilityWeights) -> FloatArray:
    """Return an upper bound on the utility in each group, shape (K,); -inf out of reach."""
    alpha, beta = float(weights.reachability), float(weights.manipulability)
    reachability, manipulability = index.sets.pair_reachability, index.manipulability
    # The best reachability and the best manipulability may belong to two different pairs.
    gain = alpha * reachability + beta * manipulability
    # alpha P_R + beta P_M = (alpha - beta) P_R + beta (P_R + P_M), or with the roles swapped.
    if alpha >= beta:
        together = (alpha - beta) * reachability + beta * index.total
    else:
        together = alpha * index.total + (beta - alpha) * manipulability
    together += SLACK * (alpha + beta)
    np.minimum(gain, together, out=gain)
    if weights.travel > 0.0:
        gain -= float(weights.travel) * _least_costs(index, legs)
    if not np.all(legs.reachable):
        gain[~(legs.reachable[index.first] & legs.reachable[index.second])] = -np.inf
    return gain


def _least_costs(index: PairIndex, legs: Legs) -> FloatArray:
    """Return a lower bound on the travel cost D in each group, shape (K,)."""
    approach = np.minimum(legs.here_to_cell[index.first], legs.here_to_cell[index.second])
    cost = approach + legs.metre * legs.ways.of_groups
    if legs.level_weights:
        # Turning, lifting and moving the bed obey the triangle inequality: a tour pays at least
        # the direct change to whichever member differs most from the current state.
        direct = np.minimum.reduceat(
            legs.levels_from_here[index.sets.by_cell], index.sets.cell_start[:-1]
        )
        farther = np.maximum(direct[index.first], direct[index.second])
        # Wrapping an angle leaves an absolute rounding error of some 1e-15 rad.
        wrapping = SLACK * sum(legs.level_weights)
        np.maximum(cost, (cost + farther) * (1.0 - SLACK) - wrapping, out=cost)
    return cost


def _split(
    index: PairIndex, bounds: FloatArray, left: IntArray, budget: int
) -> tuple[IntArray, IntArray]:
    """Return the groups to open now, those with the greatest bounds, and the others."""
    # A group holds at least one pair, so the groups of a budget are never more than the budget.
    if left.size > budget:
        order = np.argpartition(-bounds[left], budget)
        front, rest = left[order[:budget]], left[order[budget:]]
    else:
        front, rest = left, left[:0]
    # Among equal bounds, open first what comes first in the order: all others can then be left.
    a, b = _earliest_pair(index, front)
    front = front[np.lexsort((b, a, -bounds[front]))]
    opened = max(1, int(np.searchsorted(np.cumsum(index.pairs_within[front]), budget, "right")))
    return front[:opened], np.concatenate([front[opened:], rest])


def _still_able_to_win(
    index: PairIndex, bounds: FloatArray, left: IntArray, best: Found | None
) -> IntArray:
    """Return the groups that may hold a better pair, or an equal one earlier in the order."""
    if best is None:
        return left
    bound = bounds[left]
    able = bound > best.utility
    equal = np.flatnonzero(bound == best.utility)
    a, b = _earliest_pair(index, left[equal])
    able[equal] = (a < best.a) | ((a == best.a) & (b < best.b))
    return np.asarray(left[able])


def _earliest_pair(index: PairIndex, groups: IntArray) -> tuple[IntArray, IntArray]:
    """Return, for each group, candidate numbers a < b that none of its pairs comes before."""
    first, second = index.earliest[index.first[groups]], index.earliest[index.second[groups]]
    return np.minimum(first, second), np.maximum(first, second)


def _best_within(
    index: PairIndex, legs: Legs, weights: UtilityWeights, groups: IntArray
) -> Found | None:
    """Return the best kept pair of some groups, the first among equals."""
    a, b = _members(index, groups)
    goal_weights = index.sets.weights
    manipulability = np.zeros(a.size)
    for row, weight in zip(index.isotropy, goal_weights, strict=True):
        manipulability += float(weight) * np.maximum(row[a], row[b])
    limits = index.sets.limits
    kept = manipulability >= limits.manipulability
    if limits.gain > 0.0:
        single = index.sets.single_manipulability
        kept &= manipulability >= limits.gain * np.maximum(single[a], single[b])
    if index.sets.same_environment:
        kept &= index.sets.state[a] == index.sets.state[b]
    a, b, manipulability = a[kept], b[kept], manipulability[kept]
    reachability = np.zeros(a.size)
    for reached, weight in zip(index.reached, goal_weights, strict=True):
        reachability += float(weight) * (reached[a] | reached[b])
    if limits.reachability > 0.0:
        kept = reachability >= limits.reachability
        a, b = a[kept], b[kept]
        reachability, manipulability = reachability[kept], manipulability[kept]
    if not a.size:
        return None
    cost = np.minimum(legs.from_here[a], legs.from_here[b]) + legs.between(a, b)
    utilities = utility(reachability, manipulability, cost, weights)
    best = utilities.max()
    ties = np.flatnonzero(utilities == best)
    first = ties[np.lexsort((b[ties], a[ties]))[0]]
    return Found(float(best), int(a[first]), int(b[first]))


def _members(index: PairIndex, groups: IntArray) -> tuple[IntArray, IntArray]:
    """Return the candidate numbers a < b of every pair of some groups, shapes (n,)."""
    start, size = index.sets.cell_start[:-1], np.diff(index.sets.cell_start)
    first, second = index.first[groups], index.second[groups]
    count = size[first] * size[second]
    group = np.repeat(np.arange(groups.size), count)
    within = np.arange(group.size) - np.repeat(np.cumsum(count) - count, count)
    i, j = np.divmod(within, size[second][group])
    p = index.sets.by_cell[start[first][group] + i]
    q = index.sets.by_cell[start[second][group] + j]
    if np.any(first == second):
        # Within one cell each pair comes up twice, and each candidate meets itself.
        once = (p < q) | (first != second)[group]
        p, q = p[once], q[once]
    return np.minimum(p, q), np.maximum(p, q)

"""Find the best kept pair without going through all of them: best-first branch and bound.

Pairs are grouped by the two base cells of their members. Groups are opened in the order of their
bounds until no unopened one can win. In an opened group, members that cannot win with any partner
are left out, then pairs whose way is too long; the scores of the others are computed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.select.bounds import Bounds
from tcs.select.index import PairIndex
from tcs.select.travel import Legs
from tcs.select.utility import UtilityWeights, utility

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FIRST_PAIRS = 2_000
"""Pairs opened in the first round, of which most searches need no more; later rounds double, so
that a search which has to open many groups does not spend its time on bookkeeping."""

MOST_PAIRS = 500_000
"""Most pairs opened at once. Nearly all of them are left out before they take memory; 14 goals
would need some 50 MB for them."""


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
    bounds = Bounds(index, legs, weights)
    left = np.flatnonzero(bounds.groups > to_beat)
    best: Found | None = None
    budget = FIRST_PAIRS
    while left.size:
        now, left = _split(bounds, left, budget)
        found = _best_within(bounds, now, to_beat if best is None else best.utility)
        if found is not None and found.utility > to_beat and found.beats(best):
            best = found
        left = _still_able_to_win(bounds, left, best)
        budget = min(2 * budget, MOST_PAIRS)
    return best


def _split(bounds: Bounds, left: IntArray, budget: int) -> tuple[IntArray, IntArray]:
    """Return the groups to open now, those with the greatest bounds, and the others."""
    # A group holds at least one pair, so the groups of a budget are never more than the budget.
    if left.size > budget:
        order = np.argpartition(-bounds.groups[left], budget)
        front, rest = left[order[:budget]], left[order[budget:]]
    else:
        front, rest = left, left[:0]
    # Among equal bounds, open first what comes first in the order: all others can then be left.
    a, b = _earliest_pair(bounds.index, front)
    front = front[np.lexsort((b, a, -bounds.groups[front]))]
    opened = max(
        1, int(np.searchsorted(np.cumsum(bounds.index.pairs_within[front]), budget, "right"))
    )
    return front[:opened], np.concatenate([front[opened:], rest])


def _still_able_to_win(bounds: Bounds, left: IntArray, best: Found | None) -> IntArray:
    """Return the groups that may hold a better pair, or an equal one earlier in the order."""
    if best is None:
        return left
    bound = bounds.groups[left]
    able = bound > best.utility
    equal = np.flatnonzero(bound == best.utility)
    a, b = _earliest_pair(bounds.index, left[equal])
    able[equal] = (a < best.a) | ((a == best.a) & (b < best.b))
    return np.asarray(left[able])


def _earliest_pair(index: PairIndex, groups: IntArray) -> tuple[IntArray, IntArray]:
    """Return, for each group, candidate numbers a < b that none of its pairs comes before."""
    first, second = index.earliest[index.first[groups]], index.earliest[index.second[groups]]
    return np.minimum(first, second), np.maximum(first, second)


def _best_within(bounds: Bounds, groups: IntArray, least: float) -> Found | None:
    """Return the best kept pair of some groups with at least this utility, the first of equals."""
    index, legs = bounds.index, bounds.legs
    a, b, group = _pairs_able_to_win(bounds, groups, least)
    cost = np.minimum(legs.from_here[a], legs.from_here[b]) + legs.between(a, b)
    # The way is known now; scores take longer, and few pairs can make up for theirs.
    able = np.flatnonzero(bounds.of_pair(group, a, b, cost) >= least)
    a, b, cost = a[able], b[able], cost[able]
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
    a, b, cost, manipulability = a[kept], b[kept], cost[kept], manipulability[kept]
    reachability = np.zeros(a.size)
    for reached, weight in zip(index.reached, goal_weights, strict=True):
        reachability += float(weight) * (reached[a] | reached[b])
    if limits.reachability > 0.0:
        kept = reachability >= limits.reachability
        a, b, cost = a[kept], b[kept], cost[kept]
        reachability, manipulability = reachability[kept], manipulability[kept]
    if not a.size:
        return None
    utilities = utility(reachability, manipulability, cost, bounds.weights)
    best = utilities.max()
    ties = np.flatnonzero(utilities == best)
    first = ties[np.lexsort((b[ties], a[ties]))[0]]
    return Found(float(best), int(a[first]), int(b[first]))


def _pairs_able_to_win(
    bounds: Bounds, groups: IntArray, least: float
) -> tuple[IntArray, IntArray, IntArray]:
    """Return numbers a < b and group of the pairs of able members of some groups, shapes (n,)."""
    index = bounds.index
    p, p_start, p_count = _members_able_to_win(bounds, groups, index.first[groups], least)
    q, q_start, q_count = _members_able_to_win(bounds, groups, index.second[groups], least)
    count = p_count * q_count
    group = np.repeat(np.arange(groups.size), count)
    within = np.arange(group.size) - np.repeat(np.cumsum(count) - count, count)
    i, j = np.divmod(within, q_count[group])
    a, b = p[p_start[group] + i], q[q_start[group] + j]
    group = groups[group]
    same = index.first[group] == index.second[group]
    if np.any(same):
        # Within one cell each pair comes up twice, and each candidate meets itself.
        once = (a < b) | ~same
        a, b, group = a[once], b[once], group[once]
    return np.minimum(a, b), np.maximum(a, b), group


def _members_able_to_win(
    bounds: Bounds, groups: IntArray, cells: IntArray, least: float
) -> tuple[IntArray, IntArray, IntArray]:
    """Return candidates of one cell of each group that may be in a pair with this utility.

    Returns:
        Their numbers, group by group; where each group starts among them; how many it has.
    """
    index = bounds.index
    size = index.size[cells]
    which = np.repeat(np.arange(groups.size), size)
    within = np.arange(which.size) - np.repeat(np.cumsum(size) - size, size)
    member = index.sets.by_cell[index.start[cells][which] + within]
    able = bounds.of_member(groups[which], member) >= least
    count = np.bincount(which[able], minlength=groups.size)
    return member[able], np.cumsum(count) - count, count

"""Find the best kept set without going through all of them: best-first branch and bound.

Sets of two or three are grouped by the base cells of their members. Groups are opened in the order
of their bounds until no unopened one can win. In an opened group, members that cannot win with any
partners are left out, then sets whose way is too long; the scores of the others are computed.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.placement.selection.bounds import Bounds
from tcs.placement.selection.index import GroupIndex
from tcs.placement.selection.travel import Legs
from tcs.placement.selection.utility import UtilityWeights, utility

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FIRST_CANDIDATES = 200
"""Candidates looked at in the first round, of which most searches need no more; later rounds
double, so that a search which has to open many groups does not spend its time on bookkeeping."""

MOST_CANDIDATES = 100_000
"""Most candidates looked at in one round: a few milliseconds."""

AT_ONCE = 500_000
"""Sets, or parts of them, formed at once: their scores need some 30 MB."""


@dataclass(frozen=True, slots=True)
class Found:
    """A set and its utility."""

    utility: float
    members: tuple[int, ...]
    """Candidate numbers of the members, ascending."""

    def beats(self, other: Found | None) -> bool:
        """Return whether this set is to be chosen over another: utility, then order."""
        if other is None or self.utility != other.utility:
            return other is None or self.utility > other.utility
        return self.members < other.members


def best_set(
    index: GroupIndex, legs: Legs, weights: UtilityWeights, to_beat: float
) -> Found | None:
    """Return the kept set with the greatest utility, the first among equals.

    Args:
        index: The groups of sets.
        legs: Travel costs from the current state.
        weights: alpha, beta, gamma.
        to_beat: Utility of the best smaller set; a set has to be better, not as good.

    Returns:
        The set, or None when no set is better than `to_beat`.
    """
    bounds = Bounds(index, legs, weights)
    left = np.flatnonzero(bounds.groups > to_beat)
    search = _Search(bounds, to_beat)
    budget = FIRST_CANDIDATES
    while left.size:
        now, left = _split(bounds, left, budget)
        search.open(now)
        left = _still_able_to_win(bounds, left, search.best)
        budget = min(2 * budget, MOST_CANDIDATES)
    return search.best


@dataclass
class _Search:
    """The best set found so far."""

    bounds: Bounds
    to_beat: float
    best: Found | None = None

    @property
    def least(self) -> float:
        """The utility that a set must have to be looked at."""
        return self.to_beat if self.best is None else self.best.utility

    def open(self, groups: IntArray) -> None:
        """Look at the sets of some groups."""
        able = [
            _members_able_to_win(self.bounds, groups, cells[groups], self.least)
            for cells in self.bounds.index.cells
        ]
        which = np.repeat(np.arange(groups.size), able[0].size)
        self._join(groups, which, (able[0].numbers,), able[1:])

    def _join(
        self,
        groups: IntArray,
        which: IntArray,
        members: tuple[IntArray, ...],
        able: list[_Able],
    ) -> None:
        """Add the remaining members to parts of sets, and note the best of the whole sets.

        Args:
            groups: The groups.
            which: Position among them of each part, shape (n,).
            members: First members of each part, from the first cells of its group, shapes (n,).
            able: Able members of the cells that remain.
        """
        if not able:
            ascending = tuple(np.sort(members, axis=0))
            found = _best_of(self.bounds, ascending, groups[which], self.least)
            if found is not None and found.utility > self.to_beat and found.beats(self.best):
                self.best = found
            return
        count = able[0].size[which]
        some = np.flatnonzero(count)
        while some.size:
            # At least one part, and as many as do not make too many at once.
            end = max(1, int(np.searchsorted(np.cumsum(count[some]), AT_ONCE, "right")))
            now, some = some[:end], some[end:]
            part = np.repeat(now, count[now])
            within = np.arange(part.size) - np.repeat(
                np.cumsum(count[now]) - count[now], count[now]
            )
            last = able[0].numbers[able[0].start[which[part]] + within]
            self._keep_on(groups, which[part], (*(m[part] for m in members), last), able[1:])

    def _keep_on(
        self,
        groups: IntArray,
        which: IntArray,
        members: tuple[IntArray, ...],
        able: list[_Able],
    ) -> None:
        """Leave out parts of sets that cannot win or come up twice, and go on with the others."""
        one, other = self.bounds.index.cells[len(members) - 2 : len(members)]
        group = groups[which]
        # Within one cell each set comes up several times, and a candidate meets itself.
        keep = (one[group] != other[group]) | (members[-2] < members[-1])
        if able and self.bounds.legs.level_weights:
            keep &= self.bounds.of_two(group, members[-2], members[-1]) >= self.least
        if not np.all(keep):
            which, members = which[keep], tuple(member[keep] for member in members)
        self._join(groups, which, members, able)


def _split(bounds: Bounds, left: IntArray, budget: int) -> tuple[IntArray, IntArray]:
    """Return the groups to open now, those with the greatest bounds, and the others."""
    # A group has at least two candidates, so there are never more groups than the budget.
    if left.size > budget:
        order = np.argpartition(-bounds.groups[left], budget)
        front, rest = left[order[:budget]], left[order[budget:]]
    else:
        front, rest = left, left[:0]
    # Among equal bounds, open first what comes first in the order: all others can then be left.
    earliest = _earliest(bounds.index, front)
    front = front[np.lexsort((*reversed(earliest), -bounds.groups[front]))]
    looked_at = np.cumsum(bounds.index.candidates_within[front])
    opened = max(1, int(np.searchsorted(looked_at, budget, "right")))
    return front[:opened], np.concatenate([front[opened:], rest])


def _still_able_to_win(bounds: Bounds, left: IntArray, best: Found | None) -> IntArray:
    """Return the groups that may hold a better set, or an equal one earlier in the order."""
    if best is None:
        return left
    bound = bounds.groups[left]
    able = bound > best.utility
    equal = np.flatnonzero(bound == best.utility)
    earlier = np.zeros(equal.size, dtype=np.bool_)
    tied = np.ones(equal.size, dtype=np.bool_)
    for number, of_best in zip(_earliest(bounds.index, left[equal]), best.members, strict=True):
        earlier |= tied & (number < of_best)
        tied &= number == of_best
    able[equal] = earlier
    return np.asarray(left[able])


def _earliest(index: GroupIndex, groups: IntArray) -> tuple[IntArray, ...]:
    """Return, for each group, ascending candidate numbers that none of its sets comes before."""
    return tuple(np.sort([index.all.earliest[cells[groups]] for cells in index.cells], axis=0))


def _best_of(
    bounds: Bounds, members: tuple[IntArray, ...], group: IntArray, least: float
) -> Found | None:
    """Return the best kept of some sets with at least this utility, the first of equals."""
    cost = tour_costs(bounds.legs, members)
    # The way is known now; scores take longer, and few sets can make up for theirs.
    able = np.flatnonzero(bounds.of_set(group, members, cost) >= least)
    members, cost = tuple(member[able] for member in members), cost[able]
    every, sets = bounds.index.all, bounds.index.all.sets
    manipulability = np.zeros(cost.size)
    for dexterity, weight in zip(every.dexterity, sets.weights, strict=True):
        most = dexterity[members[0]]
        for member in members[1:]:
            most = np.maximum(most, dexterity[member])
        manipulability += float(weight) * most
    reachability = np.zeros(cost.size)
    for reached, weight in zip(every.reached, sets.weights, strict=True):
        some = reached[members[0]]
        for member in members[1:]:
            some = some | reached[member]
        reachability += float(weight) * some
    kept = np.flatnonzero(_is_kept(bounds.index, members, reachability, manipulability))
    if not kept.size:
        return None
    members = tuple(member[kept] for member in members)
    utilities = utility(reachability[kept], manipulability[kept], cost[kept], bounds.weights)
    best = utilities.max()
    ties = np.flatnonzero(utilities == best)
    first = ties[np.lexsort(tuple(member[ties] for member in reversed(members)))[0]]
    return Found(float(best), tuple(int(member[first]) for member in members))


def _is_kept(
    index: GroupIndex,
    members: tuple[IntArray, ...],
    reachability: FloatArray,
    manipulability: FloatArray,
) -> NDArray[np.bool_]:
    """Return whether sets with these scores are kept by the rule, shape (n,)."""
    sets = index.all.sets
    kept = manipulability >= index.groups.least
    if index.members == 2:
        larger = np.maximum(*(sets.single_manipulability[member] for member in members))
        kept &= manipulability >= sets.limits.gain * larger
        kept &= reachability >= sets.limits.reachability
    if sets.same_environment:
        for member in members[1:]:
            kept &= sets.state[member] == sets.state[members[0]]
    return kept


def tour_costs(legs: Legs, members: tuple[IntArray, ...]) -> FloatArray:
    """Return the cost D of the shortest open tour from here through each set, shape (n,).

    Legs are added in the order they are driven, as `tcs.placement.selection.shortest_tour` does.
    """
    numbers = range(len(members))
    between = {
        frozenset((i, j)): legs.between(members[i], members[j])
        for i, j in itertools.combinations(numbers, 2)
    }
    least: FloatArray | None = None
    for order in itertools.permutations(numbers):
        cost = legs.from_here[members[order[0]]]
        for i, j in itertools.pairwise(order):
            cost = cost + between[frozenset((i, j))]
        least = cost if least is None else np.minimum(least, cost)
    return np.asarray(least)


class _Able(NamedTuple):
    """Candidates of one cell of each of some groups that may be in a set that wins."""

    numbers: IntArray
    """Their numbers, group by group."""
    start: IntArray
    """Where each group starts among them."""
    size: IntArray
    """How many each group has."""


def _members_able_to_win(bounds: Bounds, groups: IntArray, cells: IntArray, least: float) -> _Able:
    """Return candidates of one cell of each group that may be in a set with this utility."""
    every = bounds.index.all
    size = every.size[cells]
    which = np.repeat(np.arange(groups.size), size)
    within = np.arange(which.size) - np.repeat(np.cumsum(size) - size, size)
    member = every.sets.by_cell[every.start[cells][which] + within]
    able = bounds.of_member(groups[which], member) >= least
    count = np.bincount(which[able], minlength=groups.size)
    return _Able(member[able], np.cumsum(count) - count, count)

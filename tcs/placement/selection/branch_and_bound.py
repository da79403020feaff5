"""Best-first branch and bound: find the best kept set without evaluating all of them.

Sets of two or three are grouped by the base cells of their members. Groups are opened in the order
of their bounds until no unopened group can hold a better set. In an open group, infeasible members
(those whose bound with any partners is too low) are discarded, then sets whose path is too long;
the scores of the others are computed.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.placement.selection.bounds import Bounds
from tcs.placement.selection.index import GroupIndex
from tcs.placement.selection.travel import Legs
from tcs.placement.selection.utility import utility

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FIRST_CANDIDATES = 200
"""Candidates examined in the first round, which is enough for most searches; later rounds triple,
so that a search that opens many groups does not spend its time on bookkeeping."""

MOST_CANDIDATES = 100_000
"""Most candidates examined in one round: a few milliseconds."""

FIRST_CELLS = 4
"""Base cells whose groups are examined first, those with the greatest bounds."""

MOST_CELLS = 0.25
"""Fraction of the cells above which their groups are not picked out, but all are examined."""

ROUNDING = 1e-9
"""Relative margin of the bounds of cells, some thousand times their rounding: it opens a few groups
more, whose own bounds are exact."""

CHUNK = 500_000
"""Sets, or parts of them, formed together: their scores need some 30 MB."""


@dataclass(frozen=True, slots=True)
class Found:
    """A set and its utility."""

    utility: float
    members: tuple[int, ...]
    """Candidate numbers of the members, ascending."""

    def beats(self, other: Found | None) -> bool:
        """Return whether this set is preferred to another: by utility, then by order."""
        if other is None or self.utility != other.utility:
            return other is None or self.utility > other.utility
        return self.members < other.members


def best_set(bounds: Bounds, to_beat: float) -> Found | None:
    """Return the kept set with the greatest utility, the first among equals.

    Args:
        bounds: Bounds on the utility of the sets.
        to_beat: Utility of the best smaller set; only a greater utility counts.

    Returns:
        The set, or None when no set is better than `to_beat`.
    """
    if bounds.lowered is not None:
        # What the constraints leave bounds the groups tighter than their cells.
        return _best_among(bounds, to_beat, None)
    # Few cells are the nearest one of a good set: the bounds of the other groups are not needed.
    of_cells = bounds.of_cells()
    most = min(FIRST_CELLS, of_cells.size)
    first = np.argpartition(-of_cells, most - 1)[:most]
    rows = bounds.index.groups_of(first)
    best = _best_among(replace(bounds, index=bounds.index.part(rows)), to_beat, None)
    least = to_beat if best is None else best.utility
    margin = ROUNDING * (1.0 + abs(least) + bounds.travel * float(bounds.legs.here_to_cell.max()))
    is_left = of_cells >= least - margin
    is_left[first] = False
    left = np.flatnonzero(is_left)
    if not left.size:
        return best
    if left.size > MOST_CELLS * of_cells.size:
        return _best_among(bounds, to_beat, best)
    rows = bounds.index.groups_of(left)
    return _best_among(replace(bounds, index=bounds.index.part(rows)), to_beat, best)


def _best_among(bounds: Bounds, to_beat: float, best: Found | None) -> Found | None:
    """Return the best set of the groups of some bounds, or the best one so far."""
    search = _Search(bounds, to_beat, best)
    search.run()
    return search.best


@dataclass
class _Search:
    """The best set found so far."""

    bounds: Bounds
    to_beat: float
    best: Found | None = None

    @property
    def least(self) -> float:
        """The utility that a set must have to be examined."""
        return self.to_beat if self.best is None else self.best.utility

    def run(self) -> None:
        """Examine the groups that may hold a better set, those with the greatest bounds first."""
        bounds, budget = self.bounds, FIRST_CANDIDATES
        remaining = _promising(bounds, np.flatnonzero(bounds.groups > self.to_beat), self.best)
        while remaining.size:
            now, remaining = _split(bounds, remaining, budget)
            self.open(now)
            remaining = _promising(bounds, remaining, self.best)
            budget = min(3 * budget, MOST_CANDIDATES)

    def record(self, utilities: FloatArray, members: tuple[IntArray, ...]) -> None:
        """Compare kept sets with the best one so far; there is at least one."""
        best = utilities.max()
        ties = np.flatnonzero(utilities == best)
        first = ties[np.lexsort(tuple(member[ties] for member in reversed(members)))[0]]
        found = Found(float(best), tuple(int(member[first]) for member in members))
        if found.utility > self.to_beat and found.beats(self.best):
            self.best = found

    def open(self, groups: IntArray) -> None:
        """Examine the sets of some groups."""
        feasible = [
            _feasible_members(self.bounds, groups, number, self.least)
            for number in range(self.bounds.index.members)
        ]
        which = np.repeat(np.arange(groups.size), feasible[0].size)
        self._join(groups, which, (feasible[0].numbers,), feasible[1:])

    def _join(
        self,
        groups: IntArray,
        which: IntArray,
        members: tuple[IntArray, ...],
        feasible: list[_Feasible],
    ) -> None:
        """Add the remaining members to parts of sets, and record the best complete set.

        Args:
            groups: The groups.
            which: Group of each part, as a position in `groups`, shape (n,).
            members: First members of each part, from the first cells of its group, shapes (n,).
            feasible: Feasible members of the remaining cells.
        """
        if not feasible:
            ascending = tuple(np.sort(members, axis=0))
            utilities, kept = _kept_sets(self.bounds, ascending, groups[which], self.least)
            if utilities.size:
                self.record(utilities, kept)
            return
        count = feasible[0].size[which]
        some = np.flatnonzero(count)
        while some.size:
            # At least one part, and as many as fit into one chunk.
            end = max(1, int(np.searchsorted(np.cumsum(count[some]), CHUNK, "right")))
            now, some = some[:end], some[end:]
            part = np.repeat(now, count[now])
            within = np.arange(part.size) - np.repeat(
                np.cumsum(count[now]) - count[now], count[now]
            )
            last = feasible[0].numbers[feasible[0].start[which[part]] + within]
            parts = (*(m[part] for m in members), last)
            self._filter(groups, which[part], parts, feasible[1:])

    def _filter(
        self,
        groups: IntArray,
        which: IntArray,
        members: tuple[IntArray, ...],
        feasible: list[_Feasible],
    ) -> None:
        """Discard parts of sets that are infeasible or duplicates, and extend the others."""
        one, other = self.bounds.index.cells[len(members) - 2 : len(members)]
        group = groups[which]
        # Within one cell each set occurs several times, and a candidate is paired with itself.
        keep = (one[group] != other[group]) | (members[-2] < members[-1])
        if feasible and self.bounds.legs.level_weights:
            keep &= self.bounds.of_two(group, members[-2], members[-1]) >= self.least
        if not np.all(keep):
            which, members = which[keep], tuple(member[keep] for member in members)
        self._join(groups, which, members, feasible)


def _split(bounds: Bounds, remaining: IntArray, budget: int) -> tuple[IntArray, IntArray]:
    """Return the groups to open now, which have the greatest bounds, and the others."""
    # A group has at least two candidates, so the budget never covers more groups than its number.
    if remaining.size > budget:
        order = np.argpartition(-bounds.groups[remaining], budget)
        front, rest = remaining[order[:budget]], remaining[order[budget:]]
    else:
        front, rest = remaining, remaining[:0]
    # Among equal bounds the first in order is opened first: the others need not be opened then.
    earliest = _earliest(bounds.index, front)
    front = front[np.lexsort((*reversed(earliest), -bounds.groups[front]))]
    examined = np.cumsum(bounds.index.candidates_within[front])
    opened = max(1, int(np.searchsorted(examined, budget, "right")))
    return front[:opened], np.concatenate([front[opened:], rest])


def _promising(bounds: Bounds, remaining: IntArray, best: Found | None) -> IntArray:
    """Return the groups that may hold a better set, or an equal one earlier in the order."""
    if best is None:
        return remaining
    bound = bounds.groups[remaining]
    promising = bound > best.utility
    equal = np.flatnonzero(bound == best.utility)
    earlier = np.zeros(equal.size, dtype=np.bool_)
    tied = np.ones(equal.size, dtype=np.bool_)
    for number, of_best in zip(
        _earliest(bounds.index, remaining[equal]), best.members, strict=True
    ):
        earlier |= tied & (number < of_best)
        tied &= number == of_best
    promising[equal] = earlier
    return np.asarray(remaining[promising])


def _earliest(index: GroupIndex, groups: IntArray) -> tuple[IntArray, ...]:
    """Return ascending candidate numbers that precede or equal every set of each group."""
    return tuple(np.sort([index.all.earliest[cells[groups]] for cells in index.cells], axis=0))


def _kept_sets(
    bounds: Bounds, members: tuple[IntArray, ...], group: IntArray, least: float
) -> tuple[FloatArray, tuple[IntArray, ...]]:
    """Return utility and members of the kept sets of at least this utility, shapes (n,)."""
    # Where travel has no weight, tours need not be summed: all costs are finite.
    cost = tour_costs(bounds.legs, members) if bounds.travel else np.zeros(members[0].size)
    # The exact travel cost rejects most sets before their scores, which take longer.
    feasible = np.flatnonzero(bounds.of_set(group, members, cost) >= least)
    members, cost = tuple(member[feasible] for member in members), cost[feasible]
    every, lowered = bounds.index.all, bounds.lowered
    of_sets = every if lowered is None else lowered
    scores = scores_of(of_sets.dexterity, of_sets.reached, every.sets.weights, members)
    utilities = utility(*scores, cost, bounds.weights)
    if bounds.penalties is not None:
        utilities = utilities - bounds.penalties.of_sets(members)
    enough = np.flatnonzero(utilities >= least)
    members, utilities = tuple(member[enough] for member in members), utilities[enough]
    scores = scores[0][enough], scores[1][enough]
    if lowered is not None:
        # Stored sets are compared, so the rule applies to their stored scores.
        scores = scores_of(every.dexterity, every.reached, every.sets.weights, members)
    kept = np.flatnonzero(_is_kept(bounds.index, members, *scores))
    members, utilities = tuple(member[kept] for member in members), utilities[kept]
    if bounds.distinct is None:
        return utilities, members
    is_distinct = bounds.distinct.of_sets(members)
    return utilities[is_distinct], tuple(member[is_distinct] for member in members)


def scores_of(
    dexterity: NDArray[np.floating[Any]],
    reached: NDArray[np.bool_],
    weights: FloatArray,
    members: tuple[IntArray, ...],
) -> tuple[FloatArray, FloatArray]:
    """Return P_R and P_M of sets, given their members (n,) and arrays of shape (G, C)."""
    manipulability = np.zeros(members[0].size)
    for of_goal, weight in zip(dexterity, weights, strict=True):
        most = of_goal[members[0]]
        for member in members[1:]:
            most = np.maximum(most, of_goal[member])
        manipulability += float(weight) * most.astype(np.float64, copy=False)
    reachability = np.zeros(members[0].size)
    for at_goal, weight in zip(reached, weights, strict=True):
        some = at_goal[members[0]]
        for member in members[1:]:
            some = some | at_goal[member]
        reachability += float(weight) * some
    return reachability, manipulability


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
        kept &= manipulability >= sets.limits.manipulability
        kept &= manipulability >= sets.limits.gain * larger
        kept &= reachability >= sets.limits.reachability
    if sets.same_environment:
        for member in members[1:]:
            kept &= sets.state[member] == sets.state[members[0]]
    return kept


def tour_costs(legs: Legs, members: tuple[IntArray, ...]) -> FloatArray:
    """Return the cost D of the shortest open tour from here through each set, shape (n,).

    Legs are summed in the order they are driven, as in `tcs.placement.selection.shortest_tour`.
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


class _Feasible(NamedTuple):
    """Candidates of one cell of each group that may be in a better set."""

    numbers: IntArray
    """Their numbers, group by group."""
    start: IntArray
    """Position of each group's first candidate."""
    size: IntArray
    """Number of candidates of each group."""


def _feasible_members(bounds: Bounds, groups: IntArray, number: int, least: float) -> _Feasible:
    """Return candidates of one cell of each group that may be in a set with this utility.

    Args:
        bounds: Bounds on the utility.
        groups: The groups.
        number: Number of the cell in each group.
        least: The utility.
    """
    every = bounds.index.all
    cells = bounds.index.cells[number][groups]
    size = every.size[cells]
    which = np.repeat(np.arange(groups.size), size)
    within = np.arange(which.size) - np.repeat(np.cumsum(size) - size, size)
    member = every.sets.by_cell[every.start[cells][which] + within]
    feasible = bounds.of_member(groups[which], member) >= least
    which, member = which[feasible], member[feasible]
    if bounds.lowered is not None:
        of_group = groups[which]
        others = tuple(c[of_group] for i, c in enumerate(bounds.index.cells) if i != number)
        feasible = bounds.of_member_with(of_group, member, others) >= least
        which, member = which[feasible], member[feasible]
    count = np.bincount(which, minlength=groups.size)
    return _Feasible(member, np.cumsum(count) - count, count)

"""Upper bounds on the utility of sets from the current state: of groups, members and single sets.

A bound is either computed by the operations of the utility on greater scores and smaller costs
(rounding is monotone, so it cannot fall below the utility), or widened by `SLACK`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.placement.selection.admission import Admitted
from tcs.placement.selection.alternatives import AmongSets
from tcs.placement.selection.index import GroupIndex, SetIndex
from tcs.placement.selection.penalties import Penalties
from tcs.placement.selection.travel import Legs
from tcs.placement.selection.utility import UtilityWeights

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SLACK = 1e-12
"""Relative margin for rounding in bounds that are not computed by the operations of the utility: a
dozen roundings of 1.1e-16 each, with three digits to spare. A bound without it could end up one
bit below the utility it bounds, and lose a tie."""


@dataclass(frozen=True)
class Bounds:
    """Upper bounds for one query."""

    index: GroupIndex
    """The groups of sets."""
    legs: Legs
    """Travel costs from the current state."""
    weights: UtilityWeights
    """alpha, beta, gamma."""
    admitted: Admitted | None = None
    """The candidates that satisfy the constraints; None without constraints. Their scores without
    blocked solutions are not greater than the stored ones, so the bounds hold for both."""
    penalties: Penalties | None = None
    """Penalties of the sets, if there are any."""
    distinct: AmongSets | None = None
    """Sets from which others must differ, if there are any."""

    @property
    def travel(self) -> float:
        """The weight of the travel cost, gamma."""
        return float(self.weights.travel)

    @cached_property
    def groups(self) -> FloatArray:
        """Bound on the utility of each group, shape (K,).

        It is -inf where a cell is unreachable or has no admitted candidate.
        """
        index, legs = self.index, self.legs
        bounds = self._group_gain - self.travel * self._driving
        if index.members > 2:
            # A path of several legs is not summed in the order of the cost.
            bounds += self._slack
        # No set of a member is better than this, and no path to it is shorter.
        by_cell = np.maximum.reduceat(self._net_gain[index.all.sets.by_cell], index.all.start)
        net = by_cell[index.cells[0]]
        for cells in index.cells[1:]:
            net = np.minimum(net, by_cell[cells])
        np.minimum(bounds, net - self.travel * self._driving + self._slack, out=bounds)
        if not np.all(legs.reachable):
            for cells in index.cells:
                bounds[~legs.reachable[cells]] = -np.inf
        return bounds

    def of_cells(self) -> FloatArray:
        """Return a bound on the utility of the groups whose nearest cell is each, shape (N,).

        A tour drives to the nearest of its cells, and from there through the others. It is computed
        by other operations than `groups`, and may be less by the rounding.
        """
        legs, index = self.legs, self.index
        per_metre = self.travel * legs.metre
        weights = (float(self.weights.reachability), float(self.weights.manipulability))
        most = index.most_of_cells(
            (*weights, per_metre, type(legs.distances)),
            lambda: self._gain(*index.group_scores) - per_metre * index.path(legs.distances),
        )
        # Members of refined sets, behind the candidates of the grid, are in no group.
        here, reachable = legs.here_to_cell[: most.size], legs.reachable[: most.size]
        return np.where(reachable, most - self.travel * here, -np.inf)

    def of_member(self, group: IntArray, member: IntArray) -> FloatArray:
        """Return bounds on the sets of a group that contain a candidate, shape (n,)."""
        return self._net_of(self._group_gain[group], group, member)

    def of_member_with(
        self, group: IntArray, member: IntArray, others: tuple[IntArray, ...]
    ) -> FloatArray:
        """Return tighter bounds, given the cells of the other members, where scores are lowered.

        Args:
            group: The groups, shape (n,).
            member: A candidate of each, shape (n,).
            others: Cells of its partners, shapes (n,).
        """
        if self.lowered is None:
            return self.of_member(group, member)
        return self._net_of(self.lowered.with_partners(member, others), group, member)

    def _net_of(self, gain: FloatArray, group: IntArray, member: IntArray) -> FloatArray:
        """Return bounds on sets that contain a candidate, given a bound on their gain."""
        net = gain - self._levels[member]
        if self.penalties is not None:
            net -= self.penalties.of_candidates[member]
        net = np.minimum(self._net_gain[member], net)
        return net - (self.travel * self._driving[group] - self._slack[group])

    def of_two(self, group: IntArray, a: IntArray, b: IntArray) -> FloatArray:
        """Return bounds on the sets of a group that contain two candidates, shape (n,).

        A tour through both costs at least the change from here to one and on to the other.
        """
        gain = np.minimum(self._member_gain[a], self._member_gain[b])
        levels = np.minimum(self._levels[a], self._levels[b])
        levels += self._least_cost(self.legs.levels_between(a, b))
        net = np.minimum(gain, self._group_gain[group]) - levels
        # Twice the roundings of the bound of one member.
        return net - (self.travel * self._driving[group] - 2.0 * self._slack[group])

    def of_set(
        self, group: IntArray, members: tuple[IntArray, ...], cost: FloatArray
    ) -> FloatArray:
        """Return bounds on the utility of sets whose cost is known, shape (n,)."""
        gain = self._group_gain[group]
        for member in members:
            gain = np.minimum(gain, self._member_gain[member])
        bound = gain - self.travel * cost
        if self.penalties is not None:
            bound -= self.penalties.of_sets(members)
        return np.asarray(bound)

    @cached_property
    def lowered(self) -> LoweredScores | None:
        """What the candidates reach under the constraints; None if that is what is stored."""
        if self.admitted is None or not self.admitted.has_lower_scores:
            return None
        return LoweredScores.of(self.index.all, self.admitted, self.weights)

    @cached_property
    def _group_gain(self) -> FloatArray:
        """Bound on alpha P_R + beta P_M of each group, shape (K,)."""
        stored = self._gain(*self.index.group_scores)
        if self.lowered is None:
            return stored
        # Some sets of the group may be kept for scores that its members no longer have.
        return np.minimum(stored, self.lowered.of_cells(self.index.cells))

    @cached_property
    def _member_gain(self) -> FloatArray:
        """Bound on alpha P_R + beta P_M of the sets of each candidate, shape (C,)."""
        return self._gain(*self.index.member_scores)

    def _gain(
        self, reachability: FloatArray, manipulability: FloatArray, total: FloatArray
    ) -> FloatArray:
        """Return bounds on alpha P_R + beta P_M from bounds on P_R, P_M and their sum."""
        alpha, beta = float(self.weights.reachability), float(self.weights.manipulability)
        # The greatest P_R and the greatest P_M may belong to different sets.
        separate = alpha * reachability + beta * manipulability
        # alpha P_R + beta P_M = (alpha - beta) P_R + beta (P_R + P_M), or with the roles swapped.
        if alpha >= beta:
            together = (alpha - beta) * reachability + beta * total
        else:
            together = alpha * total + (beta - alpha) * manipulability
        return np.minimum(separate, together + SLACK * (alpha + beta))

    @cached_property
    def _driving(self) -> FloatArray:
        """Cost of driving to the nearest cell of each group and through all of them, shape (K,)."""
        here = self.legs.here_to_cell
        approach = here[self.index.cells[0]]
        for cells in self.index.cells[1:]:
            approach = np.minimum(approach, here[cells])
        return np.asarray(approach + self.legs.metre * self.index.path(self.legs.distances))

    @cached_property
    def _levels(self) -> FloatArray:
        """Gamma times the least cost other than driving with each candidate, shape (C,).

        Changes of heading, torso and bed obey the triangle inequality: a tour costs at least the
        direct change from the current state to each of its members.
        """
        return self._least_cost(self.legs.levels_from_here)

    def _least_cost(self, levels: FloatArray) -> FloatArray:
        """Return gamma times a cost of changes other than driving, rounded down."""
        # Wrapping an angle leaves an absolute rounding error of some 1e-15 rad.
        wrapping = SLACK * sum(self.legs.level_weights)
        return self.travel * np.maximum(levels * (1.0 - SLACK) - wrapping, 0.0)

    @cached_property
    def _net_gain(self) -> FloatArray:
        """Bound on the gain of the sets of each candidate minus that cost, shape (C,).

        Penalties are subtracted. It is -inf for candidates that violate a constraint.
        """
        on_grid = slice(self._member_gain.size)
        net = self._member_gain - self._levels[on_grid]
        if self.penalties is not None:
            net -= self.penalties.of_candidates[on_grid]
        if self.admitted is not None:
            net[~self.admitted.candidates[on_grid]] = -np.inf
        return net

    @cached_property
    def _slack(self) -> FloatArray:
        """Margin for rounding in the difference of gain, levels and driving, shape (K,)."""
        most = float(self.weights.reachability) + float(self.weights.manipulability)
        most += float(self._levels.max(initial=0.0))
        if self.penalties is not None:
            most += sum(self.penalties.amounts)
        return SLACK * (most + self.travel * self._driving)


@dataclass(frozen=True, eq=False)
class LoweredScores:
    """What the candidates still reach under constraints, with bounds on the sets of cells.

    At each goal a set gains the greatest alpha reached + beta dexterity of its members, because
    only a goal that is reached has a dexterity. The greatest of a cell bounds all its candidates.
    """

    dexterity: FloatArray
    """Dexterity of the candidates, one contiguous row for each goal, shape (G, C)."""
    reached: NDArray[np.bool_]
    """Whether a goal is reached, one contiguous row for each goal, shape (G, C)."""
    gain: FloatArray
    """Weight of the goal times (alpha reached + beta dexterity), shape (G, C)."""
    cell_gain: FloatArray
    """The greatest of the admitted candidates of each cell, shape (G, N)."""

    @classmethod
    def of(cls, index: SetIndex, admitted: Admitted, weights: UtilityWeights) -> LoweredScores:
        """Return the scores of admitted candidates.

        Args:
            index: The candidates.
            admitted: What they reach.
            weights: alpha and beta.
        """
        dexterity = np.ascontiguousarray(admitted.dexterity.T, dtype=np.float64)
        reached = np.ascontiguousarray(admitted.reached.T)
        gain = float(weights.reachability) * reached + float(weights.manipulability) * dexterity
        gain *= index.sets.weights[:, None] * (1.0 + SLACK)
        of_admitted = np.where(admitted.candidates, gain, 0.0)[:, index.sets.by_cell]
        return cls(dexterity, reached, gain, np.maximum.reduceat(of_admitted, index.start, axis=1))

    def of_cells(self, cells: tuple[IntArray, ...]) -> FloatArray:
        """Return bounds on alpha P_R + beta P_M of sets with a member in each cell, shape (n,)."""
        total = np.zeros(cells[0].size)
        for of_goal in self.cell_gain:
            total += _greatest([of_goal[of_member] for of_member in cells])
        return total

    def with_partners(self, member: IntArray, cells: tuple[IntArray, ...]) -> FloatArray:
        """Return the same for sets of a candidate and a partner in each cell, shape (n,)."""
        total = np.zeros(member.size)
        for of_candidates, of_goal in zip(self.gain, self.cell_gain, strict=True):
            partners = [of_goal[of_member] for of_member in cells]
            total += _greatest([of_candidates[member], *partners])
        return total


def _greatest(values: list[FloatArray]) -> FloatArray:
    greatest = values[0]
    for other in values[1:]:
        greatest = np.maximum(greatest, other)
    return greatest

"""Selection among the refined sets of a table: few enough to evaluate all."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.model.grid import AxisCondition, InitialConfiguration
from tcs.placement.constraints import SAME_VALUE, Constraints, Footprint
from tcs.placement.selection.alternatives import Distinct
from tcs.placement.selection.choice import Choice, SelectionTables, changed_axes
from tcs.placement.selection.distances import StraightDistances
from tcs.placement.selection.ranking import Ranking
from tcs.placement.selection.travel import Legs, TravelWeights, current_values, shortest_tour
from tcs.placement.selection.utility import UtilityWeights, utility
from tcs.placement.tables import RefinedTable

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class RefinedQuery:
    """One selection among refined sets: the sets, the state and the request."""

    tables: SelectionTables
    refined: RefinedTable
    here: InitialConfiguration | None
    legs: Legs
    """Legs to the candidates of the grid, for paths around the furniture."""
    travel: TravelWeights
    ranking: Ranking

    def best(
        self, constraints: Constraints, distinct: Distinct | None, max_members: int
    ) -> Choice | None:
        """Return the best refined set; None if there is none.

        Args:
            constraints: Conditions, axes to keep and forbidden regions.
            distinct: Sets from which it must differ; None if there are none.
            max_members: Greatest number of its members.

        Raises:
            UnknownNameError: If the grid has no such axis.
            GridError: If a condition has the unit of another axis.
        """
        rows = [
            row
            for row in range(len(self.refined.origin))
            if self.refined.sizes[row] <= max_members and self._admits(constraints, row)
        ]
        choices = [choice for row in rows if (choice := self._choice(row)) is not None]
        if distinct is not None:
            grid = self.tables.grid
            choices = [choice for choice in choices if distinct.admits(choice.placed(grid))]
        return max(choices, key=self.ranking.rank, default=None)

    def _values(self, row: int) -> FloatArray:
        """Return the values of the members of a set, shape (m, axes)."""
        return self.refined.values[row, : int(self.refined.sizes[row])]

    def _admits(self, constraints: Constraints, row: int) -> bool:
        """Return whether all members of a set satisfy the constraints."""
        grid, values = self.tables.grid, self._values(row)
        for text in constraints.only:
            condition = AxisCondition.parse(text)
            axis = condition.axis_of(grid)
            if not np.all(condition.satisfied(axis, values[:, grid.axes.index(axis)])):
                return False
        now = {}
        if constraints.keep and self.here is not None:
            now = current_values(self.here, grid, ())
        for name in constraints.keep:
            change = values[:, grid.axes.index(grid.axis(name))] - now.get(name, math.inf)
            if name == "base_yaw":
                change = np.mod(change + math.pi, 2.0 * math.pi) - math.pi
            if np.any(np.abs(change) > SAME_VALUE):
                return False
        if not constraints.forbid:
            return True
        names = [grid.axes.index(grid.axis(n)) for n in ("base_x", "base_y", "base_yaw")]
        footprint = Footprint.of(self.tables.shapes)
        return not any(
            np.any(footprint.overlaps(region, values[:, names])) for region in constraints.forbid
        )

    def _choice(self, row: int) -> Choice | None:
        """Return the choice of a set; None if no path leads to it."""
        refined, here = self.refined, self.here
        members = refined.members(self.tables.grid, row)
        count = len(members)
        cells = self._cells[row, :count]
        if not np.all(self.legs.reachable[cells]):
            return None
        from_here = [0.0] * count
        if here is not None:
            from_here = [
                self._leg(here, member, None, int(c))
                for member, c in zip(members, cells, strict=True)
            ]
        between = np.array(
            [
                [self._leg(a, b, int(i), int(j)) for b, j in zip(members, cells, strict=True)]
                for a, i in zip(members, cells, strict=True)
            ]
        )
        cost, order = shortest_tour(from_here, between)
        scores = (float(refined.reachability[row]), float(refined.manipulability[row]), cost)
        moves = changed_axes(here, members)
        success, interval, low = None, None, None
        if refined.success is not None:
            success = float(refined.success.mean[row])
            interval = (float(refined.success.low[row]), float(refined.success.high[row]))
            low = interval[0]
        net, ranked = (
            utility(*scores, weights.of_size(count), low)
            - (
                float(weights.environment)
                if here is not None and here.environment and moves
                else 0.0
            )
            for weights in (self.ranking.stated, self.ranking.weights)
        )
        return Choice(
            members=members,
            indices=tuple(int(h) for h in refined.origin[row, :count]),
            order=order,
            reachability=scores[0],
            manipulability=scores[1],
            cost=cost,
            utility=utility(*scores, self.ranking.stated, low),
            net_utility=net,
            ranked=ranked,
            moves=moves,
            success=success,
            success_ci95=interval,
            unreachable=int(np.count_nonzero(~self.legs.reachable[self.tables.sets.cell])),
            hands=self.tables.hands_of(refined.served[row, :count]),
            seconds=0.0,
            refined=row,
        )

    @cached_property
    def _cells(self) -> NDArray[np.int32]:
        """Base cells from which the members were refined, shape (K, m)."""
        sets = self.tables.sets
        rows = np.searchsorted(sets.candidates, np.maximum(self.refined.origin, 0))
        return sets.cell[np.minimum(rows, len(sets.candidates) - 1)]

    def _leg(
        self,
        start: InitialConfiguration,
        end: InitialConfiguration,
        start_cell: int | None,
        end_cell: int,
    ) -> float:
        """Return the cost of a leg.

        Around the furniture, the path leads through the base cells from which the members were
        refined.

        Args:
            start: Where it starts.
            end: Where it ends.
            start_cell: Base cell of the start; None for the current state.
            end_cell: Base cell of the end.
        """
        if isinstance(self.legs.distances, StraightDistances):
            metres = math.hypot(end.base_x - start.base_x, end.base_y - start.base_y)
        elif start_cell is None:
            distances = self.legs.distances.from_position(start.base_x, start.base_y)
            metres = float(distances[end_cell]) + self._offset(end, end_cell)
        else:
            between = self.legs.distances.between(np.array(start_cell), np.array(end_cell))
            metres = float(between) + self._offset(start, start_cell) + self._offset(end, end_cell)
        if self.here is None:
            return self.travel.metre * metres
        turn = abs(math.remainder(end.base_yaw - start.base_yaw, 2.0 * math.pi))
        cost = self.travel.metre * metres + self.travel.turn * turn
        cost += self.travel.torso * abs(end.torso - start.torso)
        before, after = dict(start.environment), dict(end.environment)
        for name, weight in self.travel.environment:
            cost += weight * abs(after[name] - before[name])
        return cost

    def _offset(self, member: InitialConfiguration, cell: int) -> float:
        """Return the distance of a member from a base cell [m]."""
        x, y = self.tables.sets.cell_xy[cell]
        return math.hypot(member.base_x - x, member.base_y - y)


def grid_only(
    refined: RefinedTable,
    constraints: Constraints,
    weights: UtilityWeights,
    *,
    limbs: bool,
    motions: bool,
) -> tuple[str, ...]:
    """Return what is requested that refined sets cannot answer, for a warning.

    Args:
        refined: The refined sets.
        constraints: Constraints of the selection.
        weights: Weights of the utility.
        limbs: Whether limbs are observed in several tables.
        motions: Whether only goals with a motion count.
    """
    requested = {
        "obstacles": bool(constraints.blocked),
        "preferences": bool(constraints.prefer),
        "limbs in several tables": limbs,
        "motions": motions,
        "success under error": weights.success > 0.0 and refined.success is None,
    }
    return tuple(name for name, wanted in requested.items() if wanted)

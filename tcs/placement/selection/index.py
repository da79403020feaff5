"""Index of a set table and its refined sets for the search, independent of the query."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.selection.distances import Distances, LatticeDistances, StraightDistances
from tcs.placement.tables import RefinedTable, SetTable
from tcs.placement.tables.sets import Groups
from tcs.placement.tables.success import NO_MEMBER

KEPT_WEIGHTS = 16
"""Most weights of selection for which values over the groups are kept, a kilobyte for each."""

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class SetIndex:
    """The C candidates of a set table, and behind them the M members of its refined sets.

    A member that is off the grid stands in a base cell of its own, behind the N cells of the grid.
    """

    sets: SetTable
    """The table."""
    grid: Grid
    """Grid of the candidates."""
    refined: RefinedTable | None = None
    """The refined sets that are compared; None for none."""
    chosen: dict[tuple[int, ...], Any] = field(default_factory=dict, repr=False)
    """What chosen sets are from any state, by their candidate numbers."""

    @cached_property
    def groups(self) -> tuple[GroupIndex, ...]:
        """The groups of pairs, and of triples if the table holds them."""
        groups = [self.sets.pairs]
        if self.sets.triples is not None:
            groups.append(self.sets.triples)
        return tuple(GroupIndex(self, one) for one in groups)

    @property
    def on_grid(self) -> int:
        """C, the number of candidates on the grid."""
        return len(self.sets.candidates)

    @cached_property
    def refined_rows(self) -> IntArray:
        """Candidate numbers of the members of refined sets, NO_MEMBER after the last, (K, m)."""
        if self.refined is None:
            return np.empty((0, 1), np.int64)
        is_member = self.refined.origin != NO_MEMBER
        number = self.on_grid + np.cumsum(is_member).reshape(is_member.shape) - 1
        return np.where(is_member, number, NO_MEMBER)

    def refined_set(self, member: int) -> int | None:
        """Return the number of the refined set with a candidate; None for one of the grid."""
        found = np.argwhere(self.refined_rows == member)
        return int(found[0, 0]) if member >= self.on_grid else None

    @cached_property
    def off_grid(self) -> FloatArray:
        """Values of the grid's axes of each member of a refined set [m or rad], shape (M, axes)."""
        if self.refined is None:
            return np.empty((0, len(self.grid.axes)))
        return np.asarray(self.refined.values[self.refined_rows != NO_MEMBER])

    def _with_refined(self, of_grid: NDArray[Any], of_refined: str) -> NDArray[Any]:
        """Return an array of the grid's candidates, extended by one of the refined sets."""
        if self.refined is None:
            return of_grid
        members = getattr(self.refined, of_refined)[self.refined_rows != NO_MEMBER]
        return np.concatenate([of_grid, members])

    @cached_property
    def flat(self) -> NDArray[np.int32]:
        """Flat index of each candidate; off the grid where it was refined from, shape (C + M,)."""
        return self._with_refined(self.sets.candidates, "origin")

    @cached_property
    def reached_goals(self) -> NDArray[np.bool_]:
        """Whether a candidate reaches a goal, shape (C + M, G)."""
        return self._with_refined(self.sets.reached, "reached")

    @cached_property
    def dexterity_at(self) -> NDArray[np.float32]:
        """Its dexterity there, shape (C + M, G)."""
        return self._with_refined(self.sets.dexterity, "dexterity")

    @cached_property
    def served(self) -> NDArray[np.uint8]:
        """Number of the hand that reaches it plus 1, 0 for none, shape (C + M, G)."""
        return self._with_refined(self.sets.served, "served")

    @cached_property
    def state(self) -> IntArray:
        """Number of the environment's state, off the grid of the origin, shape (C + M,)."""
        return self.flat.astype(np.int64) // self.sets.state_size

    @cached_property
    def cell(self) -> NDArray[np.int32]:
        """Base cell of each candidate, shape (C + M,)."""
        own = len(self.sets.cell_xy) + np.arange(len(self.off_grid), dtype=np.int32)
        return np.concatenate([self.sets.cell, own]) if own.size else self.sets.cell

    @cached_property
    def cell_xy(self) -> FloatArray:
        """Position of each base cell in W [m], shape (N + M, 2)."""
        along = [self.grid.axes.index(self.grid.axis(name)) for name in ("base_x", "base_y")]
        return np.concatenate([self.sets.cell_xy, self.off_grid[:, along]])

    @cached_property
    def distances(self) -> dict[str, Distances]:
        """Distances between the cells, by route."""
        xy, origin = self.cell_xy, None
        if len(self.off_grid):
            refined_from = np.searchsorted(self.sets.candidates, self.flat[self.on_grid :])
            cells = np.arange(len(self.sets.cell_xy))
            origin = np.concatenate([cells, self.sets.cell[refined_from]])
        return {
            "straight": StraightDistances(xy),
            "around": LatticeDistances(xy, self.sets.lattice, origin),
        }

    def values_of(self, candidates: IntArray) -> FloatArray:
        """Return the values of the grid's axes of candidates [m or rad], shape (n, axes)."""
        values = np.empty((len(candidates), len(self.grid.axes)))
        on_grid = candidates < self.on_grid
        of_grid = self.grid.values(self.flat[candidates[on_grid]])
        values[on_grid] = np.stack([*of_grid.values()], axis=1)
        values[~on_grid] = self.off_grid[candidates[~on_grid] - self.on_grid]
        return values

    def rows_at(self, values: FloatArray) -> list[IntArray]:
        """Return the candidates with given values of the axes, shape (n, axes): those of each."""
        along = [
            np.abs(axis.values - column[:, None]).argmin(axis=1)
            for axis, column in zip(self.grid.axes, values.T, strict=True)
        ]
        flat = np.ravel_multi_index(along, self.grid.shape) if len(values) else np.empty(0, int)
        row = np.minimum(np.searchsorted(self.sets.candidates, flat), self.on_grid - 1)
        same = np.all(np.abs(self.values_of(row) - values) <= 1e-9, axis=1).tolist()
        off_grid = [
            self.on_grid + np.flatnonzero(np.all(np.abs(self.off_grid - at) <= 1e-9, axis=1))
            for at in values
        ]
        return [
            np.append(others, one) if found else others
            for one, found, others in zip(row, same, off_grid, strict=True)
        ]

    def configuration(self, candidate: int) -> InitialConfiguration:
        """Return a candidate as a configuration."""
        if candidate < self.on_grid:
            return self.grid.configuration(int(self.sets.candidates[candidate]))
        return self.grid.between(self.off_grid[candidate - self.on_grid].tolist())

    @cached_property
    def start(self) -> IntArray:
        """Position of each cell's first candidate in `by_cell`, shape (N,)."""
        return self.sets.cell_start[:-1]

    @cached_property
    def size(self) -> IntArray:
        """Number of candidates of each cell, shape (N,)."""
        return np.asarray(np.diff(self.sets.cell_start))

    @cached_property
    def earliest(self) -> IntArray:
        """Least candidate number in each cell, shape (N,)."""
        return self.sets.by_cell[self.start]

    @cached_property
    def dexterity(self) -> FloatArray:
        """Dexterity in double precision, one contiguous row for each goal, shape (G, C)."""
        return np.ascontiguousarray(self.sets.dexterity.T, dtype=np.float64)

    @cached_property
    def reached(self) -> NDArray[np.bool_]:
        """Whether a goal is reached, one contiguous row for each goal, shape (G, C)."""
        return np.ascontiguousarray(self.sets.reached.T)


@dataclass(frozen=True)
class GroupIndex:
    """Groups of sets of m members with the same base cells."""

    all: SetIndex
    """The candidates."""
    groups: Groups
    """The groups."""
    _paths: dict[type[Distances], FloatArray] = field(default_factory=dict, repr=False)
    """Computed lengths of paths through the cells of each group, by class of distances."""
    _most: dict[Hashable, FloatArray] = field(default_factory=dict, repr=False)
    """Computed greatest values over the groups of each cell, by what determines them."""

    @property
    def members(self) -> int:
        """m, the number of members of each set."""
        return int(self.groups.cells.shape[1])

    @cached_property
    def cells(self) -> tuple[IntArray, ...]:
        """First, second, ... cell of each group, shapes (K,)."""
        return tuple(np.ascontiguousarray(column, dtype=np.int64) for column in self.groups.cells.T)

    @cached_property
    def group_scores(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Bounds on P_R, P_M and P_R + P_M of each group in double precision, shapes (K,).

        Products of float32 arrays would round to float32, and might round a bound down.
        """
        groups = self.groups
        return (
            groups.reachability,
            groups.manipulability.astype(np.float64),
            groups.total.astype(np.float64),
        )

    @cached_property
    def member_scores(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The same for the kept sets that contain each candidate, shapes (C,)."""
        groups = self.groups
        return (
            groups.member_reachability,
            groups.member_manipulability.astype(np.float64),
            groups.member_total.astype(np.float64),
        )

    @cached_property
    def candidates_within(self) -> IntArray:
        """Number of candidates in the cells of each group, shape (K,)."""
        return np.asarray(sum(self.all.size[cells] for cells in self.cells))

    @cached_property
    def _groups_by_cell(self) -> tuple[IntArray, IntArray]:
        """Numbers of the groups, cell by cell, and the position of each cell's first one."""
        of_all = np.concatenate(self.cells)
        order = np.argsort(of_all, kind="stable")
        start = np.searchsorted(of_all[order], np.arange(self.all.size.size + 1))
        return order % max(len(self.cells[0]), 1), start

    def groups_of(self, cells: IntArray) -> IntArray:
        """Return the numbers of the groups with one of some cells, ascending."""
        groups, start = self._groups_by_cell
        # Faster than sorting the numbers.
        is_one = np.zeros(self.cells[0].size, dtype=np.bool_)
        for cell in cells:
            is_one[groups[start[cell] : start[cell + 1]]] = True
        return np.flatnonzero(is_one)

    def most_of_cells(self, key: Hashable, values: Callable[[], FloatArray]) -> FloatArray:
        """Return the greatest of some values over the groups of each cell, shape (N,).

        Args:
            key: What the values depend on; they are computed once for each.
            values: Returns the values, shape (K,).
        """
        if key not in self._most:
            if len(self._most) >= KEPT_WEIGHTS:
                self._most.clear()
            most = np.full(self.all.size.size, -np.inf)
            found = values()
            for cells in self.cells:
                np.maximum.at(most, cells, found)
            self._most[key] = most
        return self._most[key]

    def part(self, rows: IntArray) -> GroupPart:
        """Return an index of some of the groups.

        Args:
            rows: Their numbers, shape (n,).
        """
        return GroupPart(self.all, self.groups, whole=self, rows=rows)

    def path(self, distances: Distances) -> FloatArray:
        """Return the least driving distance through the cells of each group [m], shape (K,)."""
        if type(distances) not in self._paths:
            legs = [
                distances.between(first, second)
                for i, first in enumerate(self.cells)
                for second in self.cells[i + 1 :]
            ]
            # A path through three cells takes two of the three legs.
            self._paths[type(distances)] = np.sort(legs, axis=0)[: self.members - 1].sum(axis=0)
        return self._paths[type(distances)]


@dataclass(frozen=True, kw_only=True)
class GroupPart(GroupIndex):
    """Some of the groups of an index; values of groups have the order of `rows`."""

    whole: GroupIndex
    """The index of all groups."""
    rows: IntArray
    """Numbers of the groups there, shape (n,)."""

    @cached_property
    def cells(self) -> tuple[IntArray, ...]:
        """First, second, ... cell of each group, shapes (n,)."""
        return tuple(cells[self.rows] for cells in self.whole.cells)

    @cached_property
    def group_scores(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Bounds on P_R, P_M and P_R + P_M of each group in double precision, shapes (n,)."""
        first, second, third = self.whole.group_scores
        return first[self.rows], second[self.rows], third[self.rows]

    @cached_property
    def member_scores(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Those of the whole index, shapes (C,)."""
        return self.whole.member_scores

    @cached_property
    def candidates_within(self) -> IntArray:
        """Number of candidates in the cells of each group, shape (n,)."""
        return self.whole.candidates_within[self.rows]

    def path(self, distances: Distances) -> FloatArray:
        """Return the least driving distance through the cells of each group [m], shape (n,)."""
        return self.whole.path(distances)[self.rows]

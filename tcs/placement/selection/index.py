"""Index of a set table for the search, independent of the query."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.placement.selection.distances import Distances, LatticeDistances, StraightDistances
from tcs.placement.tables import SetTable
from tcs.placement.tables.sets import Groups

KEPT_WEIGHTS = 16
"""Most weights of selection for which values over the groups are kept, a kilobyte for each."""

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class SetIndex:
    """The candidates of a set table, by cell and by goal."""

    sets: SetTable
    """The table."""

    @cached_property
    def groups(self) -> tuple[GroupIndex, ...]:
        """The groups of pairs, and of triples if the table holds them."""
        groups = [self.sets.pairs]
        if self.sets.triples is not None:
            groups.append(self.sets.triples)
        return tuple(GroupIndex(self, one) for one in groups)

    @cached_property
    def distances(self) -> dict[str, Distances]:
        """Distances between the cells, by route."""
        xy = self.sets.cell_xy
        return {
            "straight": StraightDistances(xy),
            "around": LatticeDistances(xy, self.sets.lattice),
        }

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

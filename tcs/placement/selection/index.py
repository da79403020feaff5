"""Index of a set table for the search, independent of the query."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.placement.selection.distances import Distances, LatticeDistances, StraightDistances
from tcs.placement.tables import SetTable
from tcs.placement.tables.groups import Groups

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

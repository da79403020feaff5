"""What the search needs of a set table, independent of the query."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.select.ways import StraightWays, Ways, WaysAround
from tcs.tables import SetTable

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


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
    def group_scores(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Bounds on P_R, P_M and P_R + P_M of each group in double precision, shapes (K,).

        Products with float32 arrays would round to float32, and might round a bound down.
        """
        sets = self.sets
        return (
            sets.pair_reachability,
            sets.pair_manipulability.astype(np.float64),
            sets.pair_sum.astype(np.float64),
        )

    @cached_property
    def member_scores(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The same of the kept pairs that each candidate is in, shapes (C,)."""
        sets = self.sets
        return (
            sets.member_reachability,
            sets.member_manipulability.astype(np.float64),
            sets.member_sum.astype(np.float64),
        )

    @cached_property
    def start(self) -> IntArray:
        """Where each cell starts in `by_cell`, shape (N,)."""
        return self.sets.cell_start[:-1]

    @cached_property
    def size(self) -> IntArray:
        """How many candidates each cell has, shape (N,)."""
        return np.asarray(np.diff(self.sets.cell_start))

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
        return self.sets.by_cell[self.start]

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
        return np.asarray(self.size[self.first] * self.size[self.second])

"""Kept sets of several members, grouped by the base cells of their members."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tcs.placement.tables.checks import ArrayTable, Shapes, length_of, require


@dataclass(frozen=True, kw_only=True, eq=False)
class Groups(ArrayTable):
    """Kept sets of m members: K groups, each with the same m base cells; read-only.

    The score of any set follows from its members, so a group holds bounds only.
    """

    least: float
    """Least P_M of a kept set."""
    cells: NDArray[np.int32]
    """Cells of the members, ascending, with at least one kept set; lexicographic, shape (K, m)."""
    count: NDArray[np.int64]
    """Number of kept sets in each group, shape (K,)."""
    reachability: NDArray[np.float64]
    """Greatest P_R of those sets, exact, shape (K,)."""
    manipulability: NDArray[np.float32]
    """Greatest P_M of those sets, rounded upward, shape (K,)."""
    total: NDArray[np.float32]
    """Greatest P_R + P_M of those sets, rounded upward, shape (K,)."""
    member_reachability: NDArray[np.float64]
    """Greatest P_R of the kept sets that a candidate is in, exact, 0 if in none, shape (C,)."""
    member_manipulability: NDArray[np.float32]
    """Greatest P_M of those sets, rounded upward, shape (C,)."""
    member_total: NDArray[np.float32]
    """Greatest P_R + P_M of those sets, rounded upward, shape (C,)."""

    def __post_init__(self) -> None:
        """Check the arrays against each other and make them read-only.

        Raises:
            TcsError: If an array has the wrong type, shape or range.
        """
        kept, members = length_of(self.cells), length_of(self.member_reachability)
        bounds = {"reachability": np.float64, "manipulability": np.float32, "total": np.float32}
        shapes: Shapes = {
            "cells": (np.int32, (kept, None)),
            "count": (np.int64, (kept,)),
            **{name: (dtype, (kept,)) for name, dtype in bounds.items()},
            **{f"member_{name}": (dtype, (members,)) for name, dtype in bounds.items()},
        }
        self._check_arrays("groups of sets", shapes)
        for name in BOUNDS:
            bound = getattr(self, name)
            require(
                bool(np.all((bound >= 0.0) & (bound < np.inf))),
                f"groups of sets: {name} must be finite and >= 0.",
            )
        require(0.0 <= self.least < np.inf, "groups of sets: least must be finite and >= 0.")

    def check(self, size: NDArray[np.int64]) -> None:
        """Check the groups against the number of candidates of each cell.

        Args:
            size: Number of candidates of each cell, shape (N,).

        Raises:
            TcsError: If groups are out of order, of cells that do not exist, or have too many sets.
        """
        cells = self.cells.astype(np.int64)
        number = np.zeros(len(cells), dtype=np.int64)
        most = np.ones(len(cells))
        require(
            bool(np.all((cells >= 0) & (cells < size.size)))
            and bool(np.all(np.diff(cells, axis=1) >= 0)),
            f"groups of sets: cells must be ascending in each, within 0..{size.size - 1}.",
        )
        for column in cells.T:
            number = number * size.size + column
            most *= size[column]
        require(bool(np.all(np.diff(number) > 0)), "groups of sets: cells must be lexicographic.")
        require(
            bool(np.all((self.count > 0) & (self.count <= most))),
            "groups of sets: count does not fit the number of candidates in the cells.",
        )
        require(
            self.member_reachability.size == int(size.sum()),
            "groups of sets: needs a bound for each candidate.",
        )

    @property
    def kept(self) -> int:
        """Number of kept sets."""
        return int(self.count.sum())


_NOT_BOUNDS = ("least", "cells", "count")
BOUNDS = tuple(field.name for field in fields(Groups) if field.name not in _NOT_BOUNDS)
"""Names of the arrays that bound scores."""

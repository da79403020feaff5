"""Kept sets of several members, grouped by the base cells of their members."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tcs.placement.tables.checks import read_only, require


@dataclass(frozen=True, kw_only=True, eq=False)
class Groups:
    """Kept sets of m members: K groups, each with the same m base cells; read-only.

    The score of any set follows from its members, so a group holds bounds only.
    """

    least: float
    """Least P_M of a kept set."""
    cells: NDArray[np.int32]
    """Cells of the members, ascending, with at least one kept set; lexicographic, shape (K, m)."""
    count: NDArray[np.int64]
    """How many sets are kept in each group, shape (K,)."""
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
        kept = len(self.cells) if isinstance(self.cells, np.ndarray) else None
        of_members = self.member_reachability
        members = of_members.size if isinstance(of_members, np.ndarray) else None
        types = {
            "count": np.int64,
            "reachability": np.float64,
            "manipulability": np.float32,
            "total": np.float32,
        }
        shapes: dict[str, tuple[type, tuple[int | None, ...]]] = {
            "cells": (np.int32, (kept, None)),
            **{name: (dtype, (kept,)) for name, dtype in types.items()},
            **{
                f"member_{name}": (dtype, (members,))
                for name, dtype in types.items()
                if name != "count"
            },
        }
        for name, (dtype, shape) in shapes.items():
            view = read_only(f"groups of sets: {name}", getattr(self, name), dtype, shape)
            object.__setattr__(self, name, view)
            if dtype in (np.float32, np.float64):
                require(
                    bool(np.all((view >= 0.0) & (view < np.inf))),
                    f"groups of sets: {name} must be finite and >= 0.",
                )
        require(0.0 <= self.least < np.inf, "groups of sets: least must be finite and >= 0.")

    def check(self, size: NDArray[np.int64]) -> None:
        """Refuse groups out of order, of cells that do not exist, or with too many sets.

        Args:
            size: How many candidates each cell has, shape (N,).

        Raises:
            TcsError: If they do not fit.
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


ARRAYS = tuple(field.name for field in fields(Groups) if field.name not in ("least", "cells"))
"""Names of the arrays that bound scores or count sets."""

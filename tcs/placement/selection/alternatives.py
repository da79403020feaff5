"""Alternatives to the best set that differ from it, and from each other, by a distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.files.quantities import POSITION
from tcs.placement.tables import SetTable

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

MOST = 100
"""Greatest number of sets, each of which takes a search of some milliseconds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Top:
    """How many sets are offered, and by how much they differ."""

    count: int = 5
    """Number of sets, the best included."""
    min_apart: float = 0.5
    """Distance [m] at which base positions count as different."""

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            SelectionError: If one is out of range.
        """
        if isinstance(self.count, bool) or not isinstance(self.count, int):
            raise SelectionError(f"top is {self.count!r}; must be a whole number.")
        if not 1 <= self.count <= MOST:
            raise SelectionError(f"top is {self.count}; must be 1 to {MOST}.")
        if not POSITION.admits(self.min_apart) or self.min_apart < 0.0:
            raise SelectionError(f"min_apart is {self.min_apart!r}; must be 0 to 40 m.")


@dataclass(frozen=True, eq=False)
class Distinct:
    """Sets that were offered; others are distinct if they differ from each of them.

    Two sets differ if a member of one has its base at least `min_apart` from every member of the
    other, or if their members need different states of the environment.
    """

    sets: SetTable
    min_apart: float
    offered: tuple[tuple[int, ...], ...]
    """Candidate numbers of the members of each."""

    def of_sets(self, members: tuple[IntArray, ...]) -> BoolArray:
        """Return which sets are distinct, given their members of shapes (n,), shape (n,)."""
        distinct = np.ones(len(members[0]), dtype=np.bool_)
        for other in self.offered:
            distinct &= self._differ(members, np.array(other))
        return distinct

    def _differ(self, members: tuple[IntArray, ...], other: IntArray) -> BoolArray:
        """Return which sets differ from another set, shape (n,)."""
        sets = self.sets
        # Distance of every cell from each member of the other set, shape (N, m).
        offset = sets.cell_xy[:, None] - sets.cell_xy[sets.cell[other]]
        apart = np.hypot(offset[..., 0], offset[..., 1]) >= self.min_apart - 1e-9
        # One bit for each member of the other set: there are millions of sets, and few cells.
        bits = (apart << np.arange(other.size)).sum(axis=1).astype(np.uint8)[sets.cell]
        of_members = [bits[member] for member in members]
        differ = np.bitwise_and.reduce(of_members) != 0
        for far in of_members:
            differ |= far == (1 << other.size) - 1
        if sets.state.min() == sets.state.max():
            return np.asarray(differ)
        state = np.stack([sets.state[member] for member in members])
        same = state[:, :, None] == sets.state[other]
        differ |= ~(np.all(np.any(same, axis=2), axis=0) & np.all(np.any(same, axis=0), axis=1))
        return np.asarray(differ)

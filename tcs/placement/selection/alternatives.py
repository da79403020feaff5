"""Alternatives to the best set that differ from it, and from each other, by a distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

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


class SetPositions(NamedTuple):
    """Where a set of m members is; on the grid or off it."""

    bases: NDArray[np.float64]
    """x and y of the base of each member in W [m], shape (m, 2)."""
    states: IntArray
    """Number of the state of the environment of each member, shape (m,); of a refined member that
    of the configuration that it was refined from."""

    @classmethod
    def of_candidates(cls, sets: SetTable, rows: Sequence[int]) -> SetPositions:
        """Return where a set of the grid is, given its candidate numbers."""
        member = list(rows)
        return cls(sets.cell_xy[sets.cell[member]], sets.state[member].astype(np.int64))


@dataclass(frozen=True, eq=False)
class Distinct:
    """Sets that were offered; others are distinct if they differ from each of them.

    Two sets differ if a member of one has its base at least `min_apart` from every member of the
    other, or if their members need different states of the environment.
    """

    sets: SetTable
    min_apart: float
    offered: tuple[SetPositions, ...]

    def of_sets(self, members: tuple[IntArray, ...]) -> BoolArray:
        """Return which sets are distinct, given their members of shapes (n,), shape (n,)."""
        sets = self.sets
        distinct = np.ones(len(members[0]), dtype=np.bool_)
        is_one_state = bool(sets.state.min() == sets.state.max())
        for other in self.offered:
            bits = self._bits(sets.cell_xy, other)[sets.cell]
            states = [] if is_one_state else [sets.state[member] for member in members]
            distinct &= _differ([bits[member] for member in members], states, other)
        return distinct

    def admits(self, placed: SetPositions) -> bool:
        """Return whether a set that need not be on the grid is distinct."""
        return all(
            _differ(
                [bits[None] for bits in self._bits(placed.bases, other)],
                [state[None] for state in placed.states],
                other,
            )[0]
            for other in self.offered
        )

    def _bits(self, xy: NDArray[np.float64], other: SetPositions) -> NDArray[np.uint8]:
        """Return from which members of another set positions (n, 2) are apart, shape (n,).

        One bit for each member: there are millions of sets, and few positions.
        """
        offset = xy[:, None] - other.bases
        apart = np.hypot(offset[..., 0], offset[..., 1]) >= self.min_apart - 1e-9
        return np.asarray((apart << np.arange(len(other.bases))).sum(axis=1), dtype=np.uint8)


def _differ(
    bits: Sequence[NDArray[np.uint8]], states: Sequence[NDArray[Any]], other: SetPositions
) -> BoolArray:
    """Return which sets differ from another set, shape (n,).

    Args:
        bits: From which members of the other set each member is apart, shapes (n,).
        states: State of the environment of each member, shapes (n,); [] if there is one state.
        other: The other set.
    """
    differ = np.bitwise_and.reduce(list(bits)) != 0
    for far in bits:
        differ |= far == (1 << len(other.bases)) - 1
    if len(states):
        same = np.stack(list(states))[:, :, None] == other.states
        differ |= ~(np.all(np.any(same, axis=2), axis=0) & np.all(np.any(same, axis=0), axis=1))
    return np.asarray(differ)

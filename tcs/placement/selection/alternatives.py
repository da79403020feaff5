"""Alternatives to the best set that differ from it, and from each other, by a distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.files.quantities import POSITION

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


class CandidatePlaces(Protocol):
    """Candidates with their base cells and states of the environment, e.g. a set table."""

    @property
    def cell(self) -> NDArray[np.int32]:
        """Base cell of each candidate, shape (C,)."""

    @property
    def cell_xy(self) -> NDArray[np.float64]:
        """Position of each base cell in W [m], shape (N, 2)."""

    @property
    def state(self) -> IntArray:
        """Number of the environment's state of each candidate, shape (C,)."""


class AmongSets(Protocol):
    """Admits some of the sets."""

    def of_sets(self, members: tuple[IntArray, ...]) -> BoolArray:
        """Return which sets it admits, given their members of shapes (n,), shape (n,)."""


@dataclass(frozen=True, eq=False)
class Distinct:
    """Sets that were offered; others are distinct if they differ from each of them.

    Two sets differ if a member of one has its base at least `min_apart` from every member of the
    other, or if their members need different states of the environment.
    """

    candidates: CandidatePlaces
    min_apart: float
    offered: Sequence[Sequence[int]]
    """Candidate numbers of the members of each."""

    def of_sets(self, members: tuple[IntArray, ...]) -> BoolArray:
        """Return which sets are distinct, given their members of shapes (n,), shape (n,)."""
        every = self.candidates
        distinct = np.ones(len(members[0]), dtype=np.bool_)
        is_one_state = bool(every.state.min() == every.state.max())
        for other in self.offered:
            bits = self._bits(every.cell_xy[every.cell[list(other)]])[every.cell]
            states = [] if is_one_state else [every.state[member] for member in members]
            of_other = every.state[list(other)]
            distinct &= _differ([bits[member] for member in members], states, of_other)
        return distinct

    def _bits(self, bases: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return from which members of another set each cell is apart, shape (N,).

        One bit for each member: there are millions of sets, and few cells.
        """
        offset = self.candidates.cell_xy[:, None] - bases
        apart = np.hypot(offset[..., 0], offset[..., 1]) >= self.min_apart - 1e-9
        return np.asarray((apart << np.arange(len(bases))).sum(axis=1), dtype=np.uint8)


def _differ(
    bits: Sequence[NDArray[np.uint8]], states: Sequence[IntArray], other: IntArray
) -> BoolArray:
    """Return which sets differ from another set, shape (n,).

    Args:
        bits: From which members of the other set each member is apart, shapes (n,).
        states: State of the environment of each member, shapes (n,); [] if there is one state.
        other: States of the members of the other set.
    """
    differ = np.bitwise_and.reduce(list(bits)) != 0
    for far in bits:
        differ |= far == (1 << len(other)) - 1
    if len(states):
        same = np.stack(list(states))[:, :, None] == other
        differ |= ~(np.all(np.any(same, axis=2), axis=0) & np.all(np.any(same, axis=0), axis=1))
    return np.asarray(differ)

"""Table of the estimated success under error of sets of configurations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from tcs.placement.tables.columns import ArrayTable, Column, Columns, Form, require
from tcs.placement.tables.sets import MOST_MEMBERS, SetTable

NO_MEMBER = -1
"""Fills the rows of sets with fewer members than others."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Estimates(ArrayTable):
    """Estimated success of K sets under error; read-only.

    The success of a set is the probability that all goals are done from its members in a randomly
    perturbed environment. By the rules of the paper it is the probability that a goal, drawn by its
    weight, is reached by any member: the mean of P_R under error, as in Table I of the TCS paper.
    """

    success: NDArray[np.float64]
    """Mean over the samples, shape (K,)."""
    low: NDArray[np.float64]
    """Lower end of the 95 % interval of the mean, shape (K,)."""
    high: NDArray[np.float64]
    """Upper end, shape (K,)."""
    samples: NDArray[np.int32]
    """Number of samples of the mean, shape (K,)."""
    rooms_done: NDArray[np.float64] | None = None
    """Fraction of the samples in which all goals are done, shape (K,); None in files of older
    versions. It is the success, but for the rules of the paper."""

    WHAT = "estimates of success"
    COLUMNS: ClassVar[Columns] = {
        **dict.fromkeys(("success", "low", "high"), Column(np.float64, "K")),
        "samples": Column(np.int32, "K", Form.SMALLEST),
        "rooms_done": Column(np.float64, "K", least=0.0, optional=True),
    }

    def __post_init__(self) -> None:
        """Check the arrays against each other and make them read-only.

        Raises:
            TcsError: If an array has the wrong type, shape or range.
        """
        self._check_arrays()
        inside = (self.low >= 0.0) & (self.low <= self.success)
        inside &= (self.success <= self.high) & (self.high <= 1.0)
        # Rounding of a mean of ones must not refuse it.
        require(bool(np.all(inside)), f"{self.WHAT}: 0 <= low <= success <= high <= 1 must hold.")
        require(bool(np.all(self.samples > 0)), f"{self.WHAT}: samples must be positive.")

    @property
    def counts_rooms(self) -> bool:
        """Whether success is the fraction of the samples in which all goals are done."""
        return self.rooms_done is not None and np.array_equal(self.rooms_done, self.success)

    def rooms_at(self, row: int) -> float | None:
        """Return the fraction of the samples in which all goals are done from a set, if known."""
        return None if self.rooms_done is None else float(self.rooms_done[row])

    def at(self, row: int) -> tuple[float, float, float]:
        """Return mean, lower and upper end of a set."""
        return float(self.success[row]), float(self.low[row]), float(self.high[row])


@dataclass(frozen=True, kw_only=True, eq=False)
class SuccessTable(Estimates):
    """Estimated success of K sets of a grid, with their members.

    Order of the sets: singles by configuration index, then pairs in lexicographic order, then
    triples, as in `SetTable`.
    """

    members: NDArray[np.int32]
    """Flat configuration indices, ascending, NO_MEMBER after the last, shape (K, m)."""

    WHAT = "success table"
    COLUMNS: ClassVar[Columns] = {
        "members": Column(np.int32, "K m", Form.PLUS_ONE),
        **Estimates.COLUMNS,
    }

    def __post_init__(self) -> None:
        """Check the arrays against each other and make them read-only.

        Raises:
            TcsError: If an array has the wrong type, shape or range.
        """
        super().__post_init__()
        require(
            1 <= self.members.shape[1] <= MOST_MEMBERS,
            f"success table: sets must have 1 to {MOST_MEMBERS} members.",
        )
        self._check_members()

    def _check_members(self) -> None:
        """Check that sets are non-empty and in order."""
        members = self.members.astype(np.int64)
        is_member = members != NO_MEMBER
        ascending = (members[:, :-1] < members[:, 1:]) | ~is_member[:, 1:]
        gapless = is_member[:, :-1] | ~is_member[:, 1:]
        require(
            bool(np.all(members >= NO_MEMBER) and np.all(is_member[:, 0]))
            and bool(np.all(ascending) and np.all(gapless)),
            "success table: members of a set must be ascending configuration indices.",
        )
        keys = [self.sizes, *members.T]
        earlier = np.zeros(max(len(members) - 1, 0), dtype=np.bool_)
        tied = np.ones_like(earlier)
        for key in keys:
            earlier |= tied & (key[:-1] < key[1:])
            tied &= key[:-1] == key[1:]
        require(bool(np.all(earlier)), "success table: sets must be in order, without duplicates.")

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Number of members of each set, shape (K,)."""
        return np.asarray(np.count_nonzero(self.members != NO_MEMBER, axis=1), dtype=np.int64)

    def of_size(self, members: int) -> NDArray[np.int64]:
        """Return the rows of the sets with this number of members."""
        return np.flatnonzero(self.sizes == members)

    def most_robust(self, sets: SetTable, *, max_members: int = MOST_MEMBERS) -> tuple[int, ...]:
        """Return the configuration indices of the most robust set; () if there is none.

        The most robust set has the greatest lower confidence bound on its success: by the mean
        alone, a set with few, favourable samples could outrank a good set with many. Ties go to
        the greatest P_R + P_M, then to the first.

        Args:
            sets: The sets whose success is estimated here.
            max_members: Greatest number of members of the set.
        """
        rows = np.flatnonzero(self.sizes <= max_members)
        if not rows.size:
            return ()
        rows = rows[self.low[rows] == self.low[rows].max()]
        scores = [sum(sets.scores_of(self.set_at(int(row)))) for row in rows]
        return self.set_at(int(rows[np.argmax(scores)]))

    def set_at(self, row: int) -> tuple[int, ...]:
        """Return the configuration indices of a set."""
        return tuple(int(h) for h in self.members[row] if h != NO_MEMBER)

    def row_of(self, members: tuple[int, ...]) -> int | None:
        """Return the row of a set, given ascending configuration indices; None if it has none."""
        if len(members) > self.members.shape[1]:
            return None
        wanted = np.full(self.members.shape[1], NO_MEMBER, dtype=np.int32)
        wanted[: len(members)] = members
        found = np.flatnonzero(np.all(self.members == wanted, axis=1))
        return int(found[0]) if found.size else None

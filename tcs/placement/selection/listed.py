"""Sets that are compared one by one: those with an estimated success, and the refined ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.placement.constraints import Constraints
from tcs.placement.selection.index import SetIndex
from tcs.placement.tables import SetTable, SuccessTable
from tcs.placement.tables.success import NO_MEMBER

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ListedSets:
    """K sets of candidates, in the order in which the first of equals is taken."""

    members: IntArray
    """Candidate numbers of the members, NO_MEMBER after the last, shape (K, m)."""
    low: FloatArray | None
    """Lower confidence bound of their success under error, shape (K,); None without estimates."""

    @classmethod
    def estimated(cls, success: SuccessTable | None, index: SetIndex) -> ListedSets:
        """Return the sets of the grid with an estimate.

        Raises:
            SelectionError: If no set has one.
        """
        if success is None:
            raise SelectionError(
                "Weight delta requires success under error, which was not estimated for any set of "
                "this table. Estimate it first: tcs robustify FILE."
            )
        rows = np.searchsorted(index.sets.candidates, success.members)
        return cls(np.where(success.members == NO_MEMBER, NO_MEMBER, rows), success.low)

    @classmethod
    def refined(cls, index: SetIndex) -> ListedSets:
        """Return the refined sets of the candidates; () if they are not compared."""
        estimates = None if index.refined is None else index.refined.success
        return cls(index.refined_rows, None if estimates is None else estimates.low)

    def of_size(self, size: int) -> tuple[IntArray, tuple[IntArray, ...]]:
        """Return the numbers of the sets of m members (n,), and these by column, shapes (n,)."""
        rows = np.flatnonzero(np.count_nonzero(self.members != NO_MEMBER, axis=1) == size)
        return rows, tuple(np.ascontiguousarray(c) for c in self.members[rows, :size].T)


def none_estimated(max_members: int) -> SelectionError:
    """Return the error that no set with an estimate is admitted."""
    return SelectionError(
        "No set whose success under error was estimated is reachable from here and satisfies "
        f"the constraints with at most {max_members} members. Use --delta 0, or estimate more "
        "sets: tcs robustify FILE --sets."
    )


def check_estimated(sets: SetTable, success: SuccessTable | None, max_members: int) -> None:
    """Refuse to select triples by success if only smaller sets have estimates.

    Raises:
        SelectionError: If there are triples, and none has an estimate.
    """
    if max_members < 3 or success is None or sets.triples is None or not sets.triples.kept:
        return
    if not success.of_size(3).size:
        raise SelectionError(
            "max_members is 3 and weight delta above 0, but success under error was not estimated "
            "for any set of three. Use max_members 2, or delta 0."
        )


def answered_by_grid(constraints: Constraints, *, limbs: bool, motions: bool) -> list[str]:
    """Return what is requested that only the sets of the grid can answer, for a warning.

    Args:
        constraints: Constraints of the selection.
        limbs: Whether limbs are observed in several tables.
        motions: Whether only goals with a motion count.
    """
    requested = {
        "obstacles": bool(constraints.blocked),
        "preferences": bool(constraints.prefer),
        "limbs in several tables": limbs,
        "motions": motions,
    }
    return [name for name, wanted in requested.items() if wanted]

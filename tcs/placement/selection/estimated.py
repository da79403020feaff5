"""Selection among the sets with an estimated success under error: few enough to evaluate all."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.placement.selection.alternatives import Distinct
from tcs.placement.selection.branch_and_bound import tour_costs
from tcs.placement.selection.penalties import Penalties
from tcs.placement.selection.travel import Legs
from tcs.placement.selection.utility import UtilityWeights, utility
from tcs.placement.tables import SetTable, SuccessTable, tc_manipulability, tc_reachability


class Candidates(NamedTuple):
    """Which candidates may be selected, and what they reach."""

    admitted: NDArray[np.bool_]
    """Whether a candidate may be selected, shape (C,)."""
    reached: NDArray[np.bool_]
    """Whether it reaches a goal, shape (C, G)."""
    dexterity: NDArray[np.float32]
    """Its dexterity there, shape (C, G)."""
    penalties: Penalties | None
    """Penalties of the sets."""
    distinct: Distinct | None
    """Sets from which others must differ."""


def best_estimated(
    sets: SetTable,
    success: SuccessTable | None,
    legs: Legs,
    weights: UtilityWeights,
    max_members: int,
    candidates: Candidates,
) -> tuple[int, ...] | None:
    """Return the set with an estimate that has the greatest utility, the first among equals.

    Args:
        sets: The kept sets.
        success: Estimates for some of them, if there are any.
        legs: Travel costs from the current state.
        weights: alpha, beta, gamma, delta.
        max_members: Greatest number of members of a set.
        candidates: Which candidates may be selected, and what they reach.

    Returns:
        Candidate numbers of its members, ascending; None if no set with an estimate is admitted and
        differs from those that it must differ from.

    Raises:
        SelectionError: If no set has an estimate.
    """
    if success is None:
        raise SelectionError(
            "Weight delta requires success under error, which was not estimated for any set of "
            "this table. Estimate it first: tcs robustify FILE."
        )
    best: tuple[int, ...] | None = None
    most = -np.inf
    for size in range(1, max_members + 1):
        rows = success.of_size(size)
        members = np.searchsorted(sets.candidates, success.members[rows, :size])
        feasible = np.all(candidates.admitted[members], axis=1)
        if candidates.distinct is not None:
            feasible &= candidates.distinct.of_sets(tuple(members.T))
        rows, members = rows[feasible], members[feasible]
        if not rows.size:
            continue
        found = _utilities(
            sets.weights, candidates, success.low[rows], legs, weights.of_size(size), members
        )
        first = int(np.argmax(found))
        # The table is sorted in the order that breaks ties.
        if found[first] > most:
            most = float(found[first])
            best = tuple(int(i) for i in members[first])
    return best


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


def _utilities(
    of_goals: NDArray[np.float64],
    candidates: Candidates,
    success: NDArray[np.float64],
    legs: Legs,
    weights: UtilityWeights,
    members: NDArray[np.intp],
) -> NDArray[np.float64]:
    """Return the utility of sets of one size, given their candidate numbers (n, size)."""
    columns = tuple(np.ascontiguousarray(column) for column in members.T)
    reached = np.logical_or.reduce([candidates.reached[column] for column in columns], axis=0)
    dexterity = np.maximum.reduce([candidates.dexterity[column] for column in columns], axis=0)
    found = utility(
        tc_reachability(reached, of_goals),
        tc_manipulability(dexterity, of_goals),
        tour_costs(legs, columns),
        weights,
        success,
    )
    if candidates.penalties is not None:
        found = found - candidates.penalties.of_sets(columns)
    return found

"""Goals on limbs that are observed one by one: each goal by the table nearest to its own frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.placement.constraints import Constraints
from tcs.placement.selection.admission import Admitted
from tcs.placement.selection.observed import Match
from tcs.placement.store import ScoreFile, StateTables

IntArray = NDArray[np.intp]


def tables_of_goals(file: ScoreFile, match: Match) -> tuple[int, ...]:
    """Return the number of the table that counts for each goal.

    It is the nearest table of the goal's own frame if that is one of several observed ones, else
    the table that is nearest to all.

    Args:
        file: The score file.
        match: The observation.
    """
    own: dict[object, int] = {one.frame: one.index for one in match.by_frame}
    listed = file.task.get("goals")
    goals = listed if isinstance(listed, list) else []
    frames = [goal.get("body_frame") if isinstance(goal, dict) else None for goal in goals]
    count = file.tables[match.index].sets.weights.size
    if len(frames) != count:
        return (match.index,) * count
    return tuple(own.get(frame, match.index) for frame in frames)


def admitted_at_limbs(
    file: ScoreFile, match: Match, constraints: Constraints, admitted: Admitted | None
) -> Admitted | None:
    """Return the candidates with what they reach where each limb is.

    A goal counts as reached if it is reached in the table nearest to all frames and in the one
    nearest to its own frame; its dexterity is the lesser of both.

    Args:
        file: The score file.
        match: The observation.
        constraints: The constraints of the selection.
        admitted: The candidates of the table nearest to all frames that satisfy the constraints;
            None for all.

    Returns:
        The candidates; `admitted` if every goal is in the one table.

    Raises:
        SelectionError: If an obstacle is given too, or no candidate reaches a goal.
    """
    tables = tables_of_goals(file, match)
    if all(table == match.index for table in tables):
        return admitted
    if constraints.blocked:
        raise SelectionError(
            "Limbs are observed in different places, so the stored arm solutions are not those of "
            "one table, and obstacles cannot be tested with them. Score the scene as it is: "
            "tcs score TASK --frames ... --blocked ..."
        )
    sets = file.tables[match.index].sets
    everything = np.ones(len(sets.candidates), dtype=np.bool_)
    found = admitted or Admitted(everything, sets.reached, sets.dexterity, (), (), None)
    # One contiguous row for each goal.
    reached, dexterity = found.reached.T.copy("C"), found.dexterity.T.copy("C")
    for goal, table in enumerate(tables):
        if table != match.index:
            other = file.tables[table].sets
            mine, theirs = _common(file.tables[match.index], file.tables[table])
            still = np.zeros(reached.shape[1], dtype=np.bool_)
            still[mine] = other.reached[theirs, goal]
            reached[goal] &= still
            lesser = np.minimum(dexterity[goal, mine], other.dexterity[theirs, goal])
            dexterity[goal, mine] = lesser
    dexterity[~reached] = 0.0
    reached, dexterity = reached.T, dexterity.T
    remaining = found.candidates & reached.any(axis=1)
    if not np.any(remaining):
        raise SelectionError(
            "With the limbs where they are observed, no initial configuration reaches a goal. "
            "Score the scene as it is: tcs score TASK --frames ..."
        )
    return replace(
        found, candidates=remaining, reached=reached, dexterity=dexterity, has_lower_scores=True
    )


def _common(sets: StateTables, other: StateTables) -> tuple[IntArray, IntArray]:
    """Return the numbers of the candidates that two tables share, in the one and in the other.

    They are kept for the next selection.
    """
    known = sets.derived.setdefault("shared candidates", {})
    candidates = other.sets.candidates
    if id(candidates) not in known:
        mine, theirs = np.intersect1d(
            sets.sets.candidates, candidates, assume_unique=True, return_indices=True
        )[1:]
        # The array is kept as well, so that no other one can have its number.
        known[id(candidates)] = candidates, mine, theirs
    _, mine, theirs = known[id(candidates)]
    return mine, theirs

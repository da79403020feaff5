"""Goals on limbs that are observed one by one: each goal by the table nearest to its own frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.placement.constraints import Constraints
from tcs.placement.selection.admission import Admitted, blocked_pairs
from tcs.placement.selection.choice import SelectionTables
from tcs.placement.selection.observed import Match
from tcs.placement.store import ScoreFile, StateTables
from tcs.placement.tables import Reason, ScoreTable

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
    nearest to its own frame, in both by a stored solution that no obstacle blocks; its dexterity
    is the lesser of both.

    Args:
        file: The score file.
        match: The observation.
        constraints: The constraints of the selection.
        admitted: The candidates of the table nearest to all frames that satisfy the constraints;
            None for all.

    Returns:
        The candidates; `admitted` if every goal is in the one table.

    Raises:
        SelectionError: If no candidate reaches a goal, or an obstacle is given and the robot's
            shapes are not known.
    """
    tables = tables_of_goals(file, match)
    if all(table == match.index for table in tables):
        return admitted
    sets = file.tables[match.index].sets
    everything = np.ones(len(sets.candidates), dtype=np.bool_)
    found = admitted or Admitted(everything, sets.reached, sets.dexterity, (), (), None)
    # One contiguous row for each goal.
    reached, dexterity = found.reached.T.copy("C"), found.dexterity.T.copy("C")
    still_there = {
        table: _unblocked(file, match.index, table, constraints, found.candidates)
        for table in set(tables) - {match.index}
    }
    for goal, table in enumerate(tables):
        if table != match.index:
            other = file.tables[table].sets
            mine, theirs = _common(file.tables[match.index], file.tables[table])
            still = np.zeros(reached.shape[1], dtype=np.bool_)
            still[mine] = still_there[table][theirs, goal]
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


def _unblocked(
    file: ScoreFile,
    table: int,
    other: int,
    constraints: Constraints,
    admitted: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return what candidates of another table reach by solutions that no obstacle blocks.

    Args:
        file: The score file.
        table: Number of the table that supplies the candidates.
        other: Number of the other table.
        constraints: The constraints of the selection.
        admitted: Which candidates satisfy them, shape (C,); others are not tested.

    Returns:
        Reached goals of the candidates of the other table, shape (C', G).
    """
    tables = SelectionTables.of(file, other)
    reached = tables.sets.reached
    if not constraints.blocked:
        return reached
    mine, theirs = _common(file.tables[table], file.tables[other])
    tested = np.zeros(len(reached), dtype=np.bool_)
    tested[theirs] = admitted[mine]
    reached = reached.copy()
    for obstacle in constraints.blocked:
        reached[blocked_pairs(obstacle, tables.postures, tested)] = False
    return reached


def scores_at_limbs(file: ScoreFile, match: Match) -> ScoreTable:
    """Return the scores of every configuration where each limb is.

    A goal that is reached in the table nearest to all frames, but not in the one nearest to its own
    frame, has the reason and the bodies in contact of the latter.

    Args:
        file: The score file.
        match: The observation.
    """
    common = file.tables[match.index].scores
    tables = tables_of_goals(file, match)
    others = {table: file.tables[table].scores for table in set(tables) - {match.index}}
    if not others:
        return common
    every = (common, *others.values())
    names = tuple(dict.fromkeys(pair for scores in every for pair in scores.pair_names))
    dexterity, reason = common.dexterity.copy(), common.reason.copy()
    pair = _renumbered(common, names)
    for goal, table in enumerate(tables):
        if table == match.index:
            continue
        other = others[table]
        lost = common.reached[:, goal] & ~other.reached[:, goal]
        reason[lost, goal] = other.reason[lost, goal]
        pair[lost, goal] = _renumbered(other, names)[lost, goal]
        np.minimum(dexterity[:, goal], other.dexterity[:, goal], out=dexterity[:, goal])
    return ScoreTable(
        dexterity=dexterity,
        reason=reason,
        pair=pair,
        pair_names=names,
        arm_joints=common.arm_joints[reason[common.reached] == Reason.REACHED],
        weights=common.weights,
        hand=common.hand,
    )


def _renumbered(scores: ScoreTable, names: tuple[tuple[str, str], ...]) -> NDArray[np.int32]:
    """Return the pairs of bodies in contact as indices into other names, -1 for none."""
    number = {pair: i for i, pair in enumerate(names)}
    # The last entry stands for -1.
    return np.array([*(number[n] for n in scores.pair_names), -1], dtype=np.int32)[scores.pair]


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

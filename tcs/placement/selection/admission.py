"""Candidates that are admitted: by constraints, by motions that were found, by observed limbs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.placement.constraints import (
    Constraints,
    Footprint,
    Obstacle,
    Postures,
    axis_constraints,
    blocked_bodies,
    blocked_solutions,
)
from tcs.placement.selection.choice import Choice, Left, SelectionTables
from tcs.placement.selection.index import SetIndex
from tcs.placement.selection.observed import Match
from tcs.placement.selection.travel import current_values
from tcs.placement.store import MotionFile, ScoreFile, StateTables
from tcs.placement.tables import MotionTable, Reason, ScoreTable, SetTable, tc_reachability

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Admitted:
    """The candidates that satisfy all constraints, and what they still reach."""

    candidates: BoolArray
    """Whether a candidate satisfies them, shape (C + M,): see `SetIndex`."""
    reached: BoolArray
    """Whether a candidate reaches a goal by a solution that no obstacle blocks, (C + M, G)."""
    dexterity: NDArray[np.float32]
    """Its dexterity there, 0 where not reached, shape (C + M, G)."""
    left: tuple[Left, ...]
    """What each constraint leaves."""
    warnings: tuple[str, ...]
    """What the user should know about the constraints."""
    footprint: Footprint | None
    """The floor that the robot covers; None without forbidden regions."""

    has_lower_scores: bool = False
    """Whether `reached` and `dexterity` may be less than those of the sets."""


def admitted_candidates(
    constraints: Constraints,
    here: InitialConfiguration | None,
    tables: SelectionTables,
    index: SetIndex,
) -> Admitted:
    """Return the candidates that satisfy all constraints.

    Args:
        constraints: The constraints.
        here: The current state, for `keep`; None if it is not known.
        tables: The table that they are of.
        index: The candidates; what a constraint leaves is counted on the grid.

    Raises:
        UnknownNameError: If the grid has no such axis.
        GridError: If a condition has another unit than its axis, or excludes all its values.
        SelectionError: If the current state is not known or lacks an axis to keep, or is beyond
            the scored values, an obstacle is given and the robot's shapes are not known, or no
            candidate is left.
    """
    grid, count = tables.grid, index.on_grid
    remaining = np.ones(len(index.flat), dtype=np.bool_)
    reached, dexterity = index.reached_goals, index.dexterity_at
    left: list[Left] = []
    warnings: list[str] = []
    now = {}
    if constraints.keep:
        if here is None:
            raise SelectionError(
                f"Keeping {', '.join(constraints.keep)} requires the current state. Give --here, "
                "with --torso and --at."
            )
        now = current_values(here, grid, ())
    of_axes = list(axis_constraints(constraints, now, grid))
    along = grid.indices(index.sets.candidates) if of_axes else np.empty((0, 0), np.int64)
    for name, axis, admitted, admits, warning in of_axes:
        number = grid.axes.index(axis)
        remaining[:count] &= admitted[along[:, number]]
        remaining[count:] &= admits(index.off_grid[:, number])
        warnings += [warning] if warning else []
        _note(left, Left(name, _count(remaining[:count])), count)
    footprint = Footprint.of(tables.shapes) if constraints.forbid else None
    if footprint is not None:
        base, which = _bases(index)
        for region in constraints.forbid:
            remaining &= ~footprint.overlaps(region, base)[which]
            _note(left, Left(f"forbid {region.name}", _count(remaining[:count])), count)
        if footprint.radius:
            warnings.append(
                "forbid: the robot's shapes are not stored, so it counts as a circle of "
                f"{footprint.radius:g} m about its base. Score the task again for its footprint."
            )
    for obstacle in constraints.blocked:
        candidate, goal = blocked_pairs(obstacle, tables.postures, remaining)
        reached, dexterity = reached.copy(), dexterity.copy()
        reached[candidate, goal], dexterity[candidate, goal] = False, 0.0
        remaining &= reached.any(axis=1)
        found = Left(f"blocked {obstacle.name}", _count(remaining), _count(reached[remaining]))
        _note(left, found, count)
    return Admitted(
        remaining, reached, dexterity, tuple(left), tuple(warnings), footprint,
        has_lower_scores=bool(constraints.blocked),
    )  # fmt: skip


def blocked_pairs(
    obstacle: Obstacle, hands: Sequence[Postures], admitted: BoolArray
) -> tuple[IntArray, IntArray]:
    """Return candidates and goals whose stored solution an obstacle blocks, shapes (n,).

    It blocks all solutions of a hand where it touches the robot's body as it is with that hand.

    Args:
        obstacle: The obstacle.
        hands: Postures of each hand.
        admitted: Candidates to examine, shape (C,).
    """
    candidates, goals = [], []
    for postures in hands:
        body = blocked_bodies(obstacle, postures)
        candidate, goal = postures.pairs
        hit = blocked_solutions(obstacle, postures, admitted & ~body)
        hit |= (body & admitted)[candidate]
        candidates.append(candidate[hit])
        goals.append(goal[hit])
    return np.concatenate(candidates), np.concatenate(goals)


def _bases(index: SetIndex) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the distinct base poses (U, 3) [m, m, rad], and that of each candidate (C + M,)."""
    grid, candidates, names = index.grid, index.sets.candidates, ("base_x", "base_y", "base_yaw")
    # Neither the environment's state nor the torso level, the fastest axis, moves the base.
    pose = candidates.astype(np.int64) % grid.state_size // grid.shape[-1]
    _, first, which = np.unique(pose, return_index=True, return_inverse=True)
    at = grid.values(candidates[first])
    off_grid = index.off_grid[:, [grid.axes.index(grid.axis(name)) for name in names]]
    base = np.concatenate([np.stack([at[name] for name in names], axis=1), off_grid])
    return base, np.concatenate([which, first.size + np.arange(len(off_grid))])


def _count(remaining: BoolArray) -> int:
    return int(np.count_nonzero(remaining))


def _note(left: list[Left], found: Left, candidates: int) -> None:
    """Record what a constraint leaves; refuse one that leaves no candidate."""
    before = f"the {candidates:,} that reach a goal"
    if left:
        before = f"the {left[-1].configurations:,} that '{left[-1].constraint}' leaves"
    left.append(found)
    if not found.configurations:
        raise SelectionError(
            f"No initial configuration is left: '{found.constraint}' excludes all of {before}. "
            "Relax a constraint, or score a grid that covers it."
        )


def motions_at(file: ScoreFile, motions: MotionFile, match: Match) -> MotionTable:
    """Return the motions that were planned for the table of an observation.

    Args:
        file: The score file.
        motions: Its motions.
        match: The table that selection uses.

    Raises:
        StoreMismatchError: If the motions were planned for other scores.
        SelectionError: If none were planned for this table, or limbs are observed one by one.
    """
    motions.check_belongs(file)
    table = motions.tables[match.index]
    if table is None:
        raise SelectionError(
            "No motions were planned for the observed state. Plan them: tcs motions FILE with "
            "--observed."
        )
    if any(one.index != match.index for one in match.by_frame):
        raise SelectionError(
            "Limbs are observed in different places, but motions were planned for one table. Give "
            "one frame, or plan for the set that is selected: tcs plan."
        )
    return table


def admitted_executable(
    table: MotionTable, sets: SetTable, constraints: Constraints, admitted: Admitted | None
) -> Admitted:
    """Return the examined candidates from which some goal can be done, with those goals alone.

    Args:
        table: The motions.
        sets: The candidates.
        constraints: The constraints of the selection.
        admitted: The candidates that satisfy them; None for all.

    Raises:
        SelectionError: If an obstacle is given too, or no candidate is left.
    """
    if constraints.blocked:
        raise SelectionError(
            "Motions were planned without the further obstacles. Score the scene with them "
            "(tcs score ... --blocked) and plan its motions (tcs motions)."
        )
    done = done_by_candidate(table, sets)
    everything = np.ones(len(sets.candidates), dtype=np.bool_)
    found = admitted or Admitted(everything, sets.reached, sets.dexterity, (), (), None)
    reached = found.reached & done
    remaining = found.candidates & reached.any(axis=1)
    if not np.any(remaining):
        raise SelectionError(
            "From no examined configuration that the constraints leave can a goal be done. Examine "
            "more: tcs motions FILE with a greater --within, or --pairs."
        )
    dexterity = np.where(reached, found.dexterity, np.float32(0.0))
    return replace(
        found, candidates=remaining, reached=reached, dexterity=dexterity, has_lower_scores=True
    )


def done_by_candidate(table: MotionTable, sets: SetTable) -> NDArray[np.bool_]:
    """Return whether each goal can be done from each candidate, False if not examined, (C, G)."""
    done = np.zeros(sets.reached.shape, dtype=np.bool_)
    known = np.isin(sets.candidates, table.configurations)
    rows = np.searchsorted(table.configurations, sets.candidates[known])
    done[known] = table.done[rows]
    return done


@dataclass(frozen=True, kw_only=True)
class Executability:
    """What it costs to choose among sets that can be executed."""

    examined: int
    """Number of candidates for which motions were planned."""
    candidates: int
    """Number of all candidates."""
    goals_done: tuple[int, ...]
    """Goals that the chosen set can do."""
    by_postures: Choice
    """The set that would be chosen if every goal that a posture reaches could be done."""
    is_examined: bool
    """Whether motions were planned for all members of that set."""
    reachability_done: float
    """P_R of that set over the goals for which a motion was found."""

    @classmethod
    def of(
        cls, file: ScoreFile, motions: MotionFile, chosen: Choice, by_postures: Choice
    ) -> Executability:
        """Compare a set that `select` chose from a file with motions with the one without.

        Raises:
            SelectionError: If no motions were planned for the table of the sets.
        """
        if chosen.match is None:
            raise SelectionError("The set was not selected from a score file.")
        table = motions_at(file, motions, chosen.match)
        sets = file.tables[chosen.match.index].sets
        done = done_by_candidate(table, sets)

        def goals(choice: Choice) -> NDArray[np.bool_]:
            rows = np.searchsorted(sets.candidates, choice.indices)
            return np.asarray(np.any(done[rows], axis=0))

        return cls(
            examined=int(np.count_nonzero(np.isin(sets.candidates, table.configurations))),
            candidates=len(sets.candidates),
            goals_done=tuple(np.flatnonzero(goals(chosen)).tolist()),
            by_postures=by_postures,
            is_examined=bool(np.all(np.isin(by_postures.indices, table.configurations))),
            reachability_done=float(tc_reachability(goals(by_postures), sets.weights)),
        )

    def to_json(self, chosen: Choice) -> dict[str, Any]:
        """Return the comparison as plain containers.

        Args:
            chosen: The chosen set; `costs` is what the other one has more.
        """
        names = ("reachability", "manipulability", "utility")
        other = self.by_postures
        return {
            "examined": self.examined,
            "candidates": self.candidates,
            "goals_done": list(self.goals_done),
            "by_postures": {
                "members": [other.members[i].to_json() for i in other.order],
                **{name: round(getattr(other, name), 12) for name in names},
                "examined": self.is_examined,
                "reachability_done": round(self.reachability_done, 12)
                if self.is_examined
                else None,
            },
            "costs": {
                name: round(getattr(other, name) - getattr(chosen, name), 12) for name in names
            },
        }


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

"""The floor of a score file: the best scores at each base position, and the outcome at one."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.model.grid import Grid, InitialConfiguration
from tcs.output.words import (
    REASON_TEXTS,
    frames_of_state,
    goal_names,
    pair_text,
    relative_place,
    text_of_goal,
)
from tcs.placement.reasons import nearest_configuration
from tcs.placement.store import MotionFile, ScoreFile
from tcs.placement.tables import Reason, ScoreTable
from tcs.placement.tables.equations import tc_manipulability, tc_reachability
from tcs.placement.tables.place_map import PlaceMap
from tcs.placement.tables.success import NO_MEMBER

_DECIMALS = 4
"""Decimals of scores on a map."""
_SAME = 1e-6
"""Difference of two positions [m or rad] that is rounding."""


def floor_of(
    file: ScoreFile, table: int, state: int, motions: MotionFile | None = None
) -> dict[str, Any]:
    """Return the best scores at each base position in one state of the environment.

    Args:
        file: A score file.
        table: Number of its table.
        state: Number of the state of the environment, in C order over its axes.
        motions: The motions that were found for the file, if any.

    Returns:
        `x` and `y` of the positions [m]; `reachability`, `manipulability` and `free` (whether the
        base touches nothing) as lists over x of lists over y; `states`, the settings of every state
        of the environment; `frames`, the positions of the body frames [m]; `success`, where it was
        estimated, of the best set with a base there, and `motion`, where motions were examined, the
        greatest weight of the goals that can be done, both None elsewhere.

    Raises:
        GridError: If there is no such state.
    """
    grid, scores = file.configurations, file.tables[table].scores
    places = PlaceMap.of_state(scores, grid, state)
    return {
        "state": state,
        "states": [settings_of_state(grid, i) for i in range(_states(grid))],
        "x": np.round(places.x, 6).tolist(),
        "y": np.round(places.y, 6).tolist(),
        "reachability": np.round(places.reachability, _DECIMALS).tolist(),
        "manipulability": np.round(places.manipulability, _DECIMALS).tolist(),
        "free": places.free.astype(int).tolist(),
        "frames": frames_of_state(file, table, state),
        "headings_deg": np.round(np.degrees(grid.axis("base_yaw").values), 6).tolist(),
        "torsos": np.round(grid.axis("torso").values, 6).tolist(),
        "measure": file.metadata["measure"],
        **_success_at_places(file, table, state),
        **_motion_at_places(file, table, state, motions),
    }


def _success_at_places(file: ScoreFile, table: int, state: int) -> dict[str, Any]:
    """Return the success of the best estimated set with a base at each position, under `success`.

    The entry is missing where no set with a base in this state was estimated.
    """
    estimated = file.tables[table].success
    if estimated is None:
        return {}
    rows, _ = np.nonzero(estimated.members != NO_MEMBER)
    members = estimated.members[estimated.members != NO_MEMBER]
    return _at_places("success", file.configurations, state, members, estimated.success[rows])


def _motion_at_places(
    file: ScoreFile, table: int, state: int, motions: MotionFile | None
) -> dict[str, Any]:
    """Return the greatest weight of goals with a motion at each position, under `motion`.

    The entry is missing where nothing was examined in this state.
    """
    found = None if motions is None else motions.tables[table]
    if found is None:
        return {}
    done = tc_reachability(found.done, file.tables[table].scores.weights)
    return _at_places("motion", file.configurations, state, found.configurations, done)


def _at_places(
    name: str, grid: Grid, state: int, configurations: NDArray[np.int32], values: NDArray[Any]
) -> dict[str, Any]:
    """Return the greatest value at each base position in a state; None where none is known."""
    of_state = grid.state_of(configurations.astype(np.int64)) == state
    if not np.any(of_state):
        return {}
    along = grid.indices(configurations[of_state].astype(np.int64))
    names = [axis.name for axis in grid.axes]
    x, y = (along[:, names.index(axis)] for axis in ("base_x", "base_y"))
    best = np.full((grid.axis("base_x").count, grid.axis("base_y").count), -1.0)
    np.maximum.at(best, (x, y), values[of_state])
    best = np.round(best, _DECIMALS)
    return {name: [[None if v < 0.0 else v for v in row] for row in best.tolist()]}


def settings_of_state(grid: Grid, state: int) -> dict[str, float]:
    """Return the settings of a state of the environment, angles under names in `_deg`."""
    plain = grid.configuration(state * grid.state_size).to_json()
    axes = {f"{a.name}_deg" if a.unit == "deg" else a.name for a in grid.environment_axes}
    return {name: value for name, value in plain.items() if name in axes}


def outcome_of(
    file: ScoreFile, table: int, stated: InitialConfiguration, *, best: bool = False
) -> dict[str, Any]:
    """Return what is reached from a base pose.

    Args:
        file: A score file.
        table: Number of its table.
        stated: The configuration; the nearest one of the grid is read.
        best: Whether to take the heading and the torso height with the greatest P_R + P_M at that
            base position, where any goal is reached from it.

    Returns:
        The configuration that was read, the place relative to the person, its scores, and `goals`:
        for each its name, its number among those on the same body frame (`place`, from 1), whether
        it is reached, and the reason. `refined` is true where a member of a refined set is exactly
        there; then the outcome is its own, and goals that it does not reach have the reason
        "unreached".

    Raises:
        SelectionError: If a value is not finite, or an axis is missing or exceeded.
        UnknownNameError: If an environment axis has no such name.
    """
    grid, scores = file.configurations, file.tables[table].scores
    index, _ = nearest_configuration(grid, stated)
    if best:
        index = _best_at(grid, scores, index)
    goals = [_goal(file, scores, index, goal) for goal in range(scores.goals)]
    reached, dexterity = scores.reached[index], scores.dexterity[index]
    state = int(grid.state_of(np.array([index]))[0])
    member, refined = grid.configuration(index), None if best else _refined_at(file, table, stated)
    if refined is not None:
        member, reached, dexterity = refined
        goals = [
            {**goal, **_refined_goal(bool(reached[i]), float(dexterity[i]))}
            for i, goal in enumerate(goals)
        ]
    place = relative_place(
        member.base_x, member.base_y, member.base_yaw, frames_of_state(file, table, state)
    )
    count = int(reached.sum())
    summary = f"{count} of {len(goals)} places reached."
    return {
        "configuration": index,
        "state": state,
        "members": [member.to_json()],
        "place": None
        if place is None
        else {"side": place.side, "beside": place.beside, "facing": place.facing},
        "sentence": summary if place is None else f"{place.text} {summary}",
        "reached": count,
        "reachability": round(float(tc_reachability(reached, scores.weights)), 12),
        "manipulability": round(float(tc_manipulability(dexterity, scores.weights)), 12),
        "goals": goals,
        "refined": refined is not None,
        "measure": file.metadata["measure"],
    }


def _refined_at(
    file: ScoreFile, table: int, stated: InitialConfiguration
) -> tuple[InitialConfiguration, NDArray[np.bool_], NDArray[np.float32]] | None:
    """Return the member of a refined set that is exactly where stated, and what it reaches."""
    refined = file.tables[table].refined
    if refined is None:
        return None
    axes = file.configurations.axes
    known = dict(stated.environment)
    at = [known[axis.name] if axis.name in known else getattr(stated, axis.name) for axis in axes]
    away = refined.values - np.array(at)
    for i, axis in enumerate(axes):
        if axis.name == "base_yaw":
            away[..., i] = np.sin(0.5 * away[..., i])
    found = np.argwhere(np.all(np.abs(away) < _SAME, axis=-1) & (refined.origin != NO_MEMBER))
    if not len(found):
        return None
    row, i = found[0]
    return stated, refined.reached[row, i], refined.dexterity[row, i]


def _refined_goal(is_reached: bool, dexterity: float) -> dict[str, Any]:
    """Return the outcome at a goal from a refined place, for which no reason is kept."""
    reason = Reason.REACHED.name.lower() if is_reached else "unreached"
    words = REASON_TEXTS[Reason.REACHED] if is_reached else "not reached"
    return {
        "reached": is_reached,
        "reason": reason,
        "words": words,
        "pair": None,
        "dexterity": dexterity,
    }


def _best_at(grid: Grid, scores: ScoreTable, index: int) -> int:
    """Return the configuration with the best heading and torso height at the same base position."""
    along = grid.indices(np.array([index]))[0].tolist()
    names = [axis.name for axis in grid.axes]
    free = [names.index("base_yaw"), names.index("torso")]
    candidates = []
    for values in itertools.product(*(range(grid.axes[i].count) for i in free)):
        for i, value in zip(free, values, strict=True):
            along[i] = value
        candidates.append(int(grid.flat(along)))
    found = np.array(candidates)
    worth = tc_reachability(scores.reached[found], scores.weights)
    worth = worth + tc_manipulability(scores.dexterity[found], scores.weights)
    return int(found[np.argmax(worth)]) if worth.max() > 0.0 else index


def _goal(file: ScoreFile, scores: ScoreTable, row: int, goal: int) -> dict[str, Any]:
    """Return the outcome at a goal, by the best hand."""
    reason = Reason(scores.reason[row, goal])
    number = int(scores.pair[row, goal])
    pair = scores.pair_names[number] if number >= 0 else None
    contact = f" ({pair_text(pair)})" if pair is not None else ""
    frames = [text_of_goal(file.task, other, "body_frame") for other in range(goal + 1)]
    return {
        "goal": goal,
        "name": goal_names(file.task, goal + 1)[goal] or f"goal {goal + 1}",
        "given_name": text_of_goal(file.task, goal, "name"),
        "body_frame": frames[goal],
        "place": frames.count(frames[goal]),
        "reached": reason == Reason.REACHED,
        "reason": reason.name.lower(),
        "words": f"{REASON_TEXTS[reason]}{contact}",
        "pair": None if pair is None else list(pair),
        "dexterity": float(scores.dexterity[row, goal]),
        **({} if scores.hand is None else {"hand": file.hand_names[scores.hand[row, goal]]}),
    }


def _states(grid: Grid) -> int:
    return math.prod(grid.environment_shape)

"""The content of a score file: one task, scored, with the sets to choose from."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, StoreError
from tcs.files.plain import plain
from tcs.model.grid import Axis, Grid
from tcs.placement.store.robot_shapes import RobotShapes
from tcs.placement.tables import RefinedTable, ScoreTable, SetTable, SuccessTable, WindowTable
from tcs.placement.tables.sets import DISTANCE_TOLERANCE, candidates_of
from tcs.placement.tables.success import NO_MEMBER

REQUIRED_METADATA: dict[str, type] = {
    "program_version": str,
    "created": str,
    "task": str,
    "robot": str,
    "environment": str,
    "scene_digest": str,
    "measure": str,
    "timings": dict,
}
"""Keys that the metadata must have, and the type of each; there may be others."""

DESCRIPTIONS = ("metadata", "task", "robot", "environment", "grid", "body_frames")
"""Parts of a file that are plain containers."""

ARMS = "arms"
"""Entry of the metadata of a file whose goals may be reached by any arm of the robot: "both"."""

PERSON = "person"
"""Entry of the metadata: what is given of the person, their stature and mass, and the goals at
which the gripper touches them."""
OF_BODY = ("stature", "stature_percentile", "mass", "mass_percentile")
"""Numbers of the entry of a person with a body."""

HANDS = "hands"
"""Entry of the metadata of a file of several hands: of each its arm, tool, goals, description of
the robot, scene digest and others. A goal may be one of several hands, any of which counts."""
OF_HAND = ("scene_digest", "robot_shapes", "ik", "self_contact")
"""Entries of the metadata that differ between hands."""
APPROACH, WITHOUT_APPROACH = "approach", "no_approach"
"""Entries of the metadata: how a file was scored with approach, or why it was not where nobody
decided that."""
PAPER = "paper"
"""Entry of the metadata, true where a file was scored as the papers score tasks: each goal at its
own pose alone, without approach; what is done with the file later counts contacts as they do."""

WINDOWS = "windows"
"""Name of the parking windows among what is derived from tables."""

MAX_TABLES = 1000
"""Greatest number of observed states in a file; the tables of one take some megabytes."""


@dataclass(frozen=True, eq=False)
class StateTables:
    """Scores and sets of one observed state, e.g. of a person who lies 5 cm to the left.

    Scores are large and selection needs the sets alone, so a loaded file decodes the scores of a
    state on first access.
    """

    sets: SetTable
    """The sets to choose from."""
    read_scores: Callable[[], ScoreTable]
    """Returns the scores of every configuration at every goal."""
    success: SuccessTable | None = None
    """Estimated success of some of the sets under error, if `tcs robustify` estimated it."""
    refined: RefinedTable | None = None
    """Sets refined between the grid points, if `tcs refine` refined any."""
    windows: WindowTable | None = None
    """Parking windows of some of the stops, if `tcs select --parking` found any."""

    @classmethod
    def of(cls, scores: ScoreTable, sets: SetTable) -> Self:
        """Return the tables of scores in memory.

        Raises:
            StoreError: If the sets are not those of the scores.
        """
        check_sets_of(scores, sets)
        return cls(sets, partial(_same, scores))

    @cached_property
    def scores(self) -> ScoreTable:
        """Scores of every configuration at every goal.

        Raises:
            StoreFormatError: If the file they are read from is damaged there, or holds scores
                that do not belong to the sets.
        """
        return self.read_scores()

    @cached_property
    def derived(self) -> dict[str, Any]:
        """What other packages derived from the tables, by name, kept while the tables live."""
        return {}

    @property
    def known_windows(self) -> WindowTable | None:
        """The parking windows, with those that were found since the file was read."""
        found: WindowTable | None = self.derived.get(WINDOWS, self.windows)
        return found

    def keep_windows(self, windows: WindowTable) -> None:
        """Keep windows that were found while the tables live."""
        self.derived[WINDOWS] = windows

    def with_known_windows(self) -> Self:
        """Return the tables with the windows that were found as stored ones."""
        return replace(self, windows=self.known_windows)

    @property
    def refined_sets(self) -> RefinedTable:
        """The refined sets.

        Raises:
            SelectionError: If there are none.
        """
        if self.refined is None:
            raise SelectionError(
                "No sets of this table were refined. Refine them: tcs refine FILE."
            )
        return self.refined

    def refined_set(self, row: int) -> RefinedTable:
        """Return one of the refined sets as a table of it alone, as wide as it has members.

        Raises:
            SelectionError: If there is no such set.
        """
        refined = self.refined_sets
        if not 0 <= row < len(refined.origin):
            raise SelectionError(
                f"There is no refined set {row}; the table has {len(refined.origin)}, counted from "
                "0."
            )
        return refined.only(row)

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields alone: a copy decodes the scores itself if it needs them."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def _same(scores: ScoreTable) -> ScoreTable:
    """Return the scores; unlike a lambda, a partial of this can be pickled."""
    return scores


def check_sets_of(scores: ScoreTable, sets: SetTable) -> None:
    """Check that sets are those of the scores.

    Raises:
        StoreError: If they are not.
    """
    candidates = candidates_of(scores.reached, scores.weights, sets.rule)
    if sets.tile:
        # Some of them stand for the others.
        candidates = candidates[np.isin(candidates, sets.candidates)]
    if not (
        np.array_equal(sets.weights, scores.weights)
        and np.array_equal(sets.candidates, candidates)
        and np.array_equal(sets.reached, scores.reached[candidates])
        and np.array_equal(sets.dexterity, scores.dexterity[candidates])
        and _are_equal(sets.hand, None if scores.hand is None else scores.hand[candidates])
    ):
        raise StoreError("sets do not belong to the scores.")


@dataclass(frozen=True, kw_only=True, eq=False)
class ScoreFile:
    """Scores and sets of one task, with a description of what was scored."""

    metadata: dict[str, Any]
    """How the file was made: see `REQUIRED_METADATA`."""
    task: dict[str, Any]
    """The task as plain containers."""
    robot: dict[str, Any]
    """The robot as plain containers."""
    environment: dict[str, Any]
    """The environment as plain containers."""
    grid: dict[str, Any]
    """The grid as plain containers; `Grid.from_dict` reads it."""
    observed: list[dict[str, Any]]
    """The axes that can be observed and not set, e.g. the person's shift, as plain containers;
    `Axis.from_dict` reads them. Empty if there are none."""
    body_frames: dict[str, list[float]]
    """Position of each body frame in W [m]: x, y, z for each state of the observed axes and, within
    it, of the environment's axes, one after the other."""
    tables: tuple[StateTables, ...]
    """Scores and sets of each state of the observed axes, in C order; one if there are none."""

    def __post_init__(self) -> None:
        """Check the parts against each other.

        Raises:
            StoreError: If a part is not plain, a key of the metadata is missing, or grid, scores
                and sets do not belong together.
            GridError: If the grid or an observed axis is invalid.
        """
        for name in DESCRIPTIONS:
            copy = plain(name, getattr(self, name))
            if not isinstance(copy, dict):
                raise StoreError(f"{name} is {type(copy).__name__}; must be a dict.")
            object.__setattr__(self, name, copy)
        object.__setattr__(self, "observed", plain("observed", self.observed))
        object.__setattr__(self, "tables", tuple(self.tables))
        for key, expected in REQUIRED_METADATA.items():
            if not isinstance(self.metadata.get(key), expected):
                raise StoreError(f"metadata needs '{key}', of type {expected.__name__}.")
        only = self.metadata.get("only", [])
        if not isinstance(only, list) or not all(isinstance(text, str) for text in only):
            raise StoreError("metadata 'only' must be a list of conditions.")
        if self.metadata.get(ARMS, "both") != "both":
            raise StoreError(
                "The file is of an earlier version, in which each configuration used one of "
                "several arms. Score the task again: any arm may then serve any goal."
            )
        goals = self.task.get("goals")
        if isinstance(goals, list) and not all(map(_has_a_frame, goals)):
            raise StoreError("task needs the 'body_frame' of each goal, of type str.")
        if PERSON in self.metadata and not _is_person(self.metadata[PERSON]):
            raise StoreError(f"metadata '{PERSON}' is malformed.")
        self._check_hands()
        self._check_tables()
        records = self.metadata.get("robustness")
        if records is not None and (
            not isinstance(records, list) or len(records) != len(self.tables)
        ):
            raise StoreError("metadata 'robustness' must be a list with an entry for each table.")

    def _check_hands(self) -> None:
        """Check that the metadata describes each hand, and gives every goal to one at least."""
        entries = self.metadata.get(HANDS, [])
        keys = {"goals": list, "description": dict, "scene_digest": str, "arm": str, "tool": str}
        is_well_formed = isinstance(entries, list) and all(
            isinstance(entry, dict)
            and all(isinstance(entry.get(key), expected) for key, expected in keys.items())
            and all(type(goal) is int for goal in entry["goals"])
            for entry in entries
        )
        if not is_well_formed or (
            entries
            and (
                not self.tables
                or {goal for entry in entries for goal in entry["goals"]}
                != set(range(self.tables[0].sets.weights.size))
                or any(table.sets.hand is None for table in self.tables)
            )
        ):
            raise StoreError(
                f"metadata '{HANDS}' must give every goal to hands, each with {', '.join(keys)}, "
                "and the tables the hand of each goal."
            )

    def _check_tables(self) -> None:
        """Check that there are tables for each observed state, with sets of this grid."""
        if len(self.tables) != len(self.observed_states):
            raise StoreError(
                f"{len(self.tables)} tables for {len(self.observed_states)} observed states."
            )
        grid = Grid.from_dict(self.grid)
        numbers = 3 * len(self.tables) * math.prod(grid.environment_shape)
        for name, numbers_of in self.body_frames.items():
            if not _are_numbers(numbers_of, numbers):
                raise StoreError(f"body frame '{name}' must have {numbers} finite numbers.")
        for table in self.tables:
            sets = table.sets
            if len(sets.candidates) and sets.candidates[-1] >= grid.size:
                raise StoreError(f"sets of more configurations than the grid has, {grid.size}.")
            if sets.state_size != grid.state_size:
                raise StoreError("sets have another number of environment states than the grid.")
            _check_success(table.success, sets)
            _check_refined(table.refined, sets, grid)
            _check_windows(table.windows, sets, grid)
            places = grid.values(sets.candidates)
            for column, name in enumerate(("base_x", "base_y")):
                gap = np.abs(sets.cell_xy[sets.cell, column] - places[name])
                if np.any(gap > DISTANCE_TOLERANCE):
                    raise StoreError(
                        f"sets have base cells that are not those of the grid ({name})."
                    )

    @cached_property
    def configurations(self) -> Grid:
        """The grid of the initial configurations, `grid` as an object."""
        return Grid.from_dict(self.grid)

    @property
    def hands(self) -> tuple[dict[str, Any], ...]:
        """What is recorded of each hand; () in a file of one."""
        return tuple(self.metadata.get(HANDS, ()))

    @cached_property
    def hand_names(self) -> tuple[str, ...]:
        """Arm and tool of each hand as one name, e.g. "right+spoon"; () in a file of one."""
        return tuple(
            "+".join(part for part in (entry["arm"], entry["tool"]) if part) or "bare"
            for entry in self.hands
        )

    @cached_property
    def goals_of_hands(self) -> tuple[tuple[int, ...], ...]:
        """Numbers of the goals of each hand, of one hand in a file of one."""
        if not self.hands:
            return (tuple(range(self.nominal.sets.weights.size)),)
        return tuple(tuple(entry["goals"]) for entry in self.hands)

    def member_to_json(self, table: int, h: int) -> dict[str, Any]:
        """Return a candidate as plain containers, in a file of several hands with those it uses.

        `hand` is then the name of the hand that serves each goal, null where it is not reached.
        """
        plain: dict[str, Any] = {**self.configurations.configuration(h).to_json()}
        if self.hands:
            sets, names = self.tables[table].sets, (None, *self.hand_names)
            row = int(np.searchsorted(sets.candidates, h))
            plain["hand"] = [names[hand] for hand in sets.served[row].tolist()]
        return plain

    @cached_property
    def observed_axes(self) -> tuple[Axis, ...]:
        """The axes that can be observed and not set."""
        if not isinstance(self.observed, list) or not all(
            isinstance(axis, dict) for axis in self.observed
        ):
            raise StoreError("observed must be a list of axes.")
        axes = tuple(Axis.from_dict(axis, where="observed") for axis in self.observed)
        if math.prod(axis.count for axis in axes) > MAX_TABLES:
            raise StoreError(f"observed has more than {MAX_TABLES} states.")
        return axes

    @cached_property
    def observed_states(self) -> tuple[dict[str, float], ...]:
        """Values of the observed axes for each table, by name [m or rad]."""
        names = [axis.name for axis in self.observed_axes]
        states = itertools.product(*(axis.values.tolist() for axis in self.observed_axes))
        return tuple(dict(zip(names, state, strict=True)) for state in states)

    @cached_property
    def robot_shapes(self) -> RobotShapes | None:
        """The robot's collision shapes, with the first of several hands; None without them.

        Raises:
            StoreError: If they are malformed, or have other torso levels than the grid.
        """
        return self.shapes_of_hand(0)

    def shapes_of_hand(self, hand: int) -> RobotShapes | None:
        """Return the robot's collision shapes with a hand.

        Raises:
            StoreError: As `robot_shapes`.
        """
        stored = (self.hands[hand] if self.hands else self.metadata).get("robot_shapes")
        if stored is None:
            return None
        shapes = RobotShapes.from_dict(stored)
        levels = Grid.from_dict(self.grid).axis("torso").count
        if len(shapes.torso_shift) != levels:
            raise StoreError(
                f"metadata 'robot_shapes' has {len(shapes.torso_shift)} torso levels; the grid has "
                f"{levels}."
            )
        return shapes

    @property
    def nominal(self) -> StateTables:
        """The tables of the nominal state: the observed state nearest to zero."""
        return self.tables[self.nominal_index]

    @cached_property
    def nominal_index(self) -> int:
        """Number of the nominal state."""
        norms = [sum(value**2 for value in state.values()) for state in self.observed_states]
        return int(np.argmin(norms))


def _are_equal(one: NDArray[np.uint8] | None, other: NDArray[np.uint8] | None) -> bool:
    """Return whether two arrays are equal, or both missing."""
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other)


def _check_success(success: SuccessTable | None, sets: SetTable) -> None:
    """Check that the estimates are for sets of the table."""
    if success is None:
        return
    named = success.members[success.members != NO_MEMBER]
    if success.members.shape[1] > sets.max_members or not np.all(np.isin(named, sets.candidates)):
        raise StoreError("estimates of success for sets that the table does not have.")


def _check_refined(refined: RefinedTable | None, sets: SetTable, grid: Grid) -> None:
    """Check that the refined sets start from candidates, and have values of the grid's axes."""
    if refined is None:
        return
    named = refined.origin[refined.origin != NO_MEMBER]
    if (
        refined.values.shape[2] != len(grid.axes)
        or not np.all(np.isin(named, sets.candidates))
        or not np.array_equal(refined.weights, sets.weights)
    ):
        raise StoreError("refined sets that do not belong to the sets of the table.")


def _check_windows(windows: WindowTable | None, sets: SetTable, grid: Grid) -> None:
    """Check that the windows are of stops of the grid's axes that serve goals of the table."""
    if windows is None:
        return
    if windows.values.shape[1] != len(grid.axes) or windows.goals.shape[1] != sets.weights.size:
        raise StoreError("parking windows that do not belong to the sets of the table.")


def _has_a_frame(goal: object) -> bool:
    """Return whether a goal of the description of a task is unnamed, or names its frame by text."""
    return not isinstance(goal, dict) or isinstance(goal.get("body_frame", ""), str)


def _is_person(entry: object) -> bool:
    """Return whether the entry of a person can be told in words, and the person be made again."""
    if not isinstance(entry, dict) or not isinstance(entry.get("given"), dict):
        return False
    if not all(isinstance(key, str) for key in entry["given"]):
        return False
    if "sex" in entry:
        numbers = [entry.get(name) for name in OF_BODY] + [entry.get("age", 0)]
        if entry["sex"] not in ("female", "male") or not all(map(_is_number, numbers)):
            return False
    posture = entry.get("posture", {"name": None, "angles_deg": {}})
    if not isinstance(posture, dict) or not isinstance(posture.get("name", 0), str | None):
        return False
    angles, touching = posture.get("angles_deg"), entry.get("touching_goals", [])
    return (
        isinstance(angles, dict)
        and all(isinstance(joint, str) for joint in angles)
        and all(map(_is_number, angles.values()))
        and isinstance(touching, list)
        and all(map(_is_touching_goal, touching))
    )


def _is_touching_goal(entry: object) -> bool:
    """Return whether an entry names a goal at which the gripper touches a part of the person."""
    return (
        isinstance(entry, dict)
        and type(entry.get("goal")) is int
        and isinstance(entry.get("part"), str)
        and isinstance(entry.get("name"), str | None)
    )


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _are_numbers(values: object, count: int) -> bool:
    return (
        isinstance(values, list)
        and len(values) == count
        and all(isinstance(value, float) and math.isfinite(value) for value in values)
    )


def state_to_json(axes: tuple[Axis, ...], state: Mapping[str, float]) -> dict[str, float]:
    """Return an observed state as plain numbers, angles in degrees under `..._deg` names.

    >>> state_to_json((Axis("person_y", "m", -0.1, 0.05, 5),), {"person_y": 0.05})
    {'person_y': 0.05}
    """
    return {
        f"{axis.name}_deg" if axis.unit == "deg" else axis.name: round(
            math.degrees(state[axis.name]) if axis.unit == "deg" else state[axis.name], 9
        )
        for axis in axes
        if axis.name in state
    }

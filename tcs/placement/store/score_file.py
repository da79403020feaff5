"""What a score file holds: one task, scored and ready to choose from."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from tcs.errors import StoreError, StoreMismatchError
from tcs.files.plain import plain
from tcs.model.grid import Axis, Grid
from tcs.placement.tables import ScoreTable, SetTable, SuccessTable
from tcs.placement.tables.rules import candidates_of
from tcs.placement.tables.sets import DISTANCE_TOLERANCE
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
"""Keys that the metadata must have, and the type of each; others may join."""

DESCRIPTIONS = ("metadata", "task", "robot", "environment", "grid", "body_frames")
"""Parts of a file that are plain containers."""

MAX_TABLES = 1000
"""Most observed states a file may have scores for; one is some megabytes."""


@dataclass(frozen=True, eq=False)
class StateTables:
    """Scores and sets for one observed state of the person, e.g. lying 5 cm to the left.

    Scores are large and choosing needs the sets alone, so a loaded file unfolds the scores of a
    table when they are first asked for.
    """

    sets: SetTable
    """The sets to choose from."""
    unfold: Callable[[], ScoreTable]
    """Returns the scores of every configuration at every goal."""
    success: SuccessTable | None = None
    """Estimated success of some of the sets under error, where that was asked for."""

    @classmethod
    def of(cls, scores: ScoreTable, sets: SetTable) -> Self:
        """Return the table of scores that are at hand.

        Raises:
            StoreError: If the sets are not those of the scores.
        """
        table = cls(sets, lambda: scores)
        table.check(scores)
        return table

    @cached_property
    def scores(self) -> ScoreTable:
        """Scores of every configuration at every goal.

        Raises:
            StoreFormatError: If they come from a file in which they are damaged, or do not
                belong to the sets.
        """
        return self.unfold()

    def check(self, scores: ScoreTable) -> None:
        """Refuse scores that the sets are not sets of.

        Raises:
            StoreError: If they are not.
        """
        sets = self.sets
        candidates = candidates_of(scores.reached, scores.weights, sets.rule)
        if not (
            np.array_equal(sets.weights, scores.weights)
            and np.array_equal(sets.candidates, candidates)
            and np.array_equal(sets.reached, scores.reached[candidates])
            and np.array_equal(sets.dexterity, scores.dexterity[candidates])
        ):
            raise StoreError("sets do not belong to the scores.")


@dataclass(frozen=True, kw_only=True, eq=False)
class ScoreFile:
    """Scores and sets of one task, with everything needed to know what they are scores of."""

    metadata: dict[str, Any]
    """What made the file: see `REQUIRED_METADATA`."""
    task: dict[str, Any]
    """The task as plain containers."""
    robot: dict[str, Any]
    """The robot as plain containers."""
    environment: dict[str, Any]
    """The environment as plain containers."""
    grid: dict[str, Any]
    """The grid as plain containers; `Grid.from_dict` reads it."""
    observed: list[dict[str, Any]]
    """The axes that the robot finds and cannot set, e.g. the person's shift, as plain containers;
    `Axis.from_dict` reads them. Empty where there are none."""
    body_frames: dict[str, list[float]]
    """Where each body frame is in W [m] when scored: x, y, z for each state of the observed axes
    and, within it, of the environment's axes, one after the other."""
    tables: tuple[StateTables, ...]
    """Scores and sets for each state of the observed axes, in C order; one where there are none."""

    def __post_init__(self) -> None:
        """Check the parts against each other.

        Raises:
            StoreError: If a part is not plain, a key of the metadata is missing, or grid, scores
                and sets do not belong together.
            GridError: If the grid or an observed axis is none.
        """
        for name in DESCRIPTIONS:
            copy = plain(name, getattr(self, name))
            if not isinstance(copy, dict):
                raise StoreError(f"{name} is {type(copy).__name__}; must be a dict.")
            object.__setattr__(self, name, copy)
        object.__setattr__(self, "observed", plain("observed", self.observed))
        object.__setattr__(self, "tables", tuple(self.tables))
        for key, kind in REQUIRED_METADATA.items():
            if not isinstance(self.metadata.get(key), kind):
                raise StoreError(f"metadata needs '{key}', of type {kind.__name__}.")
        self._check_tables()

    def _check_tables(self) -> None:
        """Refuse sets of another grid, and more or fewer tables than there are observed states."""
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
            if sets.state_size * math.prod(grid.environment_shape) != grid.size:
                raise StoreError("sets have another number of environment states than the grid.")
            _check_success(table.success, sets)
            places = grid.values(sets.candidates)
            for column, name in enumerate(("base_x", "base_y")):
                gap = np.abs(sets.cell_xy[sets.cell, column] - places[name])
                if np.any(gap > DISTANCE_TOLERANCE):
                    raise StoreError(
                        f"sets have base cells that are not those of the grid ({name})."
                    )

    @cached_property
    def observed_axes(self) -> tuple[Axis, ...]:
        """The axes that the robot finds and cannot set."""
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

    @property
    def nominal(self) -> StateTables:
        """The table whose observed state is nearest to zero: the person where they belong."""
        return self.tables[self.nominal_index]

    @cached_property
    def nominal_index(self) -> int:
        """Number of the nominal table."""
        norms = [sum(value**2 for value in state.values()) for state in self.observed_states]
        return int(np.argmin(norms))


def _check_success(success: SuccessTable | None, sets: SetTable) -> None:
    """Refuse estimates of sets that the table cannot hold."""
    if success is None:
        return
    named = success.members[success.members != NO_MEMBER]
    if success.members.shape[1] > sets.max_members or not np.all(np.isin(named, sets.candidates)):
        raise StoreError("estimates of success of sets that are not held.")


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


def check_scene(file: ScoreFile, digest: str) -> None:
    """Refuse a file whose scores were computed from other models than today's.

    Args:
        file: A loaded score file.
        digest: Digest of the scene as it is lowered now.

    Raises:
        StoreMismatchError: If the digests differ.
    """
    stored = file.metadata["scene_digest"]
    if stored != digest:
        raise StoreMismatchError(
            f"Scores of '{file.metadata['task']}' were made by tcs "
            f"{file.metadata['program_version']} from other models (scene {stored[:12]}) than "
            f"those installed now (scene {digest[:12]}). Score the task again; choosing from the "
            "file still works."
        )

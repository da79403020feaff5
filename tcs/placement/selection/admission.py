"""Candidates that constraints admit: which remain, and what each constraint leaves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import Axis, AxisCondition, Grid, InitialConfiguration
from tcs.model.grid.condition import axis_named, values_text
from tcs.placement.constraints import Constraints, Footprint, blocked_bodies, blocked_solutions
from tcs.placement.selection.travel import current_values

if TYPE_CHECKING:
    from tcs.placement.selection.choice import SelectionTables

BoolArray = NDArray[np.bool_]

SAME_VALUE = 1e-6
"""Difference [m or rad] below which a present value counts as a scored one."""


@dataclass(frozen=True, slots=True)
class Left:
    """What a constraint and those before it leave."""

    constraint: str
    """The constraint, e.g. "keep bed_height"."""
    configurations: int
    """Number of candidates."""
    solutions: int | None = None
    """Number of their stored solutions, for obstacles."""

    def to_json(self) -> dict[str, Any]:
        """Return the numbers as plain containers."""
        plain: dict[str, Any] = {
            "constraint": self.constraint,
            "configurations": self.configurations,
        }
        return plain if self.solutions is None else {**plain, "solutions": self.solutions}


@dataclass(frozen=True, slots=True)
class Admitted:
    """The candidates that satisfy all constraints, and what they still reach."""

    candidates: BoolArray
    """Whether a candidate satisfies them, shape (C,)."""
    reached: BoolArray
    """Whether a candidate reaches a goal by a solution that no obstacle blocks, shape (C, G)."""
    dexterity: NDArray[np.float32]
    """Its dexterity there, 0 where not reached, shape (C, G)."""
    left: tuple[Left, ...]
    """What each constraint leaves."""
    warnings: tuple[str, ...]
    """What the user should know about the constraints."""
    footprint: Footprint | None
    """The floor that the robot covers; None without forbidden regions."""

    @property
    def has_fewer_solutions(self) -> bool:
        """Whether obstacles were given, so that `reached` may differ from the scores."""
        return any(left.solutions is not None for left in self.left)


def admitted_candidates(
    constraints: Constraints, here: InitialConfiguration, tables: SelectionTables
) -> Admitted:
    """Return the candidates that satisfy all constraints.

    Args:
        constraints: The constraints.
        here: The current state, for `keep`.
        tables: The candidates.

    Raises:
        UnknownNameError: If the grid has no such axis.
        GridError: If a condition has another unit than its axis, or excludes all its values.
        SelectionError: If the current state lacks an axis to keep or is beyond the scored values,
            an obstacle is given and the robot's shapes are not known, or no candidate is left.
    """
    sets, grid = tables.sets, tables.grid
    remaining = np.ones(len(sets.candidates), dtype=np.bool_)
    reached, dexterity = sets.reached, sets.dexterity
    left: list[Left] = []
    warnings: list[str] = []
    along = grid.indices(sets.candidates)
    for name, axis, admitted, warning in _axis_constraints(constraints, here, grid):
        remaining &= admitted[along[:, grid.axes.index(axis)]]
        warnings += [warning] if warning else []
        _note(left, Left(name, _count(remaining)), remaining.size)
    footprint = Footprint.of(tables.shapes) if constraints.forbid else None
    if footprint is not None:
        base, which = _bases(grid, sets.candidates)
        for region in constraints.forbid:
            remaining &= ~footprint.overlaps(region, base)[which]
            _note(left, Left(f"forbid {region.name}", _count(remaining)), remaining.size)
        if footprint.radius:
            warnings.append(
                "forbid: the robot's shapes are not stored, so it counts as a circle of "
                f"{footprint.radius:g} m about its base. Score the task again for its footprint."
            )
    for obstacle in constraints.blocked:
        remaining &= ~blocked_bodies(obstacle, tables.postures)
        hit = blocked_solutions(obstacle, tables.postures, remaining)
        candidate, goal = (index[hit] for index in tables.postures.pairs)
        reached, dexterity = reached.copy(), dexterity.copy()
        reached[candidate, goal], dexterity[candidate, goal] = False, 0.0
        remaining &= reached.any(axis=1)
        found = Left(f"blocked {obstacle.name}", _count(remaining), _count(reached[remaining]))
        _note(left, found, remaining.size)
    return Admitted(remaining, reached, dexterity, tuple(left), tuple(warnings), footprint)


def _bases(
    grid: Grid, candidates: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the distinct base poses (U, 3) [m, m, rad], and the pose of each candidate (C,)."""
    size = int(np.prod(grid.shape[-4:]))
    # Neither the environment's state nor the torso level, the fastest axis, moves the base.
    pose = candidates.astype(np.int64) % size // grid.shape[-1]
    _, first, which = np.unique(pose, return_index=True, return_inverse=True)
    at = grid.values(candidates[first])
    return np.stack([at[name] for name in ("base_x", "base_y", "base_yaw")], axis=1), which


def _count(remaining: BoolArray) -> int:
    return int(np.count_nonzero(remaining))


def _axis_constraints(
    constraints: Constraints, here: InitialConfiguration, grid: Grid
) -> Iterator[tuple[str, Axis, BoolArray, str]]:
    """Yield each constraint on an axis: its name, axis, admitted values (count,) and a warning."""
    for text in constraints.only:
        condition = AxisCondition.parse(text)
        axis = condition.axis_of(grid)
        admitted = condition.admitted(grid)
        warning = ""
        if np.all(admitted):
            warning = (
                f"only {condition.text} excludes nothing: the grid has {axis.name} "
                f"{values_text(axis)}."
            )
        yield f"only {condition.text}", axis, admitted, warning
    if not constraints.keep:
        return
    now = current_values(here, grid, ())
    for name in constraints.keep:
        axis = axis_named(grid, name, where="keep")
        index, error = _present(axis, now)
        warning = ""
        if error > SAME_VALUE:
            warning = (
                f"keep {axis.name}: the present value {_shown(axis, now[axis.name])} is not "
                f"scored; the scores are those of {_shown(axis, float(axis.values[index]))}."
            )
        yield f"keep {axis.name}", axis, np.arange(axis.count) == index, warning


def _present(axis: Axis, now: dict[str, float]) -> tuple[int, float]:
    """Return the index of the scored value nearest to the present one, and their difference."""
    if axis.name not in now:
        key = f"{axis.name}_deg" if axis.unit == "deg" else axis.name
        raise SelectionError(
            f"keep {axis.name}: the current state lacks its value. Give it: --at {key}=VALUE."
        )
    apart = np.abs(axis.values - now[axis.name])
    if axis.name == "base_yaw":
        apart = np.abs(np.mod(apart + math.pi, 2.0 * math.pi) - math.pi)
    index = int(np.argmin(apart))
    half = (math.radians(axis.step) if axis.unit == "deg" else axis.step) / 2.0
    # A single value has no neighbour that shows what range it covers.
    if apart[index] > (half * (1.0 + 1e-9) if axis.count > 1 else SAME_VALUE):
        raise SelectionError(
            f"keep {axis.name}: the present value {_shown(axis, now[axis.name])} is more than half "
            f"a step from the scored ones: {values_text(axis)}."
            if axis.count > 1
            else f"keep {axis.name}: the present value is {_shown(axis, now[axis.name])}, but only "
            f"{values_text(axis)} is scored."
        )
    return index, float(apart[index])


def _shown(axis: Axis, value: float) -> str:
    return f"{math.degrees(value) if axis.unit == 'deg' else value:g} {axis.unit}"


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

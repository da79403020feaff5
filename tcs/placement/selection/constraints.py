"""Constraints on what may be selected: which candidates remain, and what each constraint leaves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import Axis, AxisCondition, Grid, InitialConfiguration
from tcs.model.grid.condition import axis_named, values_text
from tcs.placement.selection.travel import current_values

BoolArray = NDArray[np.bool_]

SAME_VALUE = 1e-6
"""Difference [m or rad] below which a present value counts as a scored one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Constraints:
    """Constraints that every member of a selected set satisfies; none by default."""

    only: tuple[str, ...] = ()
    """Conditions on axes of the grid, e.g. "head_rest >= 35 deg"; see `AxisCondition`."""
    keep: tuple[str, ...] = ()
    """Axes that stay as they are now, e.g. "bed_height"."""

    def __post_init__(self) -> None:
        """Turn lists into tuples, and check the form of the conditions.

        Raises:
            SelectionError: If a field is a single text.
            GridError: If a condition is not of the form of `AxisCondition`.
            UnknownNameError: If a condition has an unknown unit.
        """
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, str):
                raise SelectionError(
                    f"Constraint {field.name} is the text '{value}'; must be a tuple of them."
                )
            object.__setattr__(self, field.name, tuple(value))
        for text in self.only:
            AxisCondition.parse(text)

    def __bool__(self) -> bool:
        """Return whether there is any constraint."""
        return any(getattr(self, field.name) for field in fields(self))


@dataclass(frozen=True, slots=True)
class Admitted:
    """The candidates that satisfy all constraints."""

    candidates: BoolArray
    """Whether a candidate satisfies them, shape (C,)."""
    left: tuple[tuple[str, int], ...]
    """Each constraint, and the number of candidates that remain after it and those before it."""
    warnings: tuple[str, ...]
    """What the user should know about the constraints."""


def admitted_candidates(
    constraints: Constraints, here: InitialConfiguration, grid: Grid, candidates: NDArray[np.int32]
) -> Admitted:
    """Return the candidates that satisfy all constraints.

    Args:
        constraints: The constraints.
        here: The current state, for `keep`.
        grid: Grid of the candidates.
        candidates: Flat indices of the candidates, shape (C,).

    Raises:
        UnknownNameError: If the grid has no such axis.
        GridError: If a condition has another unit than its axis, or excludes all its values.
        SelectionError: If the current state lacks an axis to keep or is beyond the scored values,
            or no candidate is left.
    """
    remaining = np.ones(len(candidates), dtype=np.bool_)
    left: list[tuple[str, int]] = []
    warnings: list[str] = []
    along = grid.indices(candidates)
    for name, axis, admitted, warning in _axis_constraints(constraints, here, grid):
        remaining &= admitted[along[:, grid.axes.index(axis)]]
        left.append((name, int(np.count_nonzero(remaining))))
        if warning:
            warnings.append(warning)
        _check_left(left, len(candidates))
    return Admitted(remaining, tuple(left), tuple(warnings))


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
    # An axis with a single value covers no range, so any present value counts as that value.
    if axis.count > 1 and apart[index] > half * (1.0 + 1e-9):
        raise SelectionError(
            f"keep {axis.name}: the present value {_shown(axis, now[axis.name])} is more than half "
            f"a step from the scored ones: {values_text(axis)}."
        )
    return index, float(apart[index])


def _shown(axis: Axis, value: float) -> str:
    return f"{math.degrees(value) if axis.unit == 'deg' else value:g} {axis.unit}"


def _check_left(left: list[tuple[str, int]], candidates: int) -> None:
    """Refuse constraints that leave no candidate; the message names the last one."""
    name, count = left[-1]
    if count:
        return
    before = f"the {left[-2][1]:,} that '{left[-2][0]}' leaves" if len(left) > 1 else ""
    among = before or f"the {candidates:,} that reach a goal"
    raise SelectionError(
        f"No initial configuration is left: '{name}' excludes all of {among}. Relax a constraint, "
        "or score a grid that covers it."
    )

"""Constraints on axes of the grid: conditions, and axes that keep their present value."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import Axis, AxisCondition, Grid
from tcs.model.grid.condition import axis_named, values_text
from tcs.placement.constraints.constraints import Constraints

BoolArray = NDArray[np.bool_]

SAME_VALUE = 1e-6
"""Difference [m or rad] below which a present value counts as a scored one."""


def axis_constraints(
    constraints: Constraints, now: Mapping[str, float], grid: Grid
) -> Iterator[tuple[str, Axis, BoolArray, str]]:
    """Yield each constraint on an axis: its name, axis, admitted values (count,) and a warning.

    Args:
        constraints: The constraints, of which `only` and `keep` are read.
        now: Present values by axis [m or rad], for `keep`.
        grid: The grid.

    Raises:
        UnknownNameError: If the grid has no such axis.
        GridError: If a condition has another unit than its axis, or excludes all its values.
        SelectionError: If the present value of an axis to keep is missing, or more than half a step
            from every scored one.
    """
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


def kept_conditions(keep: tuple[str, ...], now: Mapping[str, float], grid: Grid) -> tuple[str, ...]:
    """Return conditions that leave only the value of each axis that is nearest to the present one.

    Args:
        keep: Names of axes.
        now: Present values by axis [m or rad].
        grid: The grid.

    Raises:
        UnknownNameError: If the grid has no such axis, or no axis with a present value.
        SelectionError: As of `axis_constraints`.
    """
    conditions = []
    if keep:
        for name in now:
            # A misspelt name would leave its axis without a value.
            axis_named(grid, name, where="present values")
    for name in keep:
        axis = axis_named(grid, name, where="keep")
        index, _ = _present(axis, now)
        # Twelve decimals, as of a restricted grid: 3 steps of 0.1 m exceed 0.3 m by 6e-17 m.
        value = round(axis.start + index * axis.step, 12)
        conditions.append(f"{axis.name} = {value!r} {axis.unit}")
    return tuple(conditions)


def _present(axis: Axis, now: Mapping[str, float]) -> tuple[int, float]:
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

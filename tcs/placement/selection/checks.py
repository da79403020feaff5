"""Checks of weights and of the current state given by a user."""

from __future__ import annotations

import math

from tcs.errors import SelectionError
from tcs.files.quantities import HEADING, POSITION, UTILITY_WEIGHT
from tcs.model.grid import Axis


def check_weight(name: str, value: float) -> None:
    """Refuse a weight that is negative, not finite or too large.

    Raises:
        SelectionError: If it is not a number in the range of `UTILITY_WEIGHT`.
    """
    UTILITY_WEIGHT.check((value,), f"Weight {name}", SelectionError)


def check_coordinate(name: str, value: float, unit: str) -> None:
    """Refuse a coordinate of the current state that is not finite or too large.

    Args:
        name: Name of its axis.
        value: Current value [unit].
        unit: "m" or "rad".

    Raises:
        SelectionError: If it is not a number in the range of `POSITION` or `HEADING`.
    """
    quantity = POSITION if unit == "m" else HEADING
    quantity.check((value,), f"Current state: {name}", SelectionError)


def check_within_axis(axis: Axis, value: float, *, lowest: float | None = None) -> None:
    """Refuse a value that no state between or near the scored values of an axis has.

    A value may be half a step beyond either end: the joint need not stop where the grid does. An
    axis with a single value covers no range, so any value passes.

    Args:
        axis: An axis of the grid.
        value: Current value [m or rad].
        lowest: A value [m or rad] that passes although the axis starts above it.

    Raises:
        SelectionError: If the value is out of range.
    """
    if axis.count == 1:
        return
    first, last = axis.value(0), axis.value(-1)
    # Rounding of the steps must not refuse a value exactly half a step beyond an end.
    margin = (last - first) / (axis.count - 1) / 2.0 * (1.0 + 1e-9)
    low = first - margin if lowest is None else min(first - margin, lowest)
    if low <= value <= last + margin:
        return
    shown, begin, end = (
        f"{math.degrees(number) if axis.unit == 'deg' else number:g}"
        for number in (value, first, last)
    )
    raise SelectionError(
        f"Current state: {axis.name} is {shown} {axis.unit}, out of range: the scores cover "
        f"{begin} to {end} {axis.unit}. Give the present value, at most half a step beyond."
    )

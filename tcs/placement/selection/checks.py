"""Checks of weights and of the current state given by a user."""

from __future__ import annotations

import math

from tcs.errors import SelectionError
from tcs.model.grid import Axis

MAX_WEIGHT = 1e9
"""With a greater weight, rounding of its term would exceed every other term of the utility."""

MAX_COORDINATE = 1e6
"""A position beyond 1000 km, or an angle beyond 1e6 rad, is a mistake; its square may overflow."""


def check_weight(name: str, value: float) -> None:
    """Refuse a weight that is negative, not finite or too large.

    Raises:
        SelectionError: If it is not a number in [0, 1e9].
    """
    if not (_is_number(value) and 0.0 <= value <= MAX_WEIGHT):
        raise SelectionError(f"Weight {name} is {value!r}; must be a number from 0 to 1e9.")


def check_coordinate(name: str, value: float) -> None:
    """Refuse a coordinate of the current state that is not finite or too large.

    Raises:
        SelectionError: If it is not a number in [-1e6, 1e6].
    """
    if not (_is_number(value) and abs(value) <= MAX_COORDINATE):
        raise SelectionError(
            f"Current state: {name} is {value!r}; must be a number from -1e6 to 1e6 (metres or "
            "radians in the environment frame)."
        )


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
    first, last = float(axis.values[0]), float(axis.values[-1])
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


def _is_number(value: object) -> bool:
    # numpy's float64 is a float; float32 and integers count too, booleans and text do not.
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        return False
    return math.isfinite(float(value))

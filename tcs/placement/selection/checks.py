"""What weights and states given by a user must keep to."""

from __future__ import annotations

import math

from tcs.errors import SelectionError

MAX_WEIGHT = 1e9
"""Beyond this a weight drowns every other term of the utility in rounding."""

MAX_COORDINATE = 1e6
"""A place farther away than 1000 km, or 1e6 rad, is a mistake, and its square may overflow."""


def check_weight(name: str, value: float) -> None:
    """Refuse a weight that is negative, not finite or absurd.

    Raises:
        SelectionError: If it is not a number in [0, 1e9].
    """
    if not (_is_number(value) and 0.0 <= value <= MAX_WEIGHT):
        raise SelectionError(f"Weight {name} is {value!r}; must be a number from 0 to 1e9.")


def check_coordinate(name: str, value: float) -> None:
    """Refuse a coordinate of the current state that is not finite or absurd.

    Raises:
        SelectionError: If it is not a number in [-1e6, 1e6].
    """
    if not (_is_number(value) and abs(value) <= MAX_COORDINATE):
        raise SelectionError(
            f"Current state: {name} is {value!r}; must be a number from -1e6 to 1e6 (metres or "
            "radians in the environment frame)."
        )


def _is_number(value: object) -> bool:
    # numpy's float64 is a float; float32 and integers count too, booleans and text do not.
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        return False
    return math.isfinite(float(value))

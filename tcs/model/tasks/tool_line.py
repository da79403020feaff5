"""Straight motions of the tool to a goal and away from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tcs.errors import TaskError

_SHORTEST = 1e-5
"""Least length of a vector that is a direction."""
MAX_STRAIGHT = 1.0
"""Greatest length of a straight tool motion [m]: about the reach of an arm."""


def finite(field: str, numbers: ArrayLike, names: Sequence[str]) -> NDArray[np.float64]:
    """Return the numbers as a new array; raise for a wrong count or numbers not finite."""
    wanted = f"{len(names)} finite numbers ({', '.join(names)})"
    try:
        array = np.array(numbers, dtype=np.float64)
    except (OverflowError, TypeError, ValueError):
        raise TaskError(f"field '{field}' is {numbers!r}, but must be {wanted}.") from None
    if array.shape != (len(names),) or not np.all(np.isfinite(array)):
        raise TaskError(f"field '{field}' is {array.tolist()}, but must be {wanted}.")
    return array


@dataclass(frozen=True, slots=True)
class ToolLine:
    """A straight motion of the tool at the constant orientation of a goal."""

    direction: tuple[float, float, float]
    """Unit direction of the motion in the tool frame T at the goal."""
    distance: float
    """Length of the motion [m]."""

    def __post_init__(self) -> None:
        """Check the values and normalise the direction.

        Raises:
            TaskError: If the direction has no length or the distance is out of its range.
        """
        direction = finite("direction", self.direction, ("x", "y", "z"))
        length = math.hypot(*direction)
        if length < _SHORTEST:
            raise TaskError("field 'direction' has length 0. Name a direction in the tool frame.")
        if not 0.0 < self.distance <= MAX_STRAIGHT:
            raise TaskError(
                f"field 'distance' is {self.distance:g} m, but must be above 0 and at most "
                f"{MAX_STRAIGHT:g} m."
            )
        x, y, z = (direction / length).tolist()
        object.__setattr__(self, "direction", (x, y, z))
        object.__setattr__(self, "distance", float(self.distance))

    @property
    def offset(self) -> NDArray[np.float64]:
        """Motion of the tool from begin to end, in T [m], shape (3,)."""
        return self.distance * np.array(self.direction)

    def reverse(self) -> ToolLine:
        """Return the same line in the opposite direction."""
        x, y, z = self.direction
        return ToolLine((-x, -y, -z), self.distance)


DEFAULT_APPROACH = ToolLine((1.0, 0.0, 0.0), 0.1)
"""Straight out of the fingers: a gripper is narrowest seen from there. 10 cm is the depth of a hand
beyond its fingers, which then clears what the tool touches before the arm swings to the side."""
DEFAULT_RETREAT = DEFAULT_APPROACH.reverse()

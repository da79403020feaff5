"""Changes from one configuration to another, axis by axis and in words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from tcs.model.grid import InitialConfiguration

LEAST_CHANGE = 1e-9
"""Least change that counts [m or deg]: configurations are written with nine decimals."""


@dataclass(frozen=True, slots=True)
class Change:
    """A change along one axis."""

    axis: str
    """Name of the axis as in `InitialConfiguration.to_json`: angles end in `_deg`."""
    start: float
    """Value before the change [unit]."""
    end: float
    """Value after the change [unit]."""
    change: float
    """Signed amount of the change [unit]; headings turn the shorter way."""

    @property
    def unit(self) -> str:
        """Unit of the values: "m" or "deg"."""
        return "deg" if self.axis.endswith("_deg") else "m"

    @property
    def words(self) -> str:
        """The change as an instruction; the base drives along the axes of the environment frame."""
        name, up = self.axis.removesuffix("_deg"), self.change > 0.0
        amount = _angle(self.change) if self.unit == "deg" else _length(self.change)
        if name in ("base_x", "base_y"):
            return f"drive {amount} along {'+' if up else '-'}{name[-1]}"
        if name == "base_yaw":
            # A turn of 180 degrees is the same in both directions.
            side = "" if abs(self.change) > 179.95 else f" to the {'left' if up else 'right'}"
            return f"turn {amount}{side}"
        part = name.replace("_", " ")
        for ending in (" height", " rest"):
            if part.endswith(ending) or part == "torso":
                what = part.removesuffix(" height")
                return f"{'raise' if up else 'lower'} the {what} {amount}"
        return f"change the {part} by {'+' if up else '-'}{amount}"

    @property
    def is_noticeable(self) -> bool:
        """Whether the change is at least 0.5 mm or 0.05 degrees, the rounding of `words`."""
        return abs(self.change) >= (0.05 if self.unit == "deg" else 0.0005)

    def to_json(self) -> dict[str, Any]:
        """Return the change as plain containers."""
        return {
            "axis": self.axis,
            "from": self.start,
            "to": self.end,
            "change": self.change,
            "unit": self.unit,
            "words": self.words,
        }


def changes_between(
    before: InitialConfiguration, after: InitialConfiguration
) -> tuple[Change, ...]:
    """Return the changes between two configurations of the same axes, in the order of the axes."""
    start, end = before.to_json(), after.to_json()
    changes = []
    for axis, value in end.items():
        change = value - start[axis]
        if axis == "base_yaw_deg":
            change = math.remainder(change, 360.0)
        if abs(change) >= LEAST_CHANGE:
            changes.append(Change(axis, start[axis], value, round(change, 9)))
    return tuple(changes)


def ahead_and_left(
    before: InitialConfiguration, after: InitialConfiguration
) -> tuple[float, float]:
    """Return how far the second base is ahead and to the left of the first [m].

    >>> here = InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=math.pi / 2, torso=0.0)
    >>> there = InitialConfiguration(base_x=-0.5, base_y=2.0, base_yaw=0.0, torso=0.0)
    >>> tuple(round(metres, 9) for metres in ahead_and_left(here, there))
    (2.0, 0.5)
    """
    dx, dy = after.base_x - before.base_x, after.base_y - before.base_y
    cos, sin = math.cos(before.base_yaw), math.sin(before.base_yaw)
    return cos * dx + sin * dy, cos * dy - sin * dx


def sentence(
    before: InitialConfiguration,
    after: InitialConfiguration,
    *,
    around: float | None = None,
    hand: str = "",
) -> str:
    """Return the changes as one sentence, with forward and left as seen from the first base.

    Args:
        before: The configuration before the changes.
        after: The configuration after them.
        around: Length of the path around the furniture [m], to be stated in the sentence.
        hand: The hand to use instead in words, if it is another one.

    >>> here = InitialConfiguration(base_x=1.0, base_y=0.0, base_yaw=0.0, torso=0.15)
    >>> there = InitialConfiguration(base_x=0.93, base_y=0.1, base_yaw=-0.7853981634, torso=0.3)
    >>> sentence(here, there)
    'Drive 7 cm back and 10 cm to the left, turn 45 deg to the right, raise the torso 15 cm.'
    """
    ahead, left = ahead_and_left(before, after)
    legs = []
    if abs(ahead) >= 0.0005:
        legs.append(f"{_length(ahead)} {'forward' if ahead > 0.0 else 'back'}")
    if abs(left) >= 0.0005:
        legs.append(f"{_length(left)} to the {'left' if left > 0.0 else 'right'}")
    steps = []
    if legs:
        path = f" ({_length(around)} around the furniture)" if around is not None else ""
        steps.append(f"drive {' and '.join(legs)}{path}")
    steps += [
        change.words
        for change in changes_between(before, after)
        if change.axis not in ("base_x", "base_y") and change.is_noticeable
    ]
    if hand:
        steps.append(f"use the {hand}")
    if not steps:
        return "Nothing needs to change."
    text = ", ".join(steps)
    return f"{text[0].upper()}{text[1:]}."


def _length(metres: float) -> str:
    """Return the absolute length with its unit, to the millimetre below a metre."""
    size = abs(metres)
    return f"{round(100.0 * size, 1):g} cm" if size < 0.9995 else f"{size:.2f} m"


def _angle(degrees: float) -> str:
    """Return the absolute angle with its unit."""
    return f"{round(abs(degrees), 1):g} deg"

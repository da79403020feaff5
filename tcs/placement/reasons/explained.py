"""The explained configuration, and changes from one configuration to another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.errors import SelectionError
from tcs.model.grid import Axis, Grid, InitialConfiguration
from tcs.placement.selection.travel import current_values
from tcs.placement.tables import Reason, ScoreTable

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


@dataclass(frozen=True, slots=True, kw_only=True)
class ExplainedConfiguration:
    """A configuration of the grid, with its outcome at one goal."""

    index: int
    """Flat index of the configuration."""
    configuration: InitialConfiguration
    """The configuration, as it was scored."""
    stated: InitialConfiguration
    """The requested configuration; it need not be one of the grid."""
    reason: Reason
    """`REACHED`, or the reason why the goal is not reached."""
    pair: tuple[str, str] | None
    """The two bodies in contact, if any; for the arm, those of its best posture."""
    dexterity: float
    """Dexterity at the goal; 0 if it is not reached."""
    hand: int
    """Number of the hand that reaches the goal, comes nearest to it, or was asked about."""

    @classmethod
    def of(
        cls, grid: Grid, scores: ScoreTable, goal: int, requested: int | InitialConfiguration
    ) -> ExplainedConfiguration:
        """Return the outcome of a configuration at a goal.

        Args:
            grid: The grid that was scored.
            scores: Its scores.
            goal: Number of the goal.
            requested: Flat index, or a configuration of which the nearest one of the grid is taken.

        Raises:
            GridError: If there is no configuration of that index.
            SelectionError: If a value is not finite, or an axis is missing or exceeded.
            UnknownNameError: If an environment axis has no such name.
        """
        if isinstance(requested, InitialConfiguration):
            index, stated = nearest_configuration(grid, requested)
        else:
            index, stated = int(requested), grid.configuration(requested)
        pair = int(scores.pair[index, goal])
        return cls(
            index=index,
            configuration=grid.configuration(index),
            stated=stated,
            reason=Reason(scores.reason[index, goal]),
            pair=scores.pair_names[pair] if pair >= 0 else None,
            dexterity=float(scores.dexterity[index, goal]),
            hand=0 if scores.hand is None else int(scores.hand[index, goal]),
        )

    @property
    def is_reached(self) -> bool:
        """Whether the goal is reached from there."""
        return self.reason == Reason.REACHED

    @property
    def offset(self) -> dict[str, float]:
        """Stated minus scored values, by the names of `InitialConfiguration.to_json`."""
        changes = changes_between(self.configuration, self.stated)
        return {change.axis: change.change for change in changes}

    def to_json(self) -> dict[str, Any]:
        """Return the outcome as plain containers."""
        return {
            "configuration": self.index,
            "members": [self.configuration.to_json()],
            "offset": self.offset,
            "reached": self.is_reached,
            "reason": self.reason.name.lower(),
            "pair": None if self.pair is None else list(self.pair),
            "dexterity": self.dexterity,
        }


def nearest_configuration(
    grid: Grid, stated: InitialConfiguration
) -> tuple[int, InitialConfiguration]:
    """Return the configuration of a grid that is nearest to a stated one along every axis.

    Args:
        grid: A grid.
        stated: Any configuration, at most half a step beyond the ends of an axis. On an axis with a
            single value any value is accepted.

    Returns:
        Its flat index, and the stated configuration with its axes in the order of the grid.

    Raises:
        SelectionError: If a value is not finite, or an axis is missing or exceeded.
        UnknownNameError: If an environment axis has no such name.
    """
    given = dict(stated.environment)
    missing = [axis.name for axis in grid.environment_axes if axis.name not in given]
    if missing:
        raise SelectionError(
            f"The configuration lacks {', '.join(missing)}: whether a goal is reached depends on "
            "it. State its value."
        )
    values = current_values(stated, grid, ())
    along = [_nearest_value(axis, values[axis.name]) for axis in grid.axes]
    index = int(grid.flat(along))
    ordered = InitialConfiguration(
        base_x=values["base_x"],
        base_y=values["base_y"],
        base_yaw=values["base_yaw"],
        torso=values["torso"],
        environment=tuple((axis.name, values[axis.name]) for axis in grid.environment_axes),
        environment_units=tuple(axis.held_unit for axis in grid.environment_axes),
    )
    return index, ordered


def _nearest_value(axis: Axis, value: float) -> int:
    """Return the index of the nearest value of an axis; refuse values too far beyond its ends."""
    error = axis.values - value
    if axis.name == "base_yaw":
        error = np.mod(error + math.pi, 2.0 * math.pi) - math.pi
    nearest = int(np.argmin(np.abs(error)))
    half = float(np.diff(axis.values[:2])[0]) / 2.0 if axis.count > 1 else math.inf
    # Rounding of the steps must not refuse what is half a step away.
    if abs(error[nearest]) > half * (1.0 + 1e-9):
        shown, first, last = (
            (math.degrees(number) if axis.unit == "deg" else number)
            for number in (value, axis.values[0], axis.values[-1])
        )
        raise SelectionError(
            f"The configuration has {axis.name} {shown:g} {axis.unit}, beyond the grid, where it "
            f"is {first:g} to {last:g} {axis.unit}. Stay on the grid, or score a larger one."
        )
    return nearest

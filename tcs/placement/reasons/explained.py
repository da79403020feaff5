"""The configuration that is explained: one of the grid, or the one nearest to a stated place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.errors import SelectionError
from tcs.model.grid import Axis, Grid, InitialConfiguration
from tcs.placement.reasons.changes import changes_between
from tcs.placement.selection.travel import current_values
from tcs.placement.tables import Reason, ScoreTable


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """A configuration of the grid, and what came of it at one goal."""

    index: int
    """Its flat index."""
    configuration: InitialConfiguration
    """It itself, as it was scored."""
    place: InitialConfiguration
    """What was stated; the configuration itself where an index was."""
    reason: Reason
    """Whether the goal is reached, or why not."""
    pair: tuple[str, str] | None
    """The two bodies that block, if any do. Where the arm does: those of the best solution."""
    dexterity: float
    """How evenly the arm can move at the goal; 0 where it is not reached."""

    @classmethod
    def of(
        cls, grid: Grid, scores: ScoreTable, goal: int, asked: int | InitialConfiguration
    ) -> Standing:
        """Return what came of a configuration at a goal.

        Args:
            grid: The grid that was scored.
            scores: Its scores.
            goal: Number of the goal.
            asked: Flat index, or a place of which the nearest configuration counts.

        Raises:
            GridError: If there is no configuration of that index.
            SelectionError: If the place is not finite, lacks an axis or is beyond the grid.
            UnknownNameError: If an environment axis has no such name.
        """
        if isinstance(asked, InitialConfiguration):
            index, place = nearest_configuration(grid, asked)
        else:
            index, place = int(asked), grid.configuration(asked)
        pair = int(scores.pair[index, goal])
        return cls(
            index=index,
            configuration=grid.configuration(index),
            place=place,
            reason=Reason(scores.reason[index, goal]),
            pair=scores.pair_names[pair] if pair >= 0 else None,
            dexterity=float(scores.dexterity[index, goal]),
        )

    @property
    def is_reached(self) -> bool:
        """Whether the goal is reached from there."""
        return self.reason == Reason.REACHED

    @property
    def off(self) -> dict[str, float]:
        """By how much the stated place is off, called as in `InitialConfiguration.to_json`."""
        changes = changes_between(self.configuration, self.place)
        return {change.axis: change.change for change in changes}

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {
            "configuration": self.index,
            "members": [self.configuration.to_json()],
            "off": self.off,
            "reached": self.is_reached,
            "reason": self.reason.name.lower(),
            "pair": None if self.pair is None else list(self.pair),
            "dexterity": self.dexterity,
        }


def nearest_configuration(
    grid: Grid, place: InitialConfiguration
) -> tuple[int, InitialConfiguration]:
    """Return the configuration of a grid that is nearest to a place along every axis.

    Args:
        grid: A grid.
        place: A place, at most half a step beyond the ends of an axis. Along an axis that has a
            single value anything is nearest to it.

    Returns:
        Its flat index, and the place with its axes in the order of the grid.

    Raises:
        SelectionError: If the place is not finite, lacks an axis or is beyond the grid.
        UnknownNameError: If an environment axis has no such name.
    """
    told = dict(place.environment)
    missing = [axis.name for axis in grid.environment_axes if axis.name not in told]
    if missing:
        raise SelectionError(
            f"The place lacks {', '.join(missing)}: whether a goal is reached depends on it. "
            "State its value."
        )
    values = current_values(place, grid, ())
    index = int(grid.flat([_nearest_value(axis, values[axis.name]) for axis in grid.axes]))
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
    """Return the index of the value of an axis that is nearest, refusing one that is too far."""
    off = axis.values - value
    if axis.name == "base_yaw":
        off = np.mod(off + math.pi, 2.0 * math.pi) - math.pi
    nearest = int(np.argmin(np.abs(off)))
    half = float(np.diff(axis.values[:2])[0]) / 2.0 if axis.count > 1 else math.inf
    # Rounding of the steps must not refuse what is half a step away.
    if abs(off[nearest]) > half * (1.0 + 1e-9):
        shown, first, last = (
            (math.degrees(number) if axis.unit == "deg" else number)
            for number in (value, axis.values[0], axis.values[-1])
        )
        raise SelectionError(
            f"The place has {axis.name} {shown:g} {axis.unit}, beyond the grid, where it is "
            f"{first:g} to {last:g} {axis.unit}. Take a place of the grid, or score a larger one."
        )
    return nearest

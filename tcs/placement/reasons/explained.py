"""The explained configuration: one of the grid, or the nearest one to a stated configuration."""

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

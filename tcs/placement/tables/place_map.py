"""Map of base positions: the best scores at each, over headings, torso heights and bed settings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import GridError
from tcs.model.grid import Axis, Grid
from tcs.placement.tables import Reason, ScoreTable

FloatArray = NDArray[np.float64]
_PLACE = ("base_x", "base_y")
_PLURALS = {"base_yaw": "headings", "torso": "torso heights"}


@dataclass(frozen=True, eq=False)
class PlaceMap:
    """Best scores at each base position of a grid.

    The two scores of a position are separate maxima: they may belong to different headings.
    """

    x: FloatArray
    """Base positions along x [m], shape (X,)."""
    y: FloatArray
    """Base positions along y [m], shape (Y,)."""
    reachability: FloatArray
    """Greatest P_R of a single configuration at each position, shape (X, Y)."""
    manipulability: FloatArray
    """Greatest P_M of a single configuration at each position, shape (X, Y)."""
    free: NDArray[np.bool_]
    """Whether the robot's body is free of contact in at least one configuration, shape (X, Y)."""
    excluded: NDArray[np.bool_] | None = None
    """Whether constraints excluded every configuration there, shape (X, Y); None for nowhere."""
    over: tuple[str, ...] = ()
    """Names of the other axes, over which the maxima are taken."""

    @property
    def over_words(self) -> str:
        """The other axes in words, e.g. "headings and torso heights"."""
        words = [_PLURALS.get(name, f"{name.replace('_', ' ')}s") for name in self.over]
        return " and ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words or ["ways"])

    @classmethod
    def of(cls, scores: ScoreTable, grid: Grid) -> PlaceMap:
        """Return the map over all states of the environment.

        Args:
            scores: Scores of every configuration of the grid.
            grid: The grid.
        """
        return cls._of_rows(scores, grid, None)

    @classmethod
    def of_state(cls, scores: ScoreTable, grid: Grid, state: int) -> PlaceMap:
        """Return the map of one state of the environment.

        Args:
            scores: Scores of every configuration of the grid.
            grid: The grid.
            state: Number of the state, in C order over the environment's axes.

        Raises:
            GridError: If there is no state of that number.
        """
        return cls._of_rows(scores, grid, state)

    @classmethod
    def _of_rows(cls, scores: ScoreTable, grid: Grid, state: int | None) -> PlaceMap:
        """Return the map of one state, or of all for None."""
        rows = rows_of_state(grid, state)
        # Contact of the body does not depend on the goal.
        blocked = scores.has_no_free_body[rows]
        excluded = np.asarray(scores.reason[rows, 0] == Reason.EXCLUDED)
        axes = _axes(grid, state)
        return cls(
            x=grid.axis("base_x").values,
            y=grid.axis("base_y").values,
            reachability=best_per_place(grid, scores.reachability(rows), state),
            manipulability=best_per_place(grid, scores.manipulability(rows), state),
            free=best_per_place(grid, ~blocked, state),
            excluded=~best_per_place(grid, ~excluded, state) if np.any(excluded) else None,
            # Axes of one value are left out. Headings and torso heights come first.
            over=tuple(a.name for a in reversed(axes) if a.count > 1 and a.name not in _PLACE),
        )


def best_per_place(grid: Grid, values: NDArray[Any], state: int | None = None) -> NDArray[Any]:
    """Return the greatest value at each base position, shape (X, Y).

    Args:
        grid: The grid.
        values: A value for each configuration of the state, or of the grid if `state` is None, in
            flat order.
        state: Number of the environment's state, in C order over its axes; None for all states.
    """
    axes = _axes(grid, state)
    others = tuple(i for i, axis in enumerate(axes) if axis.name not in _PLACE)
    return np.asarray(values.reshape([axis.count for axis in axes]).max(axis=others))


def rows_of_state(grid: Grid, state: int | None = None) -> slice:
    """Return the flat indices of the configurations in one state of the environment, None for all.

    Raises:
        GridError: If there is no state of that number.
    """
    if state is None:
        return slice(0, grid.size)
    states = math.prod(grid.environment_shape)
    if not 0 <= state < states:
        raise GridError(f"no state {state} of the environment: it has {states}, from 0.")
    return slice(state * grid.state_size, (state + 1) * grid.state_size)


def _axes(grid: Grid, state: int | None) -> tuple[Axis, ...]:
    """Return the axes of the configurations of a state, or of the grid for None, in flat order."""
    return grid.axes if state is None else grid.axes[len(grid.environment_axes) :]

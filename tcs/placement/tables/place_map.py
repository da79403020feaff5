"""The best that each base place has to offer, over all headings, torso heights and beds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import GridError
from tcs.model.grid import Axis, Grid
from tcs.placement.tables import Reason, ScoreTable
from tcs.placement.tables.equations import tc_manipulability, tc_reachability

FloatArray = NDArray[np.float64]
_PLACE = ("base_x", "base_y")
_PLURALS = {"base_yaw": "headings", "torso": "torso heights"}


@dataclass(frozen=True, eq=False)
class PlaceMap:
    """Scores of base places on a grid in x and y.

    Both scores of a place are maxima by themselves: they may belong to different headings.
    """

    x: FloatArray
    """Places along x [m], shape (X,)."""
    y: FloatArray
    """Places along y [m], shape (Y,)."""
    reachability: FloatArray
    """Greatest P_R of a single configuration at each place, shape (X, Y)."""
    manipulability: FloatArray
    """Greatest P_M of a single configuration at each place, shape (X, Y)."""
    free: NDArray[np.bool_]
    """Whether the robot can stand there in at least one way, shape (X, Y)."""
    over: tuple[str, ...] = ()
    """Names of the other axes, of whose values the best one counts."""

    @property
    def over_words(self) -> str:
        """The other axes in words, e.g. "headings and torso heights"."""
        words = [_PLURALS.get(name, f"{name.replace('_', ' ')}s") for name in self.over]
        return " and ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words or ["ways"])

    @classmethod
    def of(cls, scores: ScoreTable, grid: Grid) -> PlaceMap:
        """Return the map of a score table, the best of all states of the environment.

        Args:
            scores: Scores of every configuration of the grid.
            grid: The grid.
        """
        return cls._of_rows(scores, grid, slice(None), grid.axes)

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
        states = math.prod(grid.environment_shape)
        if not 0 <= state < states:
            raise GridError(f"no state {state} of the environment: it has {states}, from 0.")
        size = grid.size // states
        own = grid.axes[len(grid.environment_axes) :]
        return cls._of_rows(scores, grid, slice(state * size, (state + 1) * size), own)

    @classmethod
    def _of_rows(
        cls, scores: ScoreTable, grid: Grid, rows: slice, axes: Sequence[Axis]
    ) -> PlaceMap:
        """Return the map of some rows, which are in C order over some axes."""
        shape = tuple(axis.count for axis in axes)
        others = tuple(i for i, axis in enumerate(axes) if axis.name not in _PLACE)

        def per_place(values: NDArray[Any]) -> NDArray[Any]:
            return np.asarray(values.reshape(shape).max(axis=others))

        reached, dexterity = scores.reached[rows], scores.dexterity[rows]
        # The body is in the way, or not, whatever the goal.
        blocked = (scores.reason[rows] == Reason.BODY_BLOCKED).any(axis=1)
        return cls(
            x=grid.axis("base_x").values,
            y=grid.axis("base_y").values,
            reachability=per_place(tc_reachability(reached, scores.weights)),
            manipulability=per_place(tc_manipulability(dexterity, scores.weights)),
            free=per_place(~blocked),
            # An axis of one value leaves nothing to choose from. Headings and heights first.
            over=tuple(a.name for a in reversed(axes) if a.count > 1 and a.name not in _PLACE),
        )

"""The best that each base place has to offer, over all headings, torso heights and beds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.space import Grid
from tcs.tables import Reason, ScoreTable

FloatArray = NDArray[np.float64]


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

    @classmethod
    def of(cls, scores: ScoreTable, grid: Grid) -> PlaceMap:
        """Return the map of a score table.

        Args:
            scores: Scores of every configuration of the grid.
            grid: The grid.
        """
        # The body is in the way, or not, whatever the goal.
        blocked = (scores.reason == Reason.BODY_BLOCKED).any(axis=1)
        return cls(
            x=grid.axis("base_x").values,
            y=grid.axis("base_y").values,
            reachability=_per_place(scores.reachability(), grid),
            manipulability=_per_place(scores.manipulability(), grid),
            free=_per_place(~blocked, grid),
        )


def _per_place(values: NDArray[Any], grid: Grid) -> NDArray[Any]:
    """Return the greatest value at each base place, shape (X, Y)."""
    names = [axis.name for axis in grid.axes]
    others = tuple(i for i, name in enumerate(names) if name not in ("base_x", "base_y"))
    return np.asarray(values.reshape(grid.shape).max(axis=others))

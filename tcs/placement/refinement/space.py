"""The continuous space around a grid: ranges of its axes, and which sets are allowed in it."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Self

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.model.grid import ROBOT_AXES, Grid
from tcs.placement.tables import SetTable
from tcs.placement.tables.sets import DISTANCE_TOLERANCE

FULL_TURN = 2.0 * math.pi
LEAST_CELL = {"m": 0.15, "rad": 0.5}
"""Least half width of the first cells [m, rad]: a fine grid does not keep the search in a basin."""


@dataclass(frozen=True, eq=False)
class Space:
    """Every value between the first and the last one of each axis of a grid."""

    low: FloatArray
    """Least values [m or rad], shape (axes,)."""
    high: FloatArray
    """Greatest values, shape (axes,)."""
    cell: FloatArray
    """Half widths of the first cells, at least a step of the grid; 0 for an axis that keeps its
    values, shape (axes,)."""
    periodic: BoolArray
    """Whether an axis is a heading that the grid covers all around, shape (axes,)."""
    min_distance: float
    """Least base distance of two members of a set [m]."""
    same_environment: bool
    """Whether the members of a set share the state of the environment."""

    @classmethod
    def of(cls, grid: Grid, sets: SetTable | None = None, *, fixed: Collection[str] = ()) -> Self:
        """Return the space of a grid, with the rules of its sets if there are any.

        Args:
            grid: The grid.
            sets: Its sets.
            fixed: Axes that keep the values of the grid.
        """
        values = [axis.values for axis in grid.axes]
        cell = [
            max(v[1] - v[0], LEAST_CELL[axis.held_unit])
            if v.size > 1 and axis.name not in fixed
            else 0.0
            for v, axis in zip(values, grid.axes, strict=True)
        ]
        return cls(
            low=np.array([v[0] for v in values]),
            high=np.array([v[-1] for v in values]),
            cell=np.array(cell),
            periodic=np.array(
                [
                    axis.name == "base_yaw" and axis.count * axis.step >= 360.0 - 1e-6
                    for axis in grid.axes
                ]
            ),
            min_distance=0.0 if sets is None else sets.min_distance,
            same_environment=sets is not None and sets.same_environment,
        )

    @property
    def environment_axes(self) -> int:
        """Number of axes that move the environment; they come first."""
        return self.cell.size - len(ROBOT_AXES)

    def inside(self, values: FloatArray) -> FloatArray:
        """Return values moved into the ranges, headings by full turns, shape (..., axes)."""
        turned = self.low + np.mod(values - self.low, FULL_TURN)
        return np.where(self.periodic, turned, np.clip(values, self.low, self.high))

    def allowed(self, members: FloatArray) -> BoolArray:
        """Return which sets are allowed, given their members' values (n, m, axes), shape (n,)."""
        allowed = np.ones(len(members), dtype=np.bool_)
        x = len(ROBOT_AXES)  # counted from the end
        for a in range(members.shape[1]):
            for b in range(a):
                apart = members[:, a, -x : -x + 2] - members[:, b, -x : -x + 2]
                distance = np.hypot(apart[:, 0], apart[:, 1])
                allowed &= distance >= self.min_distance - DISTANCE_TOLERANCE
                if self.same_environment:
                    count = self.environment_axes
                    allowed &= np.all(members[:, a, :count] == members[:, b, :count], axis=1)
        return allowed

"""Rows: the configurations that are scored, wherever they come from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tcs.kernel.arrays import FloatArray, GridArrays, IntArray


class Rows(NamedTuple):
    """Initial configurations, eta in the TCS paper: one in each row.

    Rows with the same environment state and base pose should follow each other: what depends on
    these alone is done once for all of them.
    """

    state: IntArray
    """Number of the environment state in the problem, shape (n,)."""
    x: FloatArray
    """x of the base in W [m], shape (n,)."""
    y: FloatArray
    """y of the base in W [m], shape (n,)."""
    yaw: FloatArray
    """Heading of the base [rad], shape (n,)."""
    torso: IntArray
    """Number of the torso level in the problem, shape (n,)."""

    @property
    def number(self) -> int:
        """Number of rows."""
        return len(self.state)

    def at(self, which: slice | NDArray[np.bool_] | IntArray) -> Rows:
        """Return some of the rows."""
        return Rows(
            np.ascontiguousarray(self.state[which]),
            np.ascontiguousarray(self.x[which]),
            np.ascontiguousarray(self.y[which]),
            np.ascontiguousarray(self.yaw[which]),
            np.ascontiguousarray(self.torso[which]),
        )


def grid_rows(grid: GridArrays, start: int = 0, stop: int | None = None) -> Rows:
    """Return the configurations start <= h < stop of a grid, in its flat order.

    Args:
        grid: The grid.
        start: First configuration.
        stop: One after the last configuration; None for all that follow.
    """
    return rows_at(grid, np.arange(start, grid.size if stop is None else stop))


def rows_at(grid: GridArrays, configurations: ArrayLike) -> Rows:
    """Return configurations of a grid.

    Args:
        grid: The grid.
        configurations: Their flat indices, shape (n,).
    """
    at = np.unravel_index(np.asarray(configurations, dtype=np.int64), grid.shape)
    state, x, y, yaw, torso = (np.array(index, dtype=np.int64, order="C") for index in at)
    return Rows(state, grid.base_x[x], grid.base_y[y], grid.base_yaw[yaw], torso)


def single_row(
    x: float = 0.0, y: float = 0.0, yaw: float = 0.0, *, state: int = 0, torso: int = 0
) -> Rows:
    """Return one configuration as rows: base pose in W [m, rad], environment state, torso level."""
    base = np.array([[x], [y], [yaw]], dtype=np.float64)
    return Rows(np.array([state]), base[0], base[1], base[2], np.array([torso]))


def no_rows() -> Rows:
    """Return no rows, with which compiled code is loaded."""
    none, nowhere = np.empty(0, np.int64), np.empty(0)
    return Rows(none, nowhere, nowhere, nowhere, none)

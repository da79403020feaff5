"""Base poses as a heat map: the best score of each base position, and the headings there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class HeatMap:
    """Scores of base positions on a lattice that contains the origin."""

    step: float
    """Distance of neighbouring positions [m]."""
    first: tuple[int, int]
    """x and y of the first column and row, in steps."""
    best: FloatArray
    """Greatest score over the headings, shape (rows along y, columns along x); NaN where no base
    pose is."""

    @property
    def edges(self) -> tuple[FloatArray, FloatArray]:
        """Edges of the columns along x and of the rows along y [m]."""
        rows, columns = self.best.shape
        x, y = (
            (np.arange(count + 1) + begin - 0.5) * self.step
            for begin, count in zip(self.first, (columns, rows), strict=True)
        )
        return x, y


def heat_map_of(poses: FloatArray, step: float) -> HeatMap:
    """Return the heat map of base poses.

    Args:
        poses: x, y [m], yaw [rad] and score, shape (n, 4), n >= 1.
        step: Distance of neighbouring positions [m].
    """
    along = positions_in_steps(poses, step)
    first, last = along.min(axis=0), along.max(axis=0)
    columns, rows = last - first + 1
    best = np.full((rows, columns), -np.inf)
    np.maximum.at(best, (along[:, 1] - first[1], along[:, 0] - first[0]), poses[:, 3])
    best[np.isneginf(best)] = np.nan
    return HeatMap(step, (int(first[0]), int(first[1])), best)


def headings_at(poses: FloatArray, step: float) -> dict[tuple[int, int], list[tuple[float, float]]]:
    """Return the headings of each base position, in degrees from 0 to 360, and their scores.

    Args:
        poses: x, y [m], yaw [rad] and score, shape (n, 4).
        step: Distance of neighbouring positions [m].

    Returns:
        Headings and scores, ascending by the heading; by x and y in steps.
    """
    yaw_deg = np.round(np.degrees(poses[:, 2]), 3) % 360.0
    found: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for row in np.argsort(yaw_deg, kind="stable"):
        x, y = positions_in_steps(poses[row : row + 1], step)[0].tolist()
        found.setdefault((x, y), []).append((float(yaw_deg[row]), float(poses[row, 3])))
    return found


def positions_in_steps(poses: FloatArray, step: float) -> IntArray:
    """Return the positions of base poses in whole steps, shape (n, 2)."""
    return np.rint(poses[:, :2] / step).astype(np.int64)

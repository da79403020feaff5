"""Closed polygons: area, points at equal distances, and the grid points inside.

A polygon is an array of corners, shape (n, 2), without a repeated last corner. Outer boundaries run
anticlockwise, holes clockwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray


def signed_area(polygon: FloatArray) -> float:
    """Return the area [m^2], positive for an anticlockwise polygon."""
    x, y = polygon.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def spaced(path: FloatArray, count: int) -> FloatArray:
    """Return points at equal distances along an open path, without its last point.

    Args:
        path: Corners, shape (n, 2).
        count: Number of points, the first of them that of the path, shape (count, 2).
    """
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = length[-1] * np.arange(count) / count
    return np.column_stack([np.interp(at, length, path[:, k]) for k in range(2)])


def winding_numbers(polygons: FloatArray, x: FloatArray, y: FloatArray) -> NDArray[np.int16]:
    """Return how often each polygon winds around each point of a grid.

    Args:
        polygons: Corners, shape (n, corners, 2).
        x: Coordinates of the grid [m], equally spaced and ascending, shape (nx,).
        y: The same along y, shape (ny,).

    Returns:
        Shape (n, nx, ny): 1 inside an anticlockwise polygon, 0 outside.
    """
    found = np.zeros((len(polygons), len(x), len(y)), dtype=np.int16)
    crossings = _Crossings.of(polygons, x, y)
    if not len(crossings.row):
        return found
    low, high = int(crossings.rows.min()), int(crossings.rows.max())
    left, right = int(crossings.column.min()), int(crossings.column.max())
    shape = (len(polygons), right - left + 1, high - low)
    flat = (crossings.polygon * shape[1] + crossings.column - left) * shape[2]
    flat += crossings.row - low
    sign = np.where(crossings.upward, 1.0, -1.0)
    counts = np.bincount(flat, sign, shape[0] * shape[1] * shape[2]).reshape(shape)
    # Crossings sum to 0 on each line, so that those to the right are minus those to the left.
    found[:, left:right, low:high] = -np.cumsum(counts[:, :-1], axis=1)
    return found


class _Crossings(NamedTuple):
    """Crossings of the edges of polygons with the lines of a grid along x."""

    rows: NDArray[np.int64]
    """First line at or above each corner, shape (n, corners)."""
    next_rows: NDArray[np.int64]
    """The same of the next corner."""
    polygon: NDArray[np.int64]
    """Polygon of each crossing, shape (m,)."""
    row: NDArray[np.int64]
    """Its line."""
    column: NDArray[np.int64]
    """First point of the line at or after it; the number of points if there is none."""
    upward: BoolArray
    """Whether the edge runs upward."""

    @classmethod
    def of(cls, polygons: FloatArray, x: FloatArray, y: FloatArray) -> _Crossings:
        """Return the crossings; the arguments are those of `winding_numbers`."""
        step = y[1] - y[0] if len(y) > 1 else 1.0
        spacing = x[1] - x[0] if len(x) > 1 else 1.0
        # A point is below the corners of the rows after its own, left of those after its column.
        rows = np.clip(np.ceil((polygons[..., 1] - y[0]) / step), 0, len(y)).astype(np.int64)
        next_rows = np.roll(rows, -1, axis=1)
        change = (next_rows - rows).ravel()
        crossed = np.abs(change)
        edge = np.repeat(np.arange(crossed.size), crossed)
        first = np.minimum(rows, next_rows).ravel() - (np.cumsum(crossed) - crossed)
        row = np.arange(edge.size) + first[edge]
        a = polygons.reshape(-1, 2)
        along = np.roll(polygons, -1, axis=1).reshape(-1, 2) - a
        slope = np.divide(along[:, 0], along[:, 1], out=np.zeros(len(a)), where=along[:, 1] != 0.0)
        at = a[edge, 0] + (y[row] - a[edge, 1]) * slope[edge]
        column = np.clip(np.ceil((at - x[0]) / spacing), 0, len(x)).astype(np.int64)
        return cls(rows, next_rows, edge // polygons.shape[1], row, column, change[edge] > 0)


def counts_inside(polygons: FloatArray, x: FloatArray, y: FloatArray) -> NDArray[np.int64]:
    """Return how many polygons wind anticlockwise around each point of a grid.

    Most polygons meet each line of the grid along x twice, once upward and once downward; the
    points between are then counted without a grid for each polygon.

    Args:
        polygons: Corners, shape (n, corners, 2).
        x: Coordinates of the grid [m], equally spaced and ascending, shape (nx,).
        y: The same along y, shape (ny,).

    Returns:
        Shape (nx, ny).
    """
    crossings = _Crossings.of(polygons, x, y)
    rows = crossings.rows
    extent = rows.max(axis=1) - rows.min(axis=1)
    twice = np.abs(crossings.next_rows - rows).sum(axis=1) == 2 * extent
    total = np.zeros((len(y), len(x) + 1), dtype=np.int64)
    used = twice[crossings.polygon]
    # Of each line, the column of the downward crossing and that of the upward one.
    line = crossings.polygon * len(y) + crossings.row
    ends = np.zeros((2, len(polygons) * len(y)), dtype=np.int64)
    ends[crossings.upward.astype(np.int64)[used], line[used]] = crossings.column[used]
    down, up = ends
    around = np.flatnonzero(up > down)
    row = around % len(y)
    for column, sign in ((down[around], 1), (up[around], -1)):
        flat = row * total.shape[1] + column
        total += sign * np.bincount(flat, minlength=total.size).reshape(total.shape)
    found = np.cumsum(total, axis=1)[:, :-1].T
    if not twice.all():
        found = found + np.count_nonzero(winding_numbers(polygons[~twice], x, y) > 0, axis=0)
    return np.asarray(found)


def inside(polygons: Sequence[FloatArray], x: FloatArray, y: FloatArray) -> BoolArray:
    """Return which points of a grid lie in a region of several boundaries and holes.

    Args:
        polygons: Its boundaries, outer ones anticlockwise and holes clockwise.
        x: Coordinates of the grid [m], equally spaced and ascending, shape (nx,).
        y: The same along y, shape (ny,).

    Returns:
        Shape (nx, ny).

    >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> inside([square], np.array([0.5, 1.5, 2.5]), np.array([0.5, 1.5])).sum(axis=1).tolist()
    [2, 2, 0]
    """
    around = np.zeros((len(x), len(y)), dtype=np.int16)
    for polygon in polygons:
        around += winding_numbers(polygon[None], x, y)[0]
    return around > 0


def distances(polygons: Sequence[FloatArray], points: FloatArray) -> FloatArray:
    """Return the distance of points from the nearest boundary [m], shape (n,).

    Args:
        polygons: At least one boundary.
        points: Shape (n, 2).
    """
    a = np.concatenate(polygons)
    along = np.concatenate([np.roll(polygon, -1, axis=0) for polygon in polygons]) - a
    square = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    nearest = np.full(len(points), np.inf)
    for start, edge, length in zip(a, along, square, strict=True):
        offset = points - start
        t = np.clip(offset @ edge / length, 0.0, 1.0)
        gap = offset - t[:, None] * edge
        np.minimum(nearest, np.hypot(gap[:, 0], gap[:, 1]), out=nearest)
    return nearest

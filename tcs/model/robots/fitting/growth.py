"""Boxes and capsules that grow from inside a solid until they protrude as far as they may."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.enclosing.growing import counts_beyond, grow_boxes
from tcs.model.robots.fitting.bounding import hull_corners
from tcs.model.robots.fitting.solid import Solid, distances

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_BORDER = 3
"""Cells around the space that a grid covers."""
_AXIS_SAMPLES = 24
"""Points of a capsule's axis at which its radius is measured."""
_DRAWN = 8
"""Capsules drawn for each one that is kept."""


def extremes(solid: Solid, protrusion: float) -> FloatArray:
    """Return the corners of the hull of the points of a grid no farther from a solid, (n, 3) [m].

    Args:
        solid: The solid.
        protrusion: Distance from it [m].
    """
    near = solid.outside <= protrusion
    # Of each row, the first and the last point.
    ends = near & ~(np.roll(near, 1, axis=2) & np.roll(near, -1, axis=2))
    return hull_corners(solid.points(ends))


def boxes_in(
    solid: Solid,
    protrusion: float,
    corners: FloatArray,
    R: FloatArray,
    seeds: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Return boxes along given axes that reach no farther out of a solid than allowed.

    Each grows from a seed, side after side in an order of its own, until no side can move.

    Args:
        solid: The solid.
        protrusion: Greatest distance of a point of a box from the solid [m].
        corners: As of `extremes`.
        R: Axes of the boxes as columns, shape (3, 3).
        seeds: Points to start from [m], shape (n, 3); those outside are left out.
        rng: Source of the orders.

    Returns:
        Least and greatest coordinates along the axes [m], shape (m, 2, 3).
    """
    seen, border = corners @ R, _BORDER * solid.pitch
    low, high = seen.min(axis=0) - border, seen.max(axis=0) + border
    count = np.ceil((high - low) / solid.pitch).astype(np.int64) + 1
    # Sampling point k of the new grid is low @ R.T + pitch * R @ k, in cells of the solid's grid.
    start = (R @ low - solid.origin) / solid.pitch
    blocked = counts_beyond(solid.outside, solid.pitch, protrusion, R, start, count)
    cells = np.clip(np.rint((seeds @ R - low) / solid.pitch).astype(np.int64), 0, count - 1)
    boxes = grown(blocked, cells[_are_free(blocked, cells)], rng)
    boxes = np.unique(boxes.reshape(-1, 6), axis=0).reshape(-1, 2, 3)
    return np.asarray(low + boxes * solid.pitch)


def sums_before(cells: BoolArray) -> NDArray[np.int32]:
    """Return how many cells are set before each corner of a grid, shape (nx + 1, ny + 1, nz + 1).

    Args:
        cells: The cells, shape (nx, ny, nz).
    """
    counts = np.pad(cells.astype(np.int32), ((1, 0),) * 3)
    for k in range(3):
        np.cumsum(counts, axis=k, out=counts)
    return counts


def grown(counts: NDArray[np.int32], seeds: IntArray, rng: np.random.Generator) -> IntArray:
    """Return the first and last cells of boxes without blocked cells, shape (n, 2, 3).

    Args:
        counts: Numbers of cells that a box must not contain, from `sums_before`.
        seeds: Cells from which the boxes grow, shape (n, 3).
        rng: Source of the order in which the sides of each box move.
    """
    boxes = np.stack([seeds, seeds], axis=1)
    grow_boxes(counts, boxes, np.argsort(rng.random((len(seeds), 6)), axis=1))
    return boxes


def _are_free(counts: NDArray[np.int32], cells: IntArray) -> BoolArray:
    """Return which cells are not blocked, from sums over all cells before each, shape (n,)."""
    i, j, k = cells.T
    last = counts[i + 1, j + 1, k + 1] - counts[i + 1, j + 1, k]
    last -= counts[i + 1, j, k + 1] - counts[i + 1, j, k]
    first = counts[i, j + 1, k + 1] - counts[i, j + 1, k]
    first -= counts[i, j, k + 1] - counts[i, j, k]
    return np.asarray(last == first)


def capsules_in(
    solid: Solid, protrusion: float, count: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return large capsules that reach no farther out of a solid than allowed.

    Args:
        solid: The solid.
        protrusion: Greatest distance of a point of a capsule from the solid [m].
        count: Number of capsules.
        rng: Source of the axes, which connect random points, mostly deep inside.

    Returns:
        Ends of the axes, shapes (n, 3), and radii, shape (n,) [m]; n is at most `count`.
    """
    depth = distances(solid.outside <= protrusion, solid.pitch, np.inf)
    cells = np.argwhere(depth > 2 * solid.pitch)
    if not len(cells):
        return np.empty((0, 3)), np.empty((0, 3)), np.empty(0)
    weight = depth[tuple(cells.T)] ** 3
    drawn = [rng.choice(len(cells), count * _DRAWN, p=weight / weight.sum()) for _ in range(2)]
    first, last = cells[drawn[0]], cells[drawn[1]]
    # Some have no length: spheres.
    last[: len(last) // 6] = first[: len(first) // 6]
    along = np.linspace(0.0, 1.0, _AXIS_SAMPLES)[None, :, None]
    axis = np.rint(first[:, None] * (1 - along) + last[:, None] * along).astype(np.int64)
    radius = depth[tuple(np.moveaxis(axis, 2, 0))].min(axis=1) - solid.pitch
    length = np.linalg.norm(last - first, axis=1) * solid.pitch
    volume = np.where(radius > 2 * solid.pitch, radius**2 * (length + 4 / 3 * radius), 0.0)
    kept = np.argsort(-volume, kind="stable")[:count]
    kept = kept[volume[kept] > 0.0]
    ends = (cell[kept] * solid.pitch + solid.origin for cell in (first, last))
    return *ends, radius[kept]

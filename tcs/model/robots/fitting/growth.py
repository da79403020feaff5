"""Boxes and capsules that grow from inside a solid until they protrude as far as they may."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse

from tcs.model.robots.fitting.bounding import hull_corners
from tcs.model.robots.fitting.solid import Solid, distances

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_STEPS = (8, 4, 2, 1)
"""Cells by which a side of a box moves, in one round after the other."""
_BORDER = 3
"""Cells around the space that a grid covers."""
_SAMPLE = 20_000
"""Points of a solid that give its extent along other axes."""
_AXIS_SAMPLES = 24
"""Points of a capsule's axis at which its radius is measured."""
_DRAWN = 8
"""Capsules drawn for each one that is kept."""


def boxes_in(
    solid: Solid,
    protrusion: float,
    within: FloatArray,
    R: FloatArray,
    seeds: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Return boxes along given axes that reach no farther out of a solid than allowed.

    Each grows from a seed, side after side in an order of its own, until no side can move.

    Args:
        solid: The solid.
        protrusion: Greatest distance of a point of a box from the solid [m].
        within: The points of the grid that are no farther from the solid [m], shape (k, 3).
        R: Axes of the boxes as columns, shape (3, 3).
        seeds: Points to start from [m], shape (n, 3); those outside are left out.
        rng: Source of the orders.

    Returns:
        Least and greatest coordinates along the axes [m], shape (m, 2, 3).
    """
    if len(within) > _SAMPLE:
        within = within[rng.choice(len(within), _SAMPLE, replace=False)]
    seen, border = hull_corners(within) @ R, _BORDER * solid.pitch
    low, high = seen.min(axis=0) - border, seen.max(axis=0) + border
    count = np.ceil((high - low) / solid.pitch).astype(np.int64) + 1
    # Sampling point k of the new grid is low @ R.T + pitch * R @ k, in cells of the solid's grid.
    start = (R @ low - solid.origin) / solid.pitch
    free = _interpolated(solid.outside, R, start, tuple(count.tolist())) <= protrusion
    cells = np.clip(np.rint((seeds @ R - low) / solid.pitch).astype(np.int64), 0, count - 1)
    cells = cells[free[tuple(cells.T)]]
    boxes = grown(sums_before(~free), cells, rng)
    boxes = np.unique(boxes.reshape(-1, 6), axis=0).reshape(-1, 2, 3)
    return np.asarray(low + boxes * solid.pitch)


def _interpolated(
    values: NDArray[np.float32], R: FloatArray, start: FloatArray, count: tuple[int, ...]
) -> NDArray[np.float32]:
    """Return values of a grid at the points of another one, linear between its own.

    Args:
        values: The values; beyond the grid, those of its border hold.
        R: Axes of the other grid, of the same pitch, as columns, shape (3, 3).
        start: Its first point, in cells of the grid, shape (3,).
        count: Its shape.
    """
    still = np.flatnonzero(np.diag(R) == 1.0)
    if not len(still):
        found = ndimage.affine_transform(values, R, start, count, order=1, mode="nearest")
        return np.asarray(found)
    # Turned about an axis of the grid, all planes across it are interpolated in the same way.
    axis = int(still[0])
    first, second = (k for k in range(3) if k != axis)
    low, part = _between(start[axis] + np.arange(count[axis]), values.shape[axis])
    planes = np.moveaxis(values, axis, 2)
    along = planes[..., low] * (1.0 - part) + planes[..., low + 1] * part
    i, j = np.indices((count[first], count[second])).reshape(2, -1)
    u, of_u = _between(start[first] + R[first, first] * i + R[first, second] * j, len(planes))
    across = planes.shape[1]
    v, of_v = _between(start[second] + R[second, first] * i + R[second, second] * j, across)
    corner = u * across + v
    weights = np.stack(
        [(1 - of_u) * (1 - of_v), (1 - of_u) * of_v, of_u * (1 - of_v), of_u * of_v], axis=1
    )
    columns = np.stack([corner, corner + 1, corner + across, corner + across + 1], axis=1)
    rows = np.arange(0, 4 * len(i) + 1, 4)
    matrix = sparse.csr_array(
        (weights.ravel(), columns.ravel(), rows), shape=(len(i), len(planes) * across)
    )
    turned = (matrix @ along.reshape(-1, count[axis])).astype(np.float32)
    shape = count[first], count[second], count[axis]
    return np.moveaxis(turned.reshape(shape), 2, axis)


def _between(at: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
    """Return the cell before each coordinate within a row of cells, and the part of the way on."""
    at = at.clip(0.0, count - 1.0)
    low = at.astype(np.int64).clip(0, count - 2)
    return low, at - low


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
    last, rows = np.array(counts.shape) - 2, np.arange(len(seeds))
    boxes = np.stack([seeds, seeds], axis=1)
    sides = np.argsort(rng.random((len(seeds), 6)), axis=1)
    for step in _STEPS:
        growing = np.ones(len(seeds), np.bool_)
        while growing.any():
            moved = np.zeros(len(seeds), np.bool_)
            for turn in range(6):
                end, axis = np.divmod(sides[:, turn], 3)
                tried = boxes.copy()
                tried[rows, end, axis] += np.where(end == 0, -step, step)
                inside = (tried[:, 0] >= 0).all(axis=1) & (tried[:, 1] <= last).all(axis=1)
                inside &= growing
                inside[inside] = _blocked_cells(counts, tried[inside]) == 0
                boxes[inside] = tried[inside]
                moved |= inside
            growing = moved
    return boxes


def _blocked_cells(counts: NDArray[np.int32], boxes: IntArray) -> IntArray:
    """Return the number of blocked cells in boxes, from sums over all cells before each, (n,)."""
    (a, b, c), (d, e, f) = boxes[:, 0].T, boxes[:, 1].T + 1
    return np.asarray(
        counts[d, e, f]
        - counts[a, e, f]
        - counts[d, b, f]
        - counts[d, e, c]
        + counts[a, b, f]
        + counts[a, e, c]
        + counts[d, b, c]
        - counts[a, b, c]
    )


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
    depth = distances(solid.outside <= protrusion, solid.pitch)
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

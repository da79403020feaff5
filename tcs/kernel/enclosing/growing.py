"""Boxes that grow on a grid whose axes are rotated against those of the field that limits them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, jit

Counts = NDArray[np.int32]

_STEPS = (8, 4, 2, 1)
"""Cells by which a side of a box moves, in one round after the other."""


@jit
def counts_beyond(
    distances: NDArray[np.float32],
    pitch: float,
    limit: float,
    R: FloatArray,
    start: FloatArray,
    shape: IntArray,
) -> Counts:
    """Return how many cells of a rotated grid before each corner are farther than a limit.

    Args:
        distances: Distances from something on a grid [m], linear between its cells; beyond the
            grid, those at its border hold. Shape (nx, ny, nz), each at least 2.
        pitch: Distance of neighbouring cells [m].
        limit: The limit [m].
        R: Axes of the rotated grid, of the same pitch, as columns, shape (3, 3).
        start: Its first cell, in cells of the field, shape (3,).
        shape: Its numbers of cells (mx, my, mz), shape (3,).

    Returns:
        Counts, shape (mx + 1, my + 1, mz + 1).
    """
    mx, my, mz = shape
    counts = np.zeros((mx + 1, my + 1, mz + 1), np.int32)
    for i in range(mx):
        for j in range(my):
            x = start[0] + R[0, 0] * i + R[0, 1] * j
            y = start[1] + R[1, 0] * i + R[1, 1] * j
            z = start[2] + R[2, 0] * i + R[2, 1] * j
            in_row = 0
            for k in range(mz):
                at = x + R[0, 2] * k, y + R[1, 2] * k, z + R[2, 2] * k
                in_row += _is_beyond(distances, pitch, limit, at)
                counts[i + 1, j + 1, k + 1] = (
                    in_row + counts[i, j + 1, k + 1] + counts[i + 1, j, k + 1] - counts[i, j, k + 1]
                )
    return counts


@inner
def _is_beyond(
    distances: NDArray[np.float32], pitch: float, limit: float, at: tuple[float, float, float]
) -> bool:
    """Return whether the distance at a point between cells exceeds a limit."""
    i, u = _between(at[0], distances.shape[0])
    j, v = _between(at[1], distances.shape[1])
    k, w = _between(at[2], distances.shape[2])
    # Across a cell, distances change by less than twice its edge.
    if distances[i, j, k] > limit + 2 * pitch:
        return True
    if distances[i, j, k] < limit - 2 * pitch:
        return False
    a, b = distances[i, j], distances[i, j + 1]
    c, d = distances[i + 1, j], distances[i + 1, j + 1]
    first = (1 - v) * ((1 - w) * a[k] + w * a[k + 1]) + v * ((1 - w) * b[k] + w * b[k + 1])
    second = (1 - v) * ((1 - w) * c[k] + w * c[k + 1]) + v * ((1 - w) * d[k] + w * d[k + 1])
    return bool(np.float32((1 - u) * first + u * second) > np.float32(limit))


@inner
def _between(at: float, count: int) -> tuple[int, float]:
    """Return the cell before a coordinate within a row of cells, and the part of the way on."""
    at = min(max(at, 0.0), count - 1.0)
    low = min(int(at), count - 2)
    return low, at - low


@jit
def grow_boxes(counts: Counts, boxes: IntArray, sides: IntArray) -> None:
    """Move the sides of boxes outward, in an order of their own, until none can move.

    Args:
        counts: Number of cells before each corner that a box must not contain.
        boxes: First and last cells of each box, shape (n, 2, 3); grown here.
        sides: Order of the sides of each box: axes, those of the last cells plus 3, shape (n, 6).
    """
    for n in range(len(boxes)):
        box = boxes[n]
        for step in _STEPS:
            is_growing = True
            while is_growing:
                is_growing = False
                for turn in range(6):
                    is_growing |= _is_moved(counts, box, sides[n, turn], step)


@inner
def _is_moved(counts: Counts, box: IntArray, side: int, step: int) -> bool:
    """Move a side of a box outward if it then contains no cell that it must not; return whether."""
    end, axis = side // 3, side % 3
    before = box[end, axis]
    after = before - step if end == 0 else before + step
    if after < 0 or after > counts.shape[axis] - 2:
        return False
    box[end, axis] = after
    a, b, c = box[0]
    d, e, f = box[1, 0] + 1, box[1, 1] + 1, box[1, 2] + 1
    blocked = (
        counts[d, e, f]
        - counts[a, e, f]
        - counts[d, b, f]
        - counts[d, e, c]
        + counts[a, b, f]
        + counts[a, e, c]
        + counts[d, b, c]
        - counts[a, b, c]
    )
    if blocked:
        box[end, axis] = before
    return blocked == 0

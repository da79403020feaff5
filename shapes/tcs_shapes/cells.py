"""Distances on a grid of cells, and the cells that a surface passes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner, jit

Squares = NDArray[np.int32]

FARTHEST = 20_000
"""Distance [cells] that no grid reaches, and whose square a 32-bit integer holds."""
_DEPTH = 256
"""Halvings of one triangle that are open at the same time; far more than its size allows."""
Counts = NDArray[np.int32]

_STEPS = (8, 4, 2, 1)
"""Cells by which a side of a box moves, in one round after the other."""


@jit
def squared_distances(cells: BoolArray, most: int) -> Squares:
    """Return the squared distance of each set cell from the nearest that is not set [cells].

    It is 0 for cells that are not set. Where the distance exceeds `most`, it may be too small, but
    is above most^2.

    Args:
        cells: Which cells are set, shape (nx, ny, nz).
        most: Greatest distance of interest, at most `FARTHEST` [cells].

    Source:
        One axis after the other: the least of squares along an axis plus those found before, as in
        Saito and Toriwaki, "New algorithms for Euclidean distance transformation of an
        n-dimensional digitized picture", 1994.
    """
    nx, ny, nz = cells.shape
    found = _along_first(cells, most + 1)
    plane = np.empty((ny, nz), np.int32)
    line = np.empty(nz, np.int32)
    for x in range(nx):
        plane[:] = found[x]
        for y in range(ny):
            row = found[x, y]
            k = 1
            while k <= most and k * k < _greatest(row):
                if y >= k:
                    _lower(row, plane[y - k], k * k)
                if y + k < ny:
                    _lower(row, plane[y + k], k * k)
                k += 1
            k = 1
            line[:] = row
            while k <= most and k < nz and k * k < _greatest(row):
                _lower(row[k:], line[: nz - k], k * k)
                _lower(row[: nz - k], line[k:], k * k)
                k += 1
    return found


@inner
def _along_first(cells: BoolArray, far: int) -> Squares:
    """Return squared distances along the first axis alone, at most far^2."""
    nx, ny, nz = cells.shape
    found = np.empty(cells.shape, np.int32)
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                before = found[x - 1, y, z] if x else far
                found[x, y, z] = min(before + 1, far) if cells[x, y, z] else 0
    for i in range(nx - 1):
        x = nx - 2 - i
        for y in range(ny):
            for z in range(nz):
                found[x, y, z] = min(found[x, y, z], found[x + 1, y, z] + 1)
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                found[x, y, z] *= found[x, y, z]
    return found


@inner
def _greatest(row: Squares) -> int:
    greatest = np.int32(0)
    for z in range(len(row)):
        greatest = max(greatest, row[z])
    return int(greatest)


@inner
def _lower(row: Squares, other: Squares, added: int) -> None:
    """Lower a row to another one plus a number where that is less."""
    step = np.int32(added)
    for z in range(len(row)):
        row[z] = min(row[z], other[z] + step)


@jit
def mark_surface(
    cells: BoolArray, triangles: FloatArray, longest: float, pitch: float, first: IntArray
) -> None:
    """Set the cells of all corners of triangles that are halved until no edge exceeds a length.

    Each is halved at the middle of its longest edge. Corners beyond the grid are left out.

    Args:
        cells: The cells, shape (nx, ny, nz); set here.
        triangles: Corners [m], shape (n, 3, 3).
        longest: Greatest edge of a piece [m].
        pitch: Distance of neighbouring cells [m].
        first: Numbers of the first cell, which is the position first * pitch, shape (3,).
    """
    open_ones, piece = np.empty((_DEPTH, 3, 3)), np.empty((3, 3))
    edges = np.empty(3)
    for i in range(len(triangles)):
        open_ones[0] = triangles[i]
        left = 1
        while left:
            left -= 1
            piece[:] = open_ones[left]
            for k in range(3):
                edges[k] = _length(piece, k, (k + 1) % 3)
            if max(edges[0], edges[1], edges[2]) <= longest or left + 2 > _DEPTH:
                _mark_corners(cells, piece, pitch, first)
                continue
            k = 0
            if not (edges[0] >= edges[1] and edges[0] >= edges[2]):
                k = 1 if edges[1] >= edges[2] else 2
            last = (k + 1) % 3
            open_ones[left] = piece
            open_ones[left + 1] = piece
            for axis in range(3):
                middle = (piece[k, axis] + piece[last, axis]) / 2
                open_ones[left, last, axis] = middle
                open_ones[left + 1, k, axis] = middle
            left += 2


@inner
def _length(piece: FloatArray, first: int, last: int) -> float:
    """Return the length of an edge of a triangle."""
    x = piece[last, 0] - piece[first, 0]
    y = piece[last, 1] - piece[first, 1]
    z = piece[last, 2] - piece[first, 2]
    return np.sqrt(x * x + y * y + z * z)


@inner
def _mark_corners(cells: BoolArray, piece: FloatArray, pitch: float, first: IntArray) -> None:
    for corner in range(3):
        x, y, z = (
            int(np.rint(piece[corner, 0] / pitch)) - first[0],
            int(np.rint(piece[corner, 1] / pitch)) - first[1],
            int(np.rint(piece[corner, 2] / pitch)) - first[2],
        )
        if 0 <= x < cells.shape[0] and 0 <= y < cells.shape[1] and 0 <= z < cells.shape[2]:
            cells[x, y, z] = True


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

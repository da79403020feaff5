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

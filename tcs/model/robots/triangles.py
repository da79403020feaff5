"""Triangles cut into pieces, so that several primitives can enclose one triangle together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def cut(triangles: FloatArray, longest: float) -> FloatArray:
    """Return triangles cut at the middle of their longest edge until none exceeds a length.

    Args:
        triangles: Corners [m], shape (n, 3, 3).
        longest: Greatest length of an edge of a piece [m].

    Returns:
        Corners of the pieces [m], shape (m, 3, 3).
    """
    done = []
    while len(triangles):
        edges = _edges(triangles)
        long = _greatest(edges) > longest
        done.append(triangles[~long])
        triangles = _halved(triangles[long], edges[:, long])
    return np.concatenate(done) if done else triangles


def halved(triangles: FloatArray) -> FloatArray:
    """Return both halves of triangles cut at the middle of their longest edge, shape (2 n, 3, 3).

    The first halves come first, then the second ones, in the order of the triangles.
    """
    return _halved(triangles, _edges(triangles))


def longest_edges(triangles: FloatArray) -> FloatArray:
    """Return the length of the longest edge of triangles [m], shape (n,)."""
    return _greatest(_edges(triangles))


def distinct(rows: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return the distinct rows in lexicographic order, and the number of each row among them.

    As `np.unique` along an axis, which compares rows one by one and takes several times as long.

    Args:
        rows: Shape (n, k).
    """
    order = np.lexsort(rows.T[::-1])
    in_order = rows[order]
    is_new = np.ones(len(rows), np.bool_)
    is_new[1:] = False
    for column in in_order.T:
        is_new[1:] |= column[1:] != column[:-1]
    number = np.empty(len(rows), np.int64)
    number[order] = np.cumsum(is_new) - 1
    return in_order[is_new], number


def _halved(triangles: FloatArray, edges: FloatArray) -> FloatArray:
    """Return both halves of triangles, given the lengths of their edges, shape (3, n)."""
    x, y, z = edges
    first = np.where((x >= y) & (x >= z), 0, np.where(y >= z, 1, 2))
    rows = np.arange(len(triangles))
    a, b, c = (triangles[rows, (first + k) % 3] for k in range(3))
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def _greatest(edges: FloatArray) -> FloatArray:
    """Return the greatest of three lengths, shape (n,), for shape (3, n)."""
    return np.asarray(np.maximum(np.maximum(edges[0], edges[1]), edges[2]))


def _edges(triangles: FloatArray) -> FloatArray:
    """Return the lengths of the edges from each corner to the next, shape (3, n)."""
    lengths = np.empty((3, len(triangles)))
    # By edge and coordinate: NumPy is slow along an axis of three.
    for k, out in enumerate(lengths):
        x, y, z = (triangles[:, (k + 1) % 3] - triangles[:, k]).T
        np.sqrt(x * x + y * y + z * z, out=out)
    return lengths

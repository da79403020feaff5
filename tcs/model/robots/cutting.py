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
        long = longest_edges(triangles) > longest
        done.append(triangles[~long])
        triangles = halved(triangles[long])
    return np.concatenate(done) if done else triangles


def halved(triangles: FloatArray) -> FloatArray:
    """Return both halves of triangles cut at the middle of their longest edge, shape (2 n, 3, 3).

    The first halves come first, then the second ones, in the order of the triangles.
    """
    rows, first = np.arange(len(triangles)), np.argmax(_edges(triangles), axis=1)
    a, b, c = (triangles[rows, (first + k) % 3] for k in range(3))
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def longest_edges(triangles: FloatArray) -> FloatArray:
    """Return the length of the longest edge of triangles [m], shape (n,)."""
    return np.asarray(_edges(triangles).max(axis=1, initial=0.0))


def _edges(triangles: FloatArray) -> FloatArray:
    """Return the lengths of the edges from each corner to the next, shape (n, 3)."""
    return np.asarray(np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2))

"""The distance of two surfaces at one posture, triangle by triangle.

It shares no code with what makes the tables of distances, and judges them.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

FloatArray = NDArray[np.float64]

_CHUNK = 200_000
"""Pairs of triangles compared at once."""


def surface_distance(first: FloatArray, second: FloatArray, farthest: float) -> float:
    """Return the distance of two surfaces [m], 0 where they cross, at most `farthest`.

    It is 0 too where one is within the convex hull of the other: triangles of a body inside another
    one are apart.

    Args:
        first: Triangles [m], shape (n, 3, 3).
        second: Triangles in the same frame [m], shape (m, 3, 3).
        farthest: Distance beyond which nothing is compared [m].
    """
    if _is_within(first, second) or _is_within(second, first):
        return 0.0
    for _ in range(2):
        first = _near(first, second, farthest)
        second = _near(second, first, farthest)
    if not (len(first) and len(second)):
        return farthest
    least = farthest
    low, high = second.min(axis=1), second.max(axis=1)
    rows = max(1, _CHUNK // len(second))
    for start in range(0, len(first), rows):
        some = first[start : start + rows]
        apart = np.maximum(
            some.min(axis=1)[:, None] - high[None], low[None] - some.max(axis=1)[:, None]
        )
        i, j = np.nonzero(np.linalg.norm(np.maximum(apart, 0.0), axis=2) <= least)
        if len(i):
            least = min(least, float(_distances(some[i], second[j]).min()))
    return least


def _is_within(triangles: FloatArray, others: FloatArray) -> bool:
    """Return whether all triangles are within the convex hull of others."""
    if not (len(triangles) and len(others)):
        return False
    points, around = triangles.reshape(-1, 3), others.reshape(-1, 3)
    # Hardly ever even within the box around them.
    low, high = around.min(axis=0), around.max(axis=0)
    if not ((points >= low) & (points <= high)).all():
        return False
    try:
        faces = ConvexHull(around).equations
    except QhullError:
        return False
    return bool((points @ faces[:, :3].T + faces[:, 3] <= 0.0).all())


def _near(triangles: FloatArray, others: FloatArray, distance: float) -> FloatArray:
    """Return the triangles whose boxes are within a distance of the box around others [m]."""
    if not (len(triangles) and len(others)):
        return triangles[:0]
    low, high = others.min(axis=(0, 1)) - distance, others.max(axis=(0, 1)) + distance
    inside = (triangles.max(axis=1) >= low) & (triangles.min(axis=1) <= high)
    return np.asarray(triangles[inside.all(axis=1)])


def _distances(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the distance of each triangle of a from that of b in the same row [m], shape (n,)."""
    found = [
        _of_segments(a[:, i], a[:, (i + 1) % 3], b[:, j], b[:, (j + 1) % 3])
        for i, j in itertools.product(range(3), repeat=2)
    ]
    for x, y in ((a, b), (b, a)):
        found += [_of_point(x[:, i], y) for i in range(3)]
        found += [np.where(_pierces(x[:, i], x[:, (i + 1) % 3], y), 0.0, np.inf) for i in range(3)]
    return np.asarray(np.min(found, axis=0))


def _of_segments(p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray) -> FloatArray:
    """Return the distances of segments pq and rs, shape (n,) (Ericson 2005, section 5.1.9)."""
    u, v, w = q - p, s - r, p - r
    a, e, f = _dot(u, u), _dot(v, v), _dot(v, w)
    b, c = _dot(u, v), _dot(u, w)
    with np.errstate(divide="ignore", invalid="ignore"):
        across = a * e - b * b
        at = np.where(across > 1e-14 * a * e, np.clip((b * f - c * e) / across, 0.0, 1.0), 0.0)
        on = np.where(e > 0.0, (b * at + f) / e, 0.0)
        within = np.clip(on, 0.0, 1.0)
        at = np.where(on == within, at, np.clip((b * within - c) / a, 0.0, 1.0))
    at = np.where(a > 0.0, at, 0.0)
    return np.asarray(np.linalg.norm(w + at[:, None] * u - within[:, None] * v, axis=1))


def _of_point(p: FloatArray, triangle: FloatArray) -> FloatArray:
    """Return the distances of points from the faces below or above them, inf if there is none."""
    normal, beyond = _beyond_edges(p, triangle)
    length = np.linalg.norm(normal, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        height = np.abs(_dot(p - triangle[:, 0], normal)) / length
    return np.where((length > 0.0) & ~beyond, height, np.inf)


def _pierces(p: FloatArray, q: FloatArray, triangle: FloatArray) -> NDArray[np.bool_]:
    """Return whether segments pq cross triangles, shape (n,)."""
    normal = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    start, end = _dot(p - triangle[:, 0], normal), _dot(q - triangle[:, 0], normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.where(start != end, start / (start - end), 0.0)
    beyond = _beyond_edges(p + at[:, None] * (q - p), triangle)[1]
    return np.asarray((start * end <= 0.0) & (_dot(normal, normal) > 0.0) & ~beyond)


def _beyond_edges(p: FloatArray, triangle: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the normals of triangles, and whether points are beside the faces."""
    normal = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    beyond = np.zeros(len(p), np.bool_)
    for i in range(3):
        edge = triangle[:, (i + 1) % 3] - triangle[:, i]
        beyond |= _dot(np.cross(edge, p - triangle[:, i]), normal) < 0.0
    return normal, beyond


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ij,ij->i", a, b))

"""Orientations of boxes around points: the smallest rectangles, and what a box contains."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, jit


@jit
def tightest_rectangles(points: FloatArray, frames: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return angle [rad] and area [m^2] of the smallest rectangle around points in given planes.

    One side of such a rectangle lies on an edge of the convex hull.

    Args:
        points: [m], shape (m, 3).
        frames: Frames whose x and y span the planes, shape (n, 3, 3).

    Returns:
        Angle of a side to x, and area, shapes (n,).
    """
    angles, areas = np.zeros(len(frames)), np.full(len(frames), np.inf)
    seen = np.empty((len(points), 2))
    for n in range(len(frames)):
        for i in range(len(points)):
            for k in range(2):
                seen[i, k] = (
                    points[i, 0] * frames[n, 0, k]
                    + points[i, 1] * frames[n, 1, k]
                    + points[i, 2] * frames[n, 2, k]
                )
        corners = _hull(seen)
        for i in range(len(corners)):
            after = (i + 1) % len(corners)
            x, y = corners[after, 0] - corners[i, 0], corners[after, 1] - corners[i, 1]
            length = np.sqrt(x * x + y * y)
            if length > 0.0:
                area = _area(corners, x / length, y / length)
                if area < areas[n]:
                    angles[n], areas[n] = np.arctan2(y, x), area
    return angles, areas


@inner
def _area(corners: FloatArray, c: float, s: float) -> float:
    """Return the area of the rectangle around points with a side along a direction [m^2]."""
    low_u = low_v = np.inf
    high_u = high_v = -np.inf
    for i in range(len(corners)):
        u, v = c * corners[i, 0] + s * corners[i, 1], c * corners[i, 1] - s * corners[i, 0]
        low_u, high_u, low_v, high_v = min(low_u, u), max(high_u, u), min(low_v, v), max(high_v, v)
    return (high_u - low_u) * (high_v - low_v)


@inner
def _hull(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of points in a plane, in order, shape (n, 2).

    Source:
        Andrew, "Another efficient algorithm for convex hulls in two dimensions", 1979.
    """
    order = np.argsort(points[:, 1], kind="mergesort")
    order = order[np.argsort(points[order, 0], kind="mergesort")]
    chain = np.empty((2 * len(points) + 1, 2))
    count = _chained(points, order, chain, 0)
    # The last corner of one half is the first of the other.
    count = _chained(points, order[::-1].copy(), chain, count - 1)
    return chain[: max(count - 1, 1)]


@inner
def _chained(points: FloatArray, order: IntArray, chain: FloatArray, start: int) -> int:
    """Append half of a hull to a chain from a number on; return the number after the last."""
    count = start
    for i in order:
        while count >= start + 2 and _turn(chain[count - 2], chain[count - 1], points[i]) <= 0.0:
            count -= 1
        chain[count] = points[i]
        count += 1
    return count


@inner
def _turn(first: FloatArray, second: FloatArray, third: FloatArray) -> float:
    """Return twice the area of a triangle, negative if its corners are in clockwise order."""
    return (second[0] - first[0]) * (third[1] - first[1]) - (second[1] - first[1]) * (
        third[0] - first[0]
    )


@jit
def box_cost(
    points: FloatArray, outside: FloatArray, costs: FloatArray, R: FloatArray, per_volume: float
) -> float:
    """Return the cost of the box around points: of points outside that it contains, and its volume.

    Args:
        points: Points that the box contains [m], shape (n, 3).
        outside: Points that it should not contain [m], shape (m, 3).
        costs: Cost of each of them, shape (m,).
        R: Axes of the box as columns, shape (3, 3).
        per_volume: Cost of the volume of the box [1/m^3].
    """
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(len(points)):
        for k in range(3):
            at = points[i, 0] * R[0, k] + points[i, 1] * R[1, k] + points[i, 2] * R[2, k]
            low[k], high[k] = min(low[k], at), max(high[k], at)
    cost = 0.0
    for i in range(len(outside)):
        is_in = True
        for k in range(3):
            at = outside[i, 0] * R[0, k] + outside[i, 1] * R[1, k] + outside[i, 2] * R[2, k]
            is_in = is_in and low[k] <= at <= high[k]
        if is_in:
            cost += costs[i]
    return cost + per_volume * np.prod(high - low)

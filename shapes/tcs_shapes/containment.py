"""What shapes contain of points, of pieces of a surface and of cells.

A shape is all that is within a radius of a box: a box has radius 0, a capsule a box that is a line,
a sphere one that is a point.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner, jit

Singles = NDArray[np.float32]


class RoundedBox(NamedTuple):
    """All points within a radius of a box."""

    half: FloatArray
    """Half sizes of the box along its axes [m], shape (3,)."""
    radius: float
    """[m]."""
    R: FloatArray
    """Axes of the box as columns, shape (3, 3)."""
    p: FloatArray
    """Its centre [m], shape (3,)."""


@jit
def contains_points(shape: RoundedBox, points: FloatArray) -> BoolArray:
    """Return which points lie in a shape, shape (n,), for points of shape (n, 3) [m]."""
    found = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        found[i] = _contains(shape, points[i, 0], points[i, 1], points[i, 2])
    return found


@jit
def contains_pieces(shape: RoundedBox, pieces: FloatArray) -> BoolArray:
    """Return which triangles lie wholly in a shape, shape (n,), for corners of shape (n, 3, 3)."""
    found = np.empty(len(pieces), np.bool_)
    for i in range(len(pieces)):
        is_in = True
        for k in range(3):
            is_in = is_in and _contains(shape, pieces[i, k, 0], pieces[i, k, 1], pieces[i, k, 2])
        found[i] = is_in
    return found


@jit
def farthest_of_pieces(shape: RoundedBox, pieces: FloatArray) -> FloatArray:
    """Return how far triangles protrude from a shape [m], shape (n,), for shape (n, 3, 3)."""
    found = np.empty(len(pieces))
    for i in range(len(pieces)):
        square = 0.0
        for k in range(3):
            out = _square_outside(shape, pieces[i, k, 0], pieces[i, k, 1], pieces[i, k, 2])
            square = max(square, out)
        found[i] = max(np.sqrt(square) - shape.radius, 0.0)
    return found


@jit
def set_cells_within(
    shape: RoundedBox, cells: BoolArray, first: IntArray, origin: FloatArray, pitch: float
) -> IntArray:
    """Return the set cells of a grid in a shape, by their flat number in it, shape (n,).

    Args:
        shape: The shape.
        cells: Which cells of the grid are set, shape (nx, ny, nz).
        first: First and last cells of the part of the grid that is looked at, shape (2, 3).
        origin: Position of the first cell of the grid [m], shape (3,).
        pitch: Distance of neighbouring cells [m].
    """
    _, ny, nz = cells.shape
    found = np.empty(np.prod(first[1] - first[0] + 1), np.int64)
    count = 0
    for i in range(first[0, 0], first[1, 0] + 1):
        for j in range(first[0, 1], first[1, 1] + 1):
            for k in range(first[0, 2], first[1, 2] + 1):
                if cells[i, j, k] and _contains(
                    shape, i * pitch + origin[0], j * pitch + origin[1], k * pitch + origin[2]
                ):
                    found[count] = (i * ny + j) * nz + k
                    count += 1
    return found[:count].copy()


@jit
def in_boxes(ends: Singles, low: Singles, high: Singles) -> BoolArray:
    """Return what boxes along given axes contain wholly, shape (n, items).

    Args:
        ends: Least and greatest coordinates of the boxes along the axes [m], shape (n, 2, 3).
        low: Least coordinates of the items [m], shape (items, 3).
        high: Greatest coordinates [m], shape (items, 3).
    """
    found = np.empty((len(ends), len(low)), np.bool_)
    for n in range(len(ends)):
        for i in range(len(low)):
            is_in = True
            for k in range(3):
                is_in = is_in and low[i, k] >= ends[n, 0, k] and high[i, k] <= ends[n, 1, k]
            found[n, i] = is_in
    return found


@jit
def in_capsules(
    ends: FloatArray, radii: FloatArray, pieces: FloatArray, points: FloatArray
) -> BoolArray:
    """Return what capsules contain wholly, shape (n, pieces + points).

    Args:
        ends: Ends of their axes [m], shape (n, 2, 3).
        radii: Their radii [m], shape (n,).
        pieces: Corners of triangles [m], shape (k, 3, 3).
        points: Points [m], shape (m, 3).
    """
    found = np.empty((len(radii), len(pieces) + len(points)), np.bool_)
    for n in range(len(radii)):
        for i in range(len(pieces)):
            is_in = True
            for k in range(3):
                is_in = is_in and _is_near(ends[n], radii[n], pieces[i, k])
            found[n, i] = is_in
        for i in range(len(points)):
            found[n, len(pieces) + i] = _is_near(ends[n], radii[n], points[i])
    return found


@jit
def chosen_covers(
    covered: BoolArray, order: IntArray, weights: IntArray, needed: int, most: int, left_out: int
) -> IntArray:
    """Return the candidates that cover most, each what those before it leave, shape (n,).

    Args:
        covered: What each candidate covers, shape (candidates, items).
        order: Those to choose from; of several that cover as much, the first is taken.
        weights: Weights of the items, shape (items,).
        needed: Number of the first items that are to be covered.
        most: Greatest number of candidates.
        left_out: Number of those items that may be left uncovered.
    """
    left = np.ones(len(weights), np.bool_)
    # What each covered alone when it was looked at last: no less than what it covers alone now.
    gains = np.empty(len(order), np.int64)
    for n in range(len(order)):
        gains[n] = _gain(covered[order[n]], weights, left)
    chosen = np.empty(most, np.int64)
    count, bare = 0, needed
    while count < most and bare > left_out:
        first = np.argmax(gains)
        best = order[first]
        gain = _gain(covered[best], weights, left)
        if gain < gains[first]:
            gains[first] = gain
            continue
        if gain == 0:
            break
        chosen[count] = best
        count += 1
        for i in range(len(weights)):
            if covered[best, i] and left[i]:
                left[i] = False
                bare -= i < needed
    return chosen[:count]


@inner
def _gain(covered: BoolArray, weights: IntArray, left: BoolArray) -> int:
    """Return the weight of what a candidate covers of what is left."""
    gain = 0
    for i in range(len(weights)):
        gain += weights[i] * (covered[i] & left[i])
    return gain


@jit
def circle_around(points: FloatArray, steps: int) -> tuple[FloatArray, float]:
    """Return centre and radius of a circle around points, shape (m, 2), nearly the smallest.

    Source:
        Badoiu and Clarkson, "Smaller core-sets for balls", 2003: step toward the farthest point
        by a decreasing fraction of the distance; the relative error of the radius is below
        1/steps.
    """
    centre = np.array([points[:, 0].mean(), points[:, 1].mean()])
    for i in range(1, steps):
        centre += (points[_farthest(points, centre)[0]] - centre) / (i + 1)
    return centre, np.sqrt(_farthest(points, centre)[1])


@inner
def _farthest(points: FloatArray, centre: FloatArray) -> tuple[int, float]:
    """Return the point farthest from another one, and its squared distance."""
    farthest, square = 0, -1.0
    for i in range(len(points)):
        x, y = points[i, 0] - centre[0], points[i, 1] - centre[1]
        if x * x + y * y > square:
            farthest, square = i, x * x + y * y
    return farthest, square


@inner
def _contains(shape: RoundedBox, x: float, y: float, z: float) -> bool:
    """Return whether a point lies in a shape."""
    return _square_outside(shape, x, y, z) <= shape.radius * shape.radius


@inner
def _square_outside(shape: RoundedBox, x: float, y: float, z: float) -> float:
    """Return the squared distance of a point from the box of a shape [m^2]."""
    x, y, z = x - shape.p[0], y - shape.p[1], z - shape.p[2]
    square = 0.0
    for k in range(3):
        at = abs(x * shape.R[0, k] + y * shape.R[1, k] + z * shape.R[2, k])
        out = max(at - shape.half[k], 0.0)
        square += out * out
    return square


@inner
def _is_near(ends: FloatArray, radius: float, point: FloatArray) -> bool:
    """Return whether a point is within a radius of a line."""
    a, b, c = ends[1, 0] - ends[0, 0], ends[1, 1] - ends[0, 1], ends[1, 2] - ends[0, 2]
    x, y, z = point[0] - ends[0, 0], point[1] - ends[0, 1], point[2] - ends[0, 2]
    square = a * a + b * b + c * c
    t = min(max((a * x + b * y + c * z) / square, 0.0), 1.0) if square > 0.0 else 0.0
    return (x - t * a) ** 2 + (y - t * b) ** 2 + (z - t * c) ** 2 <= radius**2


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

"""Lower bounds of the distance of two bodies of the robot, over the two joints between them.

Shapes are fatter than the surfaces that they enclose. A pair of bodies with a table is in contact
where its shapes touch and the bound is below the distance to keep.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BodyDistances, FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant

UNIT = 4e-5
"""Distance that one step of a corner stands for [m]."""
FARTHEST = 255 * UNIT
"""The farthest that a corner can hold [m]."""
NOTHING = -1.0
"""Bound where none is known [m]."""
FIRST, SECOND = int_constant(0), int_constant(1)
"""Joints of a table."""
FULL_TURN = 2.0 * np.pi
MOST_CORNERS = 64
"""Most corners that are read to see whether a pair is in contact all over a range of its joints."""


class DistanceTables(NamedTuple):
    """The tables of a scene, as the kernel reads them."""

    of_bodies: IntArray
    """Number of the table of two bodies of the robot, -1 without one, shape (bodies, bodies)."""
    joint: IntArray
    """Indices of the two joints, shape (tables, 2)."""
    size: IntArray
    """Number of cells of a full turn of either joint, shape (tables, 2)."""
    reach: FloatArray
    """How much the distance decreases at most with either joint [m/rad], shape (tables, 2)."""
    first: IntArray
    """First corner of each table, shape (tables,)."""
    corners: NDArray[np.uint8]
    """Distances at the corners of the cells in `UNIT`, row by row, table by table."""


def arranged(distances: BodyDistances, bodies: int) -> DistanceTables:
    """Return tables arranged for the kernel.

    Args:
        distances: The tables.
        bodies: Number of bodies of the robot.
    """
    of_bodies = np.full((bodies, bodies), -1, np.int64)
    for n, (first, second) in enumerate(distances.body):
        of_bodies[first, second] = of_bodies[second, first] = n
    sizes = distances.size.prod(axis=1)
    return DistanceTables(
        of_bodies=of_bodies,
        joint=np.array(distances.joint, np.int64),
        size=np.array(distances.size, np.int64),
        reach=np.array(distances.reach, np.float64),
        first=np.concatenate([[0], np.cumsum(sizes)])[:-1].astype(np.int64),
        corners=np.array(distances.corners, np.uint8),
    )


@inner
def distance_bound(distances: DistanceTables, n: int, q: FloatArray) -> float:
    """Return a lower bound of the distance of table n at joint angles q [m].

    It is `NOTHING` where none is known. In a cell, the square of the distance is interpolated
    between the corners, less what its curvature can take away: `DistanceTable.bound` says why.
    """
    height, width = distances.size[n, 0], distances.size[n, 1]
    row, u, lost_by_first = _place(distances, n, FIRST, q)
    column, v, lost_by_second = _place(distances, n, SECOND, q)
    here = distances.first[n] + row * width
    there = distances.first[n] + (row + 1) % height * width
    after = (column + 1) % width
    square = (1.0 - u) * (
        (1.0 - v) * _squared(distances, here + column) + v * _squared(distances, here + after)
    ) + u * (
        (1.0 - v) * _squared(distances, there + column) + v * _squared(distances, there + after)
    )
    square -= lost_by_first + lost_by_second
    return np.sqrt(square) if square > 0.0 else NOTHING


@inner
def _place(distances: DistanceTables, n: int, m: int, q: FloatArray) -> tuple[int, float, float]:
    """Return the cell of joint m of table n, the fraction of the way across it, and what is lost.

    What is lost is by how much the square of the distance can be below what is interpolated [m^2].
    """
    count, reach = distances.size[n, m], distances.reach[n, m]
    turns = q[distances.joint[n, m]] * (1.0 / FULL_TURN)
    place = (turns - np.floor(turns)) * count
    # Of a turn rounded up to 1, the last cell.
    cell = min(int(place), count - 1)
    way, step = place - cell, FULL_TURN / count
    return cell, way, reach * (reach + FARTHEST) * step * step * way * (1.0 - way)


@inner
def _squared(distances: DistanceTables, at: int) -> float:
    """Return the square of the distance that a corner holds [m^2]."""
    distance = distances.corners[at] * UNIT
    return distance * distance


@inner
def are_apart(
    distances: DistanceTables, first: int, second: int, q: FloatArray, gap: float
) -> bool:
    """Return whether a table shows that two bodies keep a distance [m] at joint angles q."""
    n = distances.of_bodies[first, second]
    return n >= 0 and distance_bound(distances, n, q) >= gap


@inner
def may_come_apart(
    distances: DistanceTables,
    n: int,
    start: FloatArray,
    end: FloatArray,
    excess: float,
    gap: float,
) -> bool:
    """Return whether a table may show a distance [m] somewhere between two postures.

    Args:
        distances: The tables.
        n: The table.
        start: One posture [rad], shape (7,).
        end: The other.
        excess: Factor on the ranges of the joints between them.
        gap: The distance.

    Returns:
        True also where the postures are too far from each other to tell.
    """
    first_row, rows, first_column, columns = 0, 1, 0, 1
    for m in range(2):
        joint, count = distances.joint[n, m], distances.size[n, m]
        middle = 0.5 * (start[joint] + end[joint])
        half = 0.5 * excess * abs(end[joint] - start[joint])
        low = int(np.floor((middle - half) * (count / FULL_TURN)))
        corners = int(np.floor((middle + half) * (count / FULL_TURN))) - low + 2
        if corners > MOST_CORNERS:
            return True
        if m == 0:
            first_row, rows = low, corners
        else:
            first_column, columns = low, corners
    if rows * columns > MOST_CORNERS:
        return True
    height, width = distances.size[n, 0], distances.size[n, 1]
    for i in range(first_row, first_row + rows):
        for j in range(first_column, first_column + columns):
            at = distances.first[n] + (i % height) * width + j % width
            if distances.corners[at] * UNIT >= gap:
                return True
    return False

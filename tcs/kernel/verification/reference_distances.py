"""Reference of the tables of distances in plain loops, sharing no code with the kernel."""

from __future__ import annotations

import math

from tcs.kernel.arrays import BodyDistances, FloatArray

STEP = 2e-4
"""Distance that one step of a cell stands for [m]."""


def bounds_at(distances: BodyDistances, q: FloatArray) -> dict[frozenset[int], float]:
    """Return lower bounds of the distance of bodies of the robot at joint angles q [m].

    Args:
        distances: The tables.
        q: Joint angles [rad], shape (7,).

    Returns:
        By pair of indices of bodies, for the pairs that have a table.
    """
    found: dict[frozenset[int], float] = {}
    begin = 0
    for pair, joints, counts, reach in zip(
        distances.body, distances.joint, distances.size, distances.reach, strict=True
    ):
        rows, columns = (int(count) for count in counts)
        cells = distances.cells[begin : begin + rows * columns].reshape(rows, columns)
        begin += rows * columns
        place, lost = [], 0.0
        for joint, count, per_radian in zip(joints, (rows, columns), reach, strict=True):
            width = 2.0 * math.pi / count
            angle = float(q[joint])
            angle -= 2.0 * math.pi * math.floor(angle / (2.0 * math.pi))
            cell = min(math.floor(angle / width), count - 1)
            lost += float(per_radian) * abs(angle - (cell + 0.5) * width)
            place.append(cell)
        bound = int(cells[place[0], place[1]]) * STEP - lost
        found[frozenset(int(body) for body in pair)] = bound
    return found

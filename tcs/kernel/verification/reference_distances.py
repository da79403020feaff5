"""Reference of the tables of distances in plain loops, sharing no code with the kernel."""

from __future__ import annotations

import math

from tcs.kernel.arrays import BodyDistances, FloatArray

STEP = 4e-5
"""Distance that one step of a corner stands for [m]."""
MOST = 255 * STEP
"""Greatest distance of a corner [m]."""


def bounds_at(distances: BodyDistances, q: FloatArray) -> dict[frozenset[int], float]:
    """Return lower bounds of the distance of bodies of the robot at joint angles q [m].

    Args:
        distances: The tables.
        q: Joint angles [rad], shape (7,).

    Returns:
        By pair of indices of bodies, for the pairs that have a table; -1 where nothing is known.
    """
    found: dict[frozenset[int], float] = {}
    begin = 0
    for pair, joints, counts, reach in zip(
        distances.body, distances.joint, distances.size, distances.reach, strict=True
    ):
        rows, columns = (int(count) for count in counts)
        corners = distances.corners[begin : begin + rows * columns].reshape(rows, columns)
        begin += rows * columns
        cell, way, lost = [0, 0], [0.0, 0.0], 0.0
        for m, (joint, count, per_radian) in enumerate(
            zip(joints, (rows, columns), reach, strict=True)
        ):
            width = 2.0 * math.pi / count
            angle = float(q[joint])
            angle -= 2.0 * math.pi * math.floor(angle / (2.0 * math.pi))
            cell[m] = min(math.floor(angle / width), count - 1)
            before = angle - cell[m] * width
            after = width - before
            # Half the greatest curvature of a squared distance times the way to either end.
            lost += float(per_radian) * (float(per_radian) + MOST) * before * after
            way[m] = before / width
        total = 0.0
        for i in range(2):
            for j in range(2):
                corner = corners[(cell[0] + i) % rows, (cell[1] + j) % columns]
                share = (way[0] if i else 1.0 - way[0]) * (way[1] if j else 1.0 - way[1])
                total += share * (int(corner) * STEP) ** 2
        bound = math.sqrt(total - lost) if total > lost else -1.0
        found[frozenset(int(body) for body in pair)] = bound
    return found

"""Planes that stay between two shapes on a piece of a curve.

To first order, the points of a shape move on a short piece by what the twist of its link at the
middle posture gives; their second derivative bounds the rest. So a plane that keeps two shapes
apart at the middle posture keeps them apart on the piece if that motion along its normal, and the
rest, are less than its distance from them. Motion along the plane does not count, unlike in the
bounds of `pairs`: a tool that slides along a shelf is certified in longer pieces.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace


@inner
def take_twists(work: MotionWorkspace) -> None:
    """Fill the motion of each link on the piece, to first order, from `work.rate`.

    A point at r of link f moves by `w x r + v` until the end of the piece, and by as much backwards
    until its begin; w and v are the first and the last three of row f of `work.twist`.
    """
    twist = work.twist
    for m in range(6):
        twist[0, m] = 0.0
    for k in range(7):
        R, p, rate = work.link_R[k + 1], work.link_p[k + 1], work.rate[k]
        x, y, z = rate * R[0, 2], rate * R[1, 2], rate * R[2, 2]
        twist[k + 1, 0], twist[k + 1, 1], twist[k + 1, 2] = (
            twist[k, 0] + x,
            twist[k, 1] + y,
            twist[k, 2] + z,
        )
        twist[k + 1, 3] = twist[k, 3] - (y * p[2] - z * p[1])
        twist[k + 1, 4] = twist[k, 4] - (z * p[0] - x * p[2])
        twist[k + 1, 5] = twist[k, 5] - (x * p[1] - y * p[0])


@inner
def plane_between(
    scene: MotionScene, work: MotionWorkspace, i: int, j: int, base: int, gap: float
) -> bool:
    """Return whether a plane keeps two shapes farther apart than a gap [m] on the whole piece.

    Args:
        scene: The scene.
        work: Scratch, with the middle posture, the twists and both shapes placed.
        i: Shape of the arm.
        j: Other shape.
        base: Link that carries the other shape, 0 if it is fixed.
        gap: Distance that the pair must keep, above rounding errors [m].
    """
    shapes, twist, f = work.shapes, work.twist, scene.link_frame[i]
    wx, wy, wz = (
        twist[f, 0] - twist[base, 0],
        twist[f, 1] - twist[base, 1],
        twist[f, 2] - twist[base, 2],
    )
    cx, cy, cz = shapes[i, CENTRE], shapes[i, CENTRE + 1], shapes[i, CENTRE + 2]
    vx = wy * cz - wz * cy + twist[f, 3] - twist[base, 3]
    vy = wz * cx - wx * cz + twist[f, 4] - twist[base, 4]
    vz = wx * cy - wy * cx + twist[f, 5] - twist[base, 5]
    x, y, z = cx - shapes[j, CENTRE], cy - shapes[j, CENTRE + 1], cz - shapes[j, CENTRE + 2]
    least = gap + work.rest[i, base]
    # From the point of shape j that is nearest to the centre of shape i to that centre.
    dx, dy, dz = x, y, z
    if shapes[j, TYPE] == BOX:
        for m in range(3):
            nx, ny, nz = (
                shapes[j, ROTATION + m],
                shapes[j, ROTATION + 3 + m],
                shapes[j, ROTATION + 6 + m],
            )
            along, half = nx * x + ny * y + nz * z, shapes[j, SIZE + m]
            moved = abs(nx * vx + ny * vy + nz * vz)
            apart = abs(along) - half - moved - least
            if apart > 0.0 and apart > _extent(shapes, i, nx, ny, nz, wx, wy, wz):
                return True
            inside = min(max(along, -half), half)
            dx, dy, dz = dx - inside * nx, dy - inside * ny, dz - inside * nz
    elif shapes[j, TYPE] == CAPSULE:
        ux, uy, uz = shapes[j, ROTATION + 2], shapes[j, ROTATION + 5], shapes[j, ROTATION + 8]
        half = shapes[j, SIZE + 1]
        inside = min(max(ux * x + uy * y + uz * z, -half), half)
        dx, dy, dz = x - inside * ux, y - inside * uy, z - inside * uz
    distance = np.sqrt(dx * dx + dy * dy + dz * dz)
    if distance <= least:
        return False
    nx, ny, nz = dx / distance, dy / distance, dz / distance
    moved = abs(nx * vx + ny * vy + nz * vz)
    apart = nx * x + ny * y + nz * z - _extent(shapes, j, nx, ny, nz, 0.0, 0.0, 0.0) - moved - least
    return apart > 0.0 and apart > _extent(shapes, i, nx, ny, nz, wx, wy, wz)


@inner
def _extent(
    shapes: FloatArray,
    i: int,
    nx: float,
    ny: float,
    nz: float,
    wx: float,
    wy: float,
    wz: float,
) -> float:
    """Return how far a shape extends from its centre along n, turned by up to w, to first order.

    A rotation w moves a point at r from the centre by `n . (w x r) = (n x w) . r` along n. It does
    not change a ball.
    """
    tx, ty, tz = ny * wz - nz * wy, nz * wx - nx * wz, nx * wy - ny * wx
    if shapes[i, TYPE] == BOX:
        extent = 0.0
        for m in range(3):
            ux, uy, uz = (
                shapes[i, ROTATION + m],
                shapes[i, ROTATION + 3 + m],
                shapes[i, ROTATION + 6 + m],
            )
            along = abs(ux * nx + uy * ny + uz * nz) + abs(ux * tx + uy * ty + uz * tz)
            extent += shapes[i, SIZE + m] * along
        return extent
    if shapes[i, TYPE] == CAPSULE:
        ux, uy, uz = shapes[i, ROTATION + 2], shapes[i, ROTATION + 5], shapes[i, ROTATION + 8]
        along = abs(ux * nx + uy * ny + uz * nz) + abs(ux * tx + uy * ty + uz * tz)
        return shapes[i, SIZE] + shapes[i, SIZE + 1] * along
    return shapes[i, BOUND]

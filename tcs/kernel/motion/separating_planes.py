"""Planes that stay between two shapes on a piece of a curve.

To first order, the points of a shape move on a short piece by what the twist of its link at the
middle posture gives; their second derivative bounds the rest. So a plane that keeps two shapes
apart at the middle posture keeps them apart on the piece if it does so at both ends to first order,
with the rest to spare: to first order the points move evenly, and how far a convex shape extends
beyond a plane is a convex function of the time. Motion along the plane does not count, unlike in
the bounds of `contact_bounds`, nor does motion away from it before or after the middle: a tool
that slides along a shelf, or leaves it, is certified in longer pieces.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import (
    BOUND,
    CENTRE,
    PARALLEL,
    ROTATION,
    SIZE,
    TYPE,
    between_box_and_segment,
    between_segments,
)
from tcs.kernel.motion.scene import FRAMES, MotionScene, MotionWorkspace
from tcs.kernel.motion.tool_line import follows_line, take_turns

TWISTED = 2
"""In `PieceMotion.known`: joints move on the current piece, and the twists are filled."""


class RelativeMotion(NamedTuple):
    """Motion of one shape relative to another on half of a piece, to first order."""

    x: float
    y: float
    z: float
    """Its centre, from that of the other shape, in A at the middle posture [m]."""
    vx: float
    vy: float
    vz: float
    """Motion of its centre [m]."""
    wx: float
    wy: float
    wz: float
    """Its rotation [rad]: a point at r from its centre moves by `w x r + v`."""
    least: float
    """Distance that a plane must have from the shapes: their gap and the rest of the motion [m]."""


@inner
def take_twists(scene: MotionScene, work: MotionWorkspace, half: float) -> None:
    """Fill the motion of each link on the piece, to first order, from `piece.rate`.

    A point at r of link f moves by `w x r + v` until the end of the piece, and by as much backwards
    until its begin; w and v are the first and the last three of row f of `piece.twist`.

    Args:
        scene: The scene.
        work: `piece.twist` is filled, and `piece.tool_twist` where the tool follows a line.
        half: Half of the length of the piece, as a fraction of the curve.
    """
    piece, chain = work.piece, scene.chain
    twist = piece.twist
    if piece.known[0] > 0:
        piece.known[0] = TWISTED
    for m in range(6):
        twist[0, m] = 0.0
    for k in range(7):
        R, p, rate = work.posture.link_R[k + 1], work.posture.link_p[k + 1], piece.rate[k]
        if chain.slides[k] > 0.0:
            for r in range(3):
                twist[k + 1, r] = twist[k, r]
                twist[k + 1, 3 + r] = twist[k, 3 + r] + chain.slides[k] * rate * R[r, 2]
            continue
        x, y, z = rate * R[0, 2], rate * R[1, 2], rate * R[2, 2]
        twist[k + 1, 0], twist[k + 1, 1], twist[k + 1, 2] = (
            twist[k, 0] + x,
            twist[k, 1] + y,
            twist[k, 2] + z,
        )
        twist[k + 1, 3] = twist[k, 3] - (y * p[2] - z * p[1])
        twist[k + 1, 4] = twist[k, 4] - (z * p[0] - x * p[2])
        twist[k + 1, 5] = twist[k, 5] - (x * p[1] - y * p[0])
    for n in range(len(chain.coupled)):
        k, part = int(chain.coupled[n, 0]), chain.coupled[n, 1]
        for m in range(6):
            twist[FRAMES + n, m] = twist[k, m] + part * (twist[k + 1, m] - twist[k, m])
    if follows_line(work):
        take_turns(scene, work, half)


@inner
def plane_between(
    scene: MotionScene,
    work: MotionWorkspace,
    i: int,
    j: int,
    base: int,
    gap: float,
    far: float,
    edges: bool,
) -> bool:
    """Return whether a plane keeps two shapes farther apart than a gap [m] on the whole piece.

    Args:
        scene: The scene.
        work: Scratch, with the middle posture, the twists and both shapes placed.
        i: Shape of the arm.
        j: Other shape.
        base: Link that carries the other shape, 0 if it is fixed.
        gap: Distance that the pair must keep, above rounding errors [m].
        far: Distance at the middle posture from which on the pair does not meet on the piece [m].
        edges: Whether to try planes along an edge of both shapes, which takes longest, if both are
            boxes.
    """
    shapes = work.posture.shapes
    motion = _relative_motion(scene, work, i, j, base, gap)
    if shapes[i, TYPE] != BOX or shapes[j, TYPE] != BOX:
        return _plane_across_shortest(shapes, i, j, motion, far)
    return _plane_along_face(shapes, i, j, motion, far) or (
        edges and _plane_along_edges(shapes, i, j, motion)
    )


@inner
def _relative_motion(
    scene: MotionScene, work: MotionWorkspace, i: int, j: int, base: int, gap: float
) -> RelativeMotion:
    """Return the motion of shape i relative to shape j, see `plane_between`."""
    piece = work.piece
    shapes, f = work.posture.shapes, scene.shapes.link_frame[i]
    twist = piece.tool_twist if base == 0 and piece.by_tool[i] else piece.twist
    wx, wy, wz = (
        twist[f, 0] - twist[base, 0],
        twist[f, 1] - twist[base, 1],
        twist[f, 2] - twist[base, 2],
    )
    x, y, z = shapes[i, CENTRE], shapes[i, CENTRE + 1], shapes[i, CENTRE + 2]
    return RelativeMotion(
        x - shapes[j, CENTRE],
        y - shapes[j, CENTRE + 1],
        z - shapes[j, CENTRE + 2],
        wy * z - wz * y + twist[f, 3] - twist[base, 3],
        wz * x - wx * z + twist[f, 4] - twist[base, 4],
        wx * y - wy * x + twist[f, 5] - twist[base, 5],
        wx,
        wy,
        wz,
        gap + piece.rest[i, base],
    )


@inner
def _plane_across_shortest(
    shapes: FloatArray, i: int, j: int, motion: RelativeMotion, far: float
) -> bool:
    """Return whether the plane across the shortest way between two shapes keeps them apart.

    They are not both boxes.
    """
    if _face_keeps_away(shapes, i, j, motion, far):
        return True
    half_i = shapes[i, SIZE + 1] if shapes[i, TYPE] == CAPSULE else 0.0
    half_j = shapes[j, SIZE + 1] if shapes[j, TYPE] == CAPSULE else 0.0
    # The shortest vector from the core of shape j to that of shape i, in A.
    if shapes[j, TYPE] == BOX:
        a, b, c = between_box_and_segment(shapes, i, half_i, shapes, j)
        x, y, z = _from_frame(shapes, j, a, b, c)
    elif shapes[i, TYPE] == BOX:
        a, b, c = between_box_and_segment(shapes, j, half_j, shapes, i)
        x, y, z = _from_frame(shapes, i, -a, -b, -c)
    else:
        x, y, z = between_segments(shapes, j, half_j, shapes, i, half_i)
    distance = np.sqrt(x * x + y * y + z * z)
    radius_i = 0.0 if shapes[i, TYPE] == BOX else shapes[i, SIZE]
    radius_j = 0.0 if shapes[j, TYPE] == BOX else shapes[j, SIZE]
    apart = distance - radius_i - radius_j
    if apart >= far:
        return True
    if apart <= motion.least:
        return False
    return _keeps_apart(shapes, i, j, x / distance, y / distance, z / distance, motion)


@inner
def _face_keeps_away(
    shapes: FloatArray, i: int, j: int, motion: RelativeMotion, far: float
) -> bool:
    """Return whether a face of the box among two shapes, if one is, keeps the other one far away.

    This tells most pairs apart, in a fraction of the time that the shortest way takes.
    """
    a, b = (j, i) if shapes[j, TYPE] == BOX else (i, j)
    if shapes[a, TYPE] != BOX:
        return False
    for m in range(3):
        nx, ny, nz = (
            shapes[a, ROTATION + m],
            shapes[a, ROTATION + 3 + m],
            shapes[a, ROTATION + 6 + m],
        )
        along = abs(nx * motion.x + ny * motion.y + nz * motion.z) - shapes[a, SIZE + m]
        if along >= far and along - _extent(shapes, b, nx, ny, nz) >= far:
            return True
    return False


@inner
def _from_frame(
    shapes: FloatArray, i: int, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Return a vector in A, given in the frame of a shape."""
    return (
        shapes[i, ROTATION] * x + shapes[i, ROTATION + 1] * y + shapes[i, ROTATION + 2] * z,
        shapes[i, ROTATION + 3] * x + shapes[i, ROTATION + 4] * y + shapes[i, ROTATION + 5] * z,
        shapes[i, ROTATION + 6] * x + shapes[i, ROTATION + 7] * y + shapes[i, ROTATION + 8] * z,
    )


@inner
def _plane_along_face(
    shapes: FloatArray, i: int, j: int, motion: RelativeMotion, far: float
) -> bool:
    """Return whether a plane along a face of one of two boxes keeps them apart."""
    for side in range(2):
        a, b = (j, i) if side == 0 else (i, j)
        for m in range(3):
            nx, ny, nz = (
                shapes[a, ROTATION + m],
                shapes[a, ROTATION + 3 + m],
                shapes[a, ROTATION + 6 + m],
            )
            along = nx * motion.x + ny * motion.y + nz * motion.z
            apart = abs(along) - shapes[a, SIZE + m]
            if apart <= motion.least:
                continue
            apart -= _extent(shapes, b, nx, ny, nz)
            if apart >= far:
                return True
            sign = 1.0 if along > 0.0 else -1.0
            if apart > motion.least and _keeps_apart(
                shapes, i, j, sign * nx, sign * ny, sign * nz, motion
            ):
                return True
    return False


@inner
def _plane_along_edges(shapes: FloatArray, i: int, j: int, motion: RelativeMotion) -> bool:
    """Return whether a plane along an edge of each of two boxes keeps them apart."""
    most, x, y, z = motion.least, 0.0, 0.0, 0.0
    for m in range(3):
        ax, ay, az = (
            shapes[i, ROTATION + m],
            shapes[i, ROTATION + 3 + m],
            shapes[i, ROTATION + 6 + m],
        )
        for n in range(3):
            bx, by, bz = (
                shapes[j, ROTATION + n],
                shapes[j, ROTATION + 3 + n],
                shapes[j, ROTATION + 6 + n],
            )
            nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            square = nx * nx + ny * ny + nz * nz
            along = nx * motion.x + ny * motion.y + nz * motion.z
            if square < PARALLEL or along * along <= square * most * most:
                continue
            scale = (1.0 if along > 0.0 else -1.0) / np.sqrt(square)
            nx, ny, nz = scale * nx, scale * ny, scale * nz
            apart = scale * along - _extent(shapes, i, nx, ny, nz) - _extent(shapes, j, nx, ny, nz)
            if apart > most:
                most, x, y, z = apart, nx, ny, nz
    return most > motion.least and _keeps_apart(shapes, i, j, x, y, z, motion)


@inner
def _keeps_apart(
    shapes: FloatArray, i: int, j: int, nx: float, ny: float, nz: float, motion: RelativeMotion
) -> bool:
    """Return whether a plane across n keeps shapes i and j apart; n points from j to i."""
    apart = nx * motion.x + ny * motion.y + nz * motion.z - motion.least
    apart -= _extent(shapes, j, nx, ny, nz)
    moved = nx * motion.vx + ny * motion.vy + nz * motion.vz
    begin, end = apart - moved, apart + moved
    # A rotation w moves a point at r from the centre by `n . (w x r) = (n x w) . r` along n.
    tx, ty, tz = (
        ny * motion.wz - nz * motion.wy,
        nz * motion.wx - nx * motion.wz,
        nx * motion.wy - ny * motion.wx,
    )
    if shapes[i, TYPE] == BOX:
        for m in range(3):
            ux, uy, uz = (
                shapes[i, ROTATION + m],
                shapes[i, ROTATION + 3 + m],
                shapes[i, ROTATION + 6 + m],
            )
            along, turned = ux * nx + uy * ny + uz * nz, ux * tx + uy * ty + uz * tz
            begin -= shapes[i, SIZE + m] * abs(along - turned)
            end -= shapes[i, SIZE + m] * abs(along + turned)
    elif shapes[i, TYPE] == CAPSULE:
        ux, uy, uz = shapes[i, ROTATION + 2], shapes[i, ROTATION + 5], shapes[i, ROTATION + 8]
        along, turned = ux * nx + uy * ny + uz * nz, ux * tx + uy * ty + uz * tz
        begin -= shapes[i, SIZE] + shapes[i, SIZE + 1] * abs(along - turned)
        end -= shapes[i, SIZE] + shapes[i, SIZE + 1] * abs(along + turned)
    else:
        begin, end = begin - shapes[i, BOUND], end - shapes[i, BOUND]
    return min(begin, end) > 0.0


@inner
def _extent(shapes: FloatArray, i: int, nx: float, ny: float, nz: float) -> float:
    """Return how far a shape extends from its centre along n [m]."""
    if shapes[i, TYPE] == BOX:
        extent = 0.0
        for m in range(3):
            extent += shapes[i, SIZE + m] * abs(
                shapes[i, ROTATION + m] * nx
                + shapes[i, ROTATION + 3 + m] * ny
                + shapes[i, ROTATION + 6 + m] * nz
            )
        return extent
    if shapes[i, TYPE] == CAPSULE:
        along = (
            shapes[i, ROTATION + 2] * nx
            + shapes[i, ROTATION + 5] * ny
            + shapes[i, ROTATION + 8] * nz
        )
        return shapes[i, SIZE] + shapes[i, SIZE + 1] * abs(along)
    return shapes[i, BOUND]

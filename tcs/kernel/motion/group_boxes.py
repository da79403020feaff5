"""Boxes around groups of shapes of a link, compared with those around groups of fixed shapes.

All boxes of a link have its axes, and all boxes around the fixed shapes of one carrier have the
same ones. So the rotation between them is found once for a tree of pairs, and no box is placed.
"""

from __future__ import annotations

from tcs.kernel.cache import inner
from tcs.kernel.collide import CENTRE, ROTATION, SIZE
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace


@inner
def take_frames(scene: MotionScene, work: MotionWorkspace, i: int, j: int) -> None:
    """Prepare for boxes on the link of box i and those on the carrier of box j, a fixed one.

    Args:
        scene: The scene.
        work: Scratch, with the current posture; `separation.between` is filled.
        i: A box around shapes of a link.
        j: A box around fixed shapes.
    """
    posture = work.posture
    frame, between, shapes = scene.shapes.link_frame[i], work.separation.between, posture.shapes
    R, p = posture.link_R[frame], posture.link_p[frame]
    for m in range(3):
        a, b, c = shapes[j, ROTATION + m], shapes[j, ROTATION + 3 + m], shapes[j, ROTATION + 6 + m]
        for n in range(3):
            between[m, n] = a * R[0, n] + b * R[1, n] + c * R[2, n]
        between[m, 3] = a * p[0] + b * p[1] + c * p[2]
        between[m, 4], between[m, 5], between[m, 6] = a, b, c


@inner
def boxes_apart(scene: MotionScene, work: MotionWorkspace, i: int, j: int, apart: float) -> bool:
    """Return whether a face of one of two boxes keeps the other one at a distance.

    Args:
        scene: The scene.
        work: Scratch, after `take_frames` for the link and the carrier of both.
        i: A box around shapes of the link.
        j: A box around fixed shapes of the carrier.
        apart: The distance [m].
    """
    links, shapes, between = scene.shapes.links, work.posture.shapes, work.separation.between
    u, v, w = links[i, CENTRE], links[i, CENTRE + 1], links[i, CENTRE + 2]
    a, b, c = shapes[j, CENTRE], shapes[j, CENTRE + 1], shapes[j, CENTRE + 2]
    hx, hy, hz = links[i, SIZE], links[i, SIZE + 1], links[i, SIZE + 2]
    ex, ey, ez = hx + apart, hy + apart, hz + apart
    x = y = z = 0.0
    for m in range(3):
        rx, ry, rz = between[m, 0], between[m, 1], between[m, 2]
        along = rx * u + ry * v + rz * w + between[m, 3]
        along -= between[m, 4] * a + between[m, 5] * b + between[m, 6] * c
        half = shapes[j, SIZE + m]
        if abs(along) >= half + apart + abs(rx) * hx + abs(ry) * hy + abs(rz) * hz:
            return True
        x, y, z = x + rx * along, y + ry * along, z + rz * along
        ex, ey, ez = ex + abs(rx) * half, ey + abs(ry) * half, ez + abs(rz) * half
    return abs(x) >= ex or abs(y) >= ey or abs(z) >= ez

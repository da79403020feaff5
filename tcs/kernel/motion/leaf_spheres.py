"""Bounding spheres of all shapes of a link, compared with a fixed shape in one vector loop."""

from __future__ import annotations

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import CENTRE, ROTATION, SIZE, TYPE
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace


@inner
def compare_spheres(
    scene: MotionScene, work: MotionWorkspace, k: int, apart: float, first: int, last: int
) -> int:
    """Return how many bounding spheres of a link's shapes are closer to a fixed shape than its gap.

    Args:
        scene: The scene.
        work: Scratch; `separation.excess` is filled, below 0 for each sphere that is closer, and
            `separation.other`.
        k: Pair of the box around the shapes and the fixed shape.
        apart: Distance that spheres keep from the core of the fixed shape: a box, a segment along z
            or a point [m].
        first: First column of the shapes in `scene.leaves`.
        last: One after their last column.
    """
    posture, leaves = work.posture, scene.leaves
    j, shapes, frame = (
        scene.pairs.members[k, 1],
        posture.shapes,
        scene.shapes.link_frame[scene.pairs.members[k, 0]],
    )
    R, p = posture.link_R[frame], posture.link_p[frame]
    hx = hy = hz = 0.0
    if shapes[j, TYPE] == BOX:
        hx, hy, hz = shapes[j, SIZE], shapes[j, SIZE + 1], shapes[j, SIZE + 2]
    elif shapes[j, TYPE] == CAPSULE:
        hz = shapes[j, SIZE + 1]
    # Axes of the fixed shape, and the link's origin from its centre, in its frame.
    a, b, c = shapes[j, ROTATION], shapes[j, ROTATION + 3], shapes[j, ROTATION + 6]
    xx, xy, xz = _in_link(R, a, b, c)
    px, py, pz = (
        p[0] - shapes[j, CENTRE],
        p[1] - shapes[j, CENTRE + 1],
        p[2] - shapes[j, CENTRE + 2],
    )
    dx = a * px + b * py + c * pz
    a, b, c = shapes[j, ROTATION + 1], shapes[j, ROTATION + 4], shapes[j, ROTATION + 7]
    yx, yy, yz = _in_link(R, a, b, c)
    dy = a * px + b * py + c * pz
    a, b, c = shapes[j, ROTATION + 2], shapes[j, ROTATION + 5], shapes[j, ROTATION + 8]
    zx, zy, zz = _in_link(R, a, b, c)
    dz = a * px + b * py + c * pz
    other = work.separation.other
    other[0, 0], other[0, 1], other[0, 2], other[3, 0], other[4, 0] = xx, xy, xz, dx, hx
    other[1, 0], other[1, 1], other[1, 2], other[3, 1], other[4, 1] = yx, yy, yz, dy, hy
    other[2, 0], other[2, 1], other[2, 2], other[3, 2], other[4, 2] = zx, zy, zz, dz, hz
    u, v, w = (
        leaves.spheres[0, first:last],
        leaves.spheres[1, first:last],
        leaves.spheres[2, first:last],
    )
    bound, excess = leaves.spheres[3, first:last], work.separation.excess
    near = 0
    # No branch and no early end: LLVM makes this loop a vector loop.
    for n in range(len(u)):
        x = max(abs(xx * u[n] + xy * v[n] + xz * w[n] + dx) - hx, 0.0)
        y = max(abs(yx * u[n] + yy * v[n] + yz * w[n] + dy) - hy, 0.0)
        z = max(abs(zx * u[n] + zy * v[n] + zz * w[n] + dz) - hz, 0.0)
        reach = bound[n] + apart
        excess[n] = x * x + y * y + z * z - reach * reach
        near += int(excess[n] < 0.0)
    return near


@inner
def _in_link(R: FloatArray, a: float, b: float, c: float) -> tuple[float, float, float]:
    """Return a vector in the frame of a link, given in A; R is the link's orientation in A."""
    return (
        R[0, 0] * a + R[1, 0] * b + R[2, 0] * c,
        R[0, 1] * a + R[1, 1] * b + R[2, 1] * c,
        R[0, 2] * a + R[1, 2] * b + R[2, 2] * c,
    )

"""Contacts at one posture: the shapes of a link are compared with a fixed shape in one vector loop.

At a posture alone most of the time would go into the boxes between the one around all shapes of a
link and the few shapes that are near an obstacle. So the obstacle is moved to the frame of the link
instead, and the bounding spheres of all its shapes are compared with it at once: only shapes whose
sphere is near are placed, and compared exactly.
"""

from __future__ import annotations

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import CENTRE, ROTATION, SIZE, TYPE
from tcs.kernel.motion.near_lists import GROUP, any_overlap, append_near, overlaps
from tcs.kernel.motion.pairs import groups_may_touch, is_near, place_shape
from tcs.kernel.motion.scene import NO_PAIR, MotionScene, MotionWorkspace


@inner
def contact_here(scene: MotionScene, work: MotionWorkspace) -> int:
    """Return a pair in contact at the current posture, NO_PAIR if there is none.

    Args:
        scene: The scene.
        work: Scratch, with the current posture, at which no joint moves.
    """
    for i in scene.roots:
        place_shape(scene, work, i)
    for at in range(len(scene.roots) - 1, -1, -1):
        i = scene.roots[at]
        first, moving, last = scene.first_pair[i], scene.first_moving[i], scene.first_pair[i + 1]
        while first < moving:
            end = min(first + GROUP, moving)
            if any_overlap(scene, work, i, first, end, 0.0):
                for k in range(first, end):
                    if overlaps(scene, work, i, k, 0.0):
                        found = _contact_below(scene, work, k)
                        if found != NO_PAIR:
                            return found
            first = end
        if append_near(scene, work, moving, last, 0.0, 0, 1) > 0:
            return work.pairs[0]
    return NO_PAIR


@inner
def _contact_below(scene: MotionScene, work: MotionWorkspace, k: int) -> int:
    """Return a pair in contact that is pair k or below it, NO_PAIR if there is none.

    Args:
        scene: The scene.
        work: Scratch, with the current posture; the shapes of the pair are placed.
        k: Pair of a shape or box of the arm and a fixed one.
    """
    i, j = scene.pair[k, 0], scene.pair[k, 1]
    fixed, first, last = j - len(scene.links), scene.leaves[i, 0], scene.leaves[i, 1]
    if first == last or fixed >= scene.leaf_pair.shape[1]:
        return work.pairs[0] if append_near(scene, work, k, k + 1, 0.0, 0, 1) > 0 else NO_PAIR
    if not groups_may_touch(work.shapes, i, j, scene.gap[k]):
        return NO_PAIR
    apart = scene.gap[k] + (0.0 if work.shapes[j, TYPE] == BOX else work.shapes[j, SIZE])
    if _compare_spheres(scene, work, k, apart, first, last) > 0:
        for n in range(first, last):
            if work.excess[n - first] < 0.0 and not _face_clears(scene, work, n, apart):
                m = scene.leaf_pair[n, fixed]
                if m != NO_PAIR and is_near(scene, work, m, False):
                    return m
    return NO_PAIR


@inner
def _face_clears(scene: MotionScene, work: MotionWorkspace, n: int, apart: float) -> bool:
    """Return whether a plane across an axis of the fixed shape keeps a shape away from it.

    Args:
        scene: The scene.
        work: Scratch, with what `_compare_spheres` fills.
        n: Column of the shape in `scene.leaf`.
        apart: Distance that the shape keeps from the core of the fixed one [m].
    """
    links, i, other = scene.links, scene.leaf_shape[n], work.other
    x, y, z = scene.leaf[0, n], scene.leaf[1, n], scene.leaf[2, n]
    for m in range(3):
        a, b, c = other[m, 0], other[m, 1], other[m, 2]
        away = abs(a * x + b * y + c * z + other[3, m]) - other[4, m] - apart
        if away <= 0.0:
            continue
        if links[i, TYPE] == BOX:
            for r in range(3):
                away -= links[i, SIZE + r] * abs(
                    a * links[i, ROTATION + r]
                    + b * links[i, ROTATION + 3 + r]
                    + c * links[i, ROTATION + 6 + r]
                )
        elif links[i, TYPE] == CAPSULE:
            along = (
                a * links[i, ROTATION + 2] + b * links[i, ROTATION + 5] + c * links[i, ROTATION + 8]
            )
            away -= links[i, SIZE] + links[i, SIZE + 1] * abs(along)
        else:
            away -= links[i, SIZE]
        if away >= 0.0:
            return True
    return False


@inner
def _compare_spheres(
    scene: MotionScene, work: MotionWorkspace, k: int, apart: float, first: int, last: int
) -> int:
    """Return how many bounding spheres of a link's shapes are closer to a fixed shape than its gap.

    Args:
        scene: The scene.
        work: Scratch; `excess` is filled, below 0 for each sphere that is closer, and `other`.
        k: Pair of the box around the shapes and the fixed shape.
        apart: Distance that spheres keep from the core of the fixed shape: a box, a segment along z
            or a point [m].
        first: First column of the shapes in `scene.leaf`.
        last: One after their last column.
    """
    j, shapes, frame = scene.pair[k, 1], work.shapes, scene.link_frame[scene.pair[k, 0]]
    R, p = work.link_R[frame], work.link_p[frame]
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
    other = work.other
    other[0, 0], other[0, 1], other[0, 2], other[3, 0], other[4, 0] = xx, xy, xz, dx, hx
    other[1, 0], other[1, 1], other[1, 2], other[3, 1], other[4, 1] = yx, yy, yz, dy, hy
    other[2, 0], other[2, 1], other[2, 2], other[3, 2], other[4, 2] = zx, zy, zz, dz, hz
    u, v, w = scene.leaf[0, first:last], scene.leaf[1, first:last], scene.leaf[2, first:last]
    bound, excess = scene.leaf[3, first:last], work.excess
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

"""Contacts at one posture: the shapes of a link are compared with a fixed shape in one vector loop.

At a posture alone most of the time would go into the boxes between the one around all shapes of a
link and the few shapes that are near an obstacle. So the obstacle is moved to the frame of the link
instead, and the bounding spheres of all its shapes are compared with it at once: only shapes whose
sphere is near are placed, and compared exactly.
"""

from __future__ import annotations

from tcs.kernel.arrays import BOX, CAPSULE
from tcs.kernel.cache import inner
from tcs.kernel.collide import ROTATION, SIZE, TYPE
from tcs.kernel.motion.leaf_spheres import compare_spheres
from tcs.kernel.motion.near_lists import any_overlap, append_near, overlaps
from tcs.kernel.motion.pairs import groups_may_touch, is_near, place_shape
from tcs.kernel.motion.scene import GROUP, NO_PAIR, MotionScene, MotionWorkspace


@inner
def contact_here(scene: MotionScene, work: MotionWorkspace) -> int:
    """Return a pair in contact at the current posture, NO_PAIR if there is none.

    Args:
        scene: The scene.
        work: Scratch, with the current posture, at which no joint moves.
    """
    pairs = scene.pairs
    for i in pairs.roots:
        place_shape(scene, work, i)
    for at in range(len(pairs.roots) - 1, -1, -1):
        i = pairs.roots[at]
        first, moving, last = pairs.first[i], pairs.first_moving[i], pairs.first[i + 1]
        while first < moving:
            end = min(first + GROUP, moving)
            if any_overlap(scene, work, i, first, end, 0.0):
                for k in range(first, end):
                    if overlaps(scene, work, i, k, first, 0.0):
                        found = _contact_below(scene, work, k)
                        if found != NO_PAIR:
                            return found
            first = end
        if append_near(scene, work, moving, last, 0.0, 0, 1) > 0:
            return work.uncertified.pairs[0]
    return NO_PAIR


@inner
def _contact_below(scene: MotionScene, work: MotionWorkspace, k: int) -> int:
    """Return a pair in contact that is pair k or below it, NO_PAIR if there is none.

    Args:
        scene: The scene.
        work: Scratch, with the current posture; the shapes of the pair are placed.
        k: Pair of a shape or box of the arm and a fixed one.
    """
    pairs, leaves, posture = scene.pairs, scene.leaves, work.posture
    i, j = pairs.members[k, 0], pairs.members[k, 1]
    fixed, first, last = j - len(scene.shapes.links), leaves.span[i, 0], leaves.span[i, 1]
    if first == last or fixed >= leaves.pair.shape[1]:
        return (
            work.uncertified.pairs[0]
            if append_near(scene, work, k, k + 1, 0.0, 0, 1) > 0
            else NO_PAIR
        )
    if not groups_may_touch(posture.shapes, i, j, pairs.gap[k]):
        return NO_PAIR
    apart = pairs.gap[k] + (0.0 if posture.shapes[j, TYPE] == BOX else posture.shapes[j, SIZE])
    if compare_spheres(scene, work, k, apart, first, last) > 0:
        for n in range(first, last):
            if work.separation.excess[n - first] < 0.0 and not _face_clears(scene, work, n, apart):
                m = leaves.pair[n, fixed]
                if m != NO_PAIR and is_near(scene, work, m, False):
                    return m
    return NO_PAIR


@inner
def _face_clears(scene: MotionScene, work: MotionWorkspace, n: int, apart: float) -> bool:
    """Return whether a plane across an axis of the fixed shape keeps a shape away from it.

    Args:
        scene: The scene.
        work: Scratch, with what `compare_spheres` fills.
        n: Column of the shape in `scene.leaves`.
        apart: Distance that the shape keeps from the core of the fixed one [m].
    """
    leaves = scene.leaves
    links, i, other = scene.shapes.links, leaves.shape[n], work.separation.other
    x, y, z = leaves.spheres[0, n], leaves.spheres[1, n], leaves.spheres[2, n]
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

"""Lists of pairs of shapes that may touch at a posture, or on a piece of a curve around it."""

from __future__ import annotations

from tcs.kernel.arrays import BOX
from tcs.kernel.cache import inner
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE
from tcs.kernel.motion.group_boxes import boxes_apart, take_frames
from tcs.kernel.motion.leaf_spheres import compare_spheres
from tcs.kernel.motion.pairs import is_of_groups, may_touch_on_piece, place_shape
from tcs.kernel.motion.scene import GROUP, NO_PAIR, MotionScene, MotionWorkspace

FAR = 0.25
"""Motion relative to the size of a pair of groups above which the piece is halved first."""


@inner
def list_near(scene: MotionScene, work: MotionWorkspace, extra: float, most: int) -> int:
    """List the pairs that may touch on the current piece from `uncertified.pairs[0]` on.

    Args:
        scene: The scene.
        work: Scratch, with the current posture.
        extra: Added to the gap of each pair [m].
        most: Number of pairs after which to stop.

    Returns:
        Number of pairs listed.
    """
    pairs = scene.pairs
    count = 0
    for i in pairs.roots:
        place_shape(scene, work, i)
    for i in pairs.roots:
        first, moving, last = pairs.first[i], pairs.first_moving[i], pairs.first[i + 1]
        while first < moving and count < most:
            end = min(first + GROUP, moving)
            apart = work.piece.motion[i, 0] + extra
            if any_overlap(scene, work, i, first, end, apart):
                for k in range(first, end):
                    if count < most and overlaps(scene, work, i, k, first, apart):
                        if has_leaves(scene, k):
                            count = _append_leaves(scene, work, k, extra, count, most)
                        else:
                            count = append_near(scene, work, k, k + 1, extra, count, most)
            first = end
        if count < most:
            count = append_near(scene, work, moving, last, extra, count, most)
        if count == most:
            return count
    return count


@inner
def has_leaves(scene: MotionScene, k: int) -> bool:
    """Return whether pair k, always checked, is of a box around a link and a single fixed shape."""
    leaves = scene.leaves
    i, fixed = scene.pairs.members[k, 0], scene.pairs.members[k, 1] - len(scene.shapes.links)
    return leaves.span[i, 0] < leaves.span[i, 1] and fixed < leaves.pair.shape[1]


@inner
def _append_leaves(
    scene: MotionScene, work: MotionWorkspace, k: int, extra: float, count: int, most: int
) -> int:
    """Append the pairs of a link's shapes and a fixed shape that may touch to `uncertified.pairs`.

    Where the box around the link moves far for its size, its pair is appended by `append_below`.

    Args:
        scene: The scene.
        work: Scratch, with the current posture; the shapes of pair k are placed.
        k: A pair with leaves.
        extra: Added to the gap of each pair [m].
        count: Number of pairs listed already.
        most: Number of pairs after which to stop.

    Returns:
        Number of pairs listed.
    """
    pairs, leaves = scene.pairs, scene.leaves
    i, j, shapes = pairs.members[k, 0], pairs.members[k, 1], work.posture.shapes
    moved, first, last = work.piece.motion[i, 0], leaves.span[i, 0], leaves.span[i, 1]
    if not may_touch_on_piece(scene, work, k, moved, extra):
        return count
    if moved > FAR * pairs.bound[k]:
        return append_below(scene, work, k, moved, extra, count, most)
    apart = pairs.gap[k] + extra + moved + (0.0 if shapes[j, TYPE] == BOX else shapes[j, SIZE])
    if compare_spheres(scene, work, k, apart, first, last) > 0:
        for n in range(first, last):
            m = leaves.pair[n, j - len(scene.shapes.links)]
            if work.separation.excess[n - first] < 0.0 and m != NO_PAIR:
                count = append_near(scene, work, m, m + 1, extra, count, most)
                if count == most:
                    break
    return count


@inner
def any_overlap(
    scene: MotionScene, work: MotionWorkspace, i: int, first: int, last: int, extra: float
) -> bool:
    """Return whether bounding spheres of shape i and fixed shapes are closer than their gap.

    Args:
        scene: The scene.
        work: Scratch, with the current posture; `separation.apart` is filled, below 0 for each
            pair whose spheres are closer.
        i: Shape of the arm.
        first: First pair.
        last: One after the last pair, GROUP later at most.
        extra: Added to the gap of each pair [m].
    """
    pairs = scene.pairs
    gap, bound = pairs.gap[first:last], pairs.bound[first:last]
    u, v, w = pairs.centre[0, first:last], pairs.centre[1, first:last], pairs.centre[2, first:last]
    shapes, excess = work.posture.shapes, work.separation.apart
    x, y, z = shapes[i, CENTRE], shapes[i, CENTRE + 1], shapes[i, CENTRE + 2]
    overlaps = 0
    # No branch and no early end: LLVM makes this loop a vector loop.
    for n in range(len(gap)):
        dx, dy, dz = u[n] - x, v[n] - y, w[n] - z
        apart = bound[n] + gap[n] + extra
        excess[n] = dx * dx + dy * dy + dz * dz - apart * apart
        overlaps += int(excess[n] < 0.0)
    return overlaps > 0


@inner
def overlaps(
    scene: MotionScene, work: MotionWorkspace, i: int, k: int, first: int, extra: float
) -> bool:
    """Return whether pair k is as `any_overlap`, for pairs from `first` on, says of some.

    The bounding sphere of the fixed shape is compared with shape i itself too: links are long.
    """
    pairs = scene.pairs
    if work.separation.apart[k - first] >= 0.0:
        return False
    shapes, centre = work.posture.shapes, pairs.centre
    if shapes[i, TYPE] != BOX:
        return True
    dx, dy, dz = (
        centre[0, k] - shapes[i, CENTRE],
        centre[1, k] - shapes[i, CENTRE + 1],
        centre[2, k] - shapes[i, CENTRE + 2],
    )
    square, apart = 0.0, pairs.bound[k] - shapes[i, BOUND] + pairs.gap[k] + extra
    for m in range(3):
        along = (
            shapes[i, ROTATION + m] * dx
            + shapes[i, ROTATION + 3 + m] * dy
            + shapes[i, ROTATION + 6 + m] * dz
        )
        beyond = max(abs(along) - shapes[i, SIZE + m], 0.0)
        square += beyond * beyond
    return square < apart * apart


@inner
def append_near(
    scene: MotionScene,
    work: MotionWorkspace,
    first: int,
    last: int,
    extra: float,
    count: int,
    most: int,
) -> int:
    """Append pairs that may touch to `uncertified.pairs`; return how many there are.

    Args:
        scene: The scene.
        work: Scratch, with the current posture; the second shapes of the pairs are placed.
        first: First pair.
        last: One after the last pair.
        extra: Added to the gap of each pair [m].
        count: Number of pairs listed already.
        most: Number of pairs after which to stop.
    """
    pairs = scene.pairs
    for k in range(first, last):
        place_shape(scene, work, pairs.members[k, 0])
        moved = work.piece.motion[pairs.members[k, 0], pairs.members[k, 2]]
        if may_touch_on_piece(scene, work, k, moved, extra):
            count = append_below(scene, work, k, moved, extra, count, most)
            if count == most:
                break
    return count


@inner
def append_below(
    scene: MotionScene,
    work: MotionWorkspace,
    k: int,
    moved: float,
    extra: float,
    count: int,
    most: int,
) -> int:
    """Append a pair that may touch to `uncertified.pairs`, or those of the pairs below it that may.

    A pair of groups that move far for their size is appended itself: nearly all pairs below it may
    touch on the piece, and fewer of them on its halves.

    Args:
        scene: The scene.
        work: Scratch, with the current posture.
        k: The pair.
        moved: Bound on the motion of its shapes relative to each other [m].
        extra: Added to the gap of each pair [m].
        count: Number of pairs listed already.
        most: Number of pairs after which to stop.

    Returns:
        Number of pairs listed.
    """
    pairs, stack, below = work.uncertified.pairs, work.uncertified.stack, scene.pairs.below
    whole, top = moved, 0
    still = _are_boxes(scene, k)
    if still:
        take_frames(scene, work, scene.pairs.members[k, 0], scene.pairs.members[k, 1])
    while count < most:
        if is_of_groups(scene, k) and moved <= FAR * scene.pairs.bound[k]:
            for n in range(below[k, 0], below[k, 1]):
                stack[top] = n
                top += 1
        else:
            pairs[count] = k
            count += 1
        near = False
        while top and not near:
            top -= 1
            k = stack[top]
            i, j, base = (
                scene.pairs.members[k, 0],
                scene.pairs.members[k, 1],
                scene.pairs.members[k, 2],
            )
            if still and _are_boxes(scene, k):
                if boxes_apart(scene, work, i, j, scene.pairs.gap[k] + extra + whole):
                    continue
                if whole <= FAR * scene.pairs.bound[k]:
                    moved, near = whole, True
                    continue
            place_shape(scene, work, i)
            if base > 0:
                place_shape(scene, work, j)
            moved = work.piece.motion[i, base]
            near = may_touch_on_piece(scene, work, k, moved, extra)
        if not near:
            break
    return count


@inner
def _are_boxes(scene: MotionScene, k: int) -> bool:
    """Return whether pair k is of a box around shapes of a link and one around fixed shapes."""
    return bool(
        scene.pairs.members[k, 0] >= scene.shapes.boxes[0]
        and scene.pairs.members[k, 1] >= scene.shapes.boxes[1]
    )

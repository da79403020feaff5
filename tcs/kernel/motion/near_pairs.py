"""Lists of pairs of shapes that may touch at a posture, or on a piece of a curve around it.

Pairs of groups are compared first. All boxes of a link have its axes, and all boxes around the
fixed shapes of one carrier have the same ones: the rotation between them is found once for a tree
of pairs, and no box is placed.

At a posture alone most of the time would go into the boxes between the one around all shapes of a
link and the few shapes that are near an obstacle. So the obstacle is moved to the frame of the link
instead, and the bounding spheres of all its shapes are compared with it in one vector loop: only
shapes whose sphere is near are placed, and compared exactly.
"""

from __future__ import annotations

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE
from tcs.kernel.motion.contact_bounds import (
    groups_may_touch,
    is_near,
    is_of_groups,
    may_touch_on_piece,
    place_shape,
)
from tcs.kernel.motion.scene import GROUP, NO_PAIR, MotionScene, MotionWorkspace

FAR = 0.25
"""Motion relative to the size of a pair of groups above which the piece is halved first."""


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

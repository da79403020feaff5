"""Which pairs of shapes may touch, at a posture or on a piece of a curve around it.

A pair may touch on a piece if it is closer, at the middle posture, than its gap plus a bound on how
far its shapes move on the piece.

The bound: with the joints changed one after the other, from the last to the first, a point at
distance d from the axis of joint k moves by at most `delta_k d` when that joint turns; and its
distance from the axis has grown by no more than the motion before (Schwarzer, Saha, Latombe 2005
bound the motion of all postures at once, which is looser). Where the twist of the link at the
middle posture is known, and what it leaves, `planes`, the motion from there is bounded by their sum
too.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE, closer, move, spheres_overlap
from tcs.kernel.distances import distance_bound
from tcs.kernel.kinematics import link_poses
from tcs.kernel.motion.planes import TWISTED, plane_between
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace

COARSE = 0.02
"""Motion [m] above which bounding spheres alone decide whether a pair may meet on a piece: the
exact distance is seldom greater, and the piece is halved anyway."""
FAR = 0.25
"""Motion relative to the size of a pair of groups above which the piece is halved first."""
GROUP = 16
"""Number of pairs that one vector loop checks."""
ROUNDING = 1e-9
"""Excess of the bounds [relative, and m], far above rounding errors of positions."""
GROWN = 1.0 + ROUNDING


@inner
def place_shape(scene: MotionScene, work: MotionWorkspace, i: int) -> None:
    """Place shape i of the arm at the current posture and fill its row of `motion`."""
    if work.placed[i] == work.posture[0]:
        return
    work.placed[i] = work.posture[0]
    frame, shapes = scene.link_frame[i], work.shapes
    move(work.link_R[frame], work.link_p[frame], scene.links, i, shapes, i)
    if work.posture[1] == 0:
        for k in range(frame + 1):
            work.motion[i, k] = 0.0
        return
    # The two cap centres of a capsule; one centre for others.
    half, radius = 0.0, shapes[i, BOUND]
    if shapes[i, TYPE] == CAPSULE:
        half, radius = shapes[i, SIZE + 1], shapes[i, SIZE]
    x, y, z = shapes[i, CENTRE], shapes[i, CENTRE + 1], shapes[i, CENTRE + 2]
    ax, ay, az = (
        half * shapes[i, ROTATION + 2],
        half * shapes[i, ROTATION + 5],
        half * shapes[i, ROTATION + 8],
    )
    total = second = 0.0
    work.motion[i, frame] = work.rest[i, frame] = 0.0
    for k in range(frame, 0, -1):
        angle = work.delta[k - 1]
        if angle > 0.0:
            R, p = work.link_R[k], work.link_p[k]
            dx, dy, dz = x - p[0], y - p[1], z - p[2]
            square = _from_axis(R, dx + ax, dy + ay, dz + az)
            if half > 0.0:
                square = max(square, _from_axis(R, dx - ax, dy - ay, dz - az))
            if shapes[i, TYPE] == BOX:
                radius = _radius_about(shapes, i, R)
            away = np.sqrt(square) + radius + total
            # Of the second derivative of a point: the terms of two joints, of one, of its own.
            second += (angle * (2.0 * total + angle * away) + work.bend[k - 1] * away) * GROWN
            total += angle * away * GROWN
        work.motion[i, k - 1], work.rest[i, k - 1] = total, 0.5 * second
    if work.posture[1] == TWISTED:
        work.motion[i, 0] = min(total, _motion_of_twist(work, i, frame) + work.rest[i, 0])


@inner
def _motion_of_twist(work: MotionWorkspace, i: int, frame: int) -> float:
    """Return a bound on the motion of any point of shape i by the twist of its link [m]."""
    shapes, twist = work.shapes, work.twist
    wx, wy, wz = twist[frame, 0], twist[frame, 1], twist[frame, 2]
    x, y, z = shapes[i, CENTRE], shapes[i, CENTRE + 1], shapes[i, CENTRE + 2]
    vx, vy, vz = (
        wy * z - wz * y + twist[frame, 3],
        wz * x - wx * z + twist[frame, 4],
        wx * y - wy * x + twist[frame, 5],
    )
    moved = np.sqrt(vx * vx + vy * vy + vz * vz)
    return (moved + np.sqrt(wx * wx + wy * wy + wz * wz) * shapes[i, BOUND]) * GROWN


@inner
def _from_axis(R: FloatArray, x: float, y: float, z: float) -> float:
    """Return the squared distance of a point from the z axis of an orientation R [m^2]."""
    cx, cy, cz = y * R[2, 2] - z * R[1, 2], z * R[0, 2] - x * R[2, 2], x * R[1, 2] - y * R[0, 2]
    return cx * cx + cy * cy + cz * cz


@inner
def _radius_about(shapes: FloatArray, i: int, R: FloatArray) -> float:
    """Return the radius of box i about the line through its centre along the z axis of R [m].

    Half edges h_m with components u_m along the axis add up, with any signs, to vectors whose
    square across the axis is at most |h|^2 - |u|^2 + 2 (|u_0 u_1| + |u_0 u_2| + |u_1 u_2|).
    """
    bound = shapes[i, BOUND]
    square = bound * bound
    others = 0.0
    for m in range(3):
        u = shapes[i, SIZE + m] * abs(
            shapes[i, ROTATION + m] * R[0, 2]
            + shapes[i, ROTATION + 3 + m] * R[1, 2]
            + shapes[i, ROTATION + 6 + m] * R[2, 2]
        )
        square += 2.0 * u * others - u * u
        others += u
    return min(bound, np.sqrt(max(square, 0.0)))


@inner
def take_posture(scene: MotionScene, work: MotionWorkspace) -> None:
    """Make `work.q` the current posture: shapes are placed anew when next used."""
    work.posture[0] += 1
    work.posture[1] = 0
    for k in range(7):
        if work.delta[k] > 0.0:
            work.posture[1] = 1
    link_poses(scene.chain_R, scene.chain_p, work.q, work.link_R, work.link_p)


@inner
def is_near(scene: MotionScene, work: MotionWorkspace, k: int, grown: bool) -> bool:
    """Return whether pair k may touch: at the current posture, or `grown`, near it.

    Near it is wherever no joint is farther from the posture than `delta`.
    """
    i, j, base = scene.pair[k, 0], scene.pair[k, 1], scene.pair[k, 2]
    place_shape(scene, work, i)
    if base > 0:
        place_shape(scene, work, j)
    moved = work.motion[i, base] + ROUNDING if grown else 0.0
    return _may_touch(work.shapes, i, j, scene.gap[k] + moved, moved) and not _table_clears(
        scene, work, k, scene.gap[k], grown
    )


@inner
def list_near(scene: MotionScene, work: MotionWorkspace, extra: float, most: int) -> int:
    """List the pairs that may touch on the current piece from `work.pairs[0]` on.

    Args:
        scene: The scene.
        work: Scratch, with the current posture.
        extra: Added to the gap of each pair [m].
        most: Number of pairs after which to stop.

    Returns:
        Number of pairs listed.
    """
    count = 0
    for i in scene.roots:
        place_shape(scene, work, i)
    for i in scene.roots:
        first, moving, last = scene.first_pair[i], scene.first_moving[i], scene.first_pair[i + 1]
        while first < moving and count < most:
            end = min(first + GROUP, moving)
            apart = work.motion[i, 0] + extra
            if _any_overlap(scene, work, i, first, end, apart):
                for k in range(first, end):
                    if count < most and _overlaps(scene, work, i, k, apart):
                        count = _append_near(scene, work, k, k + 1, extra, count, most)
            first = end
        if count < most:
            count = _append_near(scene, work, moving, last, extra, count, most)
        if count == most:
            return count
    return count


@inner
def _any_overlap(
    scene: MotionScene, work: MotionWorkspace, i: int, first: int, last: int, extra: float
) -> bool:
    """Return whether bounding spheres of shape i and fixed shapes are closer than their gap.

    Args:
        scene: The scene.
        work: Scratch, with the current posture.
        i: Shape of the arm.
        first: First pair.
        last: One after the last pair.
        extra: Added to the gap of each pair [m].
    """
    gap, bound = scene.gap[first:last], scene.bound[first:last]
    u, v, w = scene.centre[0, first:last], scene.centre[1, first:last], scene.centre[2, first:last]
    shapes = work.shapes
    x, y, z = shapes[i, CENTRE], shapes[i, CENTRE + 1], shapes[i, CENTRE + 2]
    overlaps = 0
    # No branch and no early end: LLVM makes this loop a vector loop.
    for n in range(len(gap)):
        dx, dy, dz = u[n] - x, v[n] - y, w[n] - z
        apart = bound[n] + gap[n] + extra
        overlaps += int(dx * dx + dy * dy + dz * dz < apart * apart)
    return overlaps > 0


@inner
def _overlaps(scene: MotionScene, work: MotionWorkspace, i: int, k: int, extra: float) -> bool:
    """Return whether pair k, of shape i and a fixed one, is as `_any_overlap` says of some."""
    shapes, centre = work.shapes, scene.centre
    dx, dy, dz = (
        centre[0, k] - shapes[i, CENTRE],
        centre[1, k] - shapes[i, CENTRE + 1],
        centre[2, k] - shapes[i, CENTRE + 2],
    )
    apart = scene.bound[k] + scene.gap[k] + extra
    return dx * dx + dy * dy + dz * dz < apart * apart


@inner
def _append_near(
    scene: MotionScene,
    work: MotionWorkspace,
    first: int,
    last: int,
    extra: float,
    count: int,
    most: int,
) -> int:
    """Append pairs that may touch to `work.pairs`; return how many there are.

    Args:
        scene: The scene.
        work: Scratch, with the current posture; the shapes of the pairs are placed.
        first: First pair.
        last: One after the last pair.
        extra: Added to the gap of each pair [m].
        count: Number of pairs listed already.
        most: Number of pairs after which to stop.
    """
    for k in range(first, last):
        moved = work.motion[scene.pair[k, 0], scene.pair[k, 2]]
        if _may_touch_on_piece(scene, work, k, moved, extra):
            count = append_below(scene, work, k, moved, extra, count, most)
            if count == most:
                break
    return count


@inner
def is_of_groups(scene: MotionScene, k: int) -> bool:
    """Return whether there are pairs below pair k, so that it cannot be in contact itself."""
    return k < len(scene.below) and scene.below[k, 0] < scene.below[k, 1]


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
    """Append a pair that may touch to `work.pairs`, or those of the pairs below it that may.

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
    pairs, stack, below = work.pairs, work.stack, scene.below
    top = 0
    while count < most:
        if is_of_groups(scene, k) and moved <= FAR * scene.bound[k]:
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
            i, j, base = scene.pair[k, 0], scene.pair[k, 1], scene.pair[k, 2]
            place_shape(scene, work, i)
            if base > 0:
                place_shape(scene, work, j)
            moved = work.motion[i, base]
            near = _may_touch_on_piece(scene, work, k, moved, extra)
        if not near:
            break
    return count


@inner
def _may_touch_on_piece(
    scene: MotionScene, work: MotionWorkspace, k: int, moved: float, extra: float
) -> bool:
    """Return whether pair k may be closer than its gap, and `extra` [m], on the current piece.

    Its shapes are placed; they move by at most `moved` [m] relative to each other.
    """
    i, j, base = scene.pair[k, 0], scene.pair[k, 1], scene.pair[k, 2]
    shapes, within, of_groups = work.shapes, scene.gap[k] + extra, is_of_groups(scene, k)
    if moved == 0.0:
        if of_groups:
            return _groups_may_touch(shapes, i, j, within)
        near = _may_touch(shapes, i, j, within, moved)
        return near and not _table_clears(scene, work, k, within, False)
    far = within + moved
    if not spheres_overlap(shapes, i, shapes, j, far) or not _sphere_near(shapes, i, j, far):
        return False
    if plane_between(scene, work, i, j, base, within, far, not of_groups):
        return False
    if of_groups:
        return True
    # Near two corners, boxes are farther apart than any plane tells.
    near = moved > COARSE or closer(shapes, i, shapes, j, far)
    return near and not _table_clears(scene, work, k, within, True)


@inner
def _table_clears(
    scene: MotionScene, work: MotionWorkspace, k: int, within: float, grown: bool
) -> bool:
    """Return whether a table shows that the bodies of a pair of shapes keep a distance.

    Args:
        scene: The scene.
        work: Scratch, with the current posture.
        k: The pair, of shapes.
        within: The distance [m].
        grown: Whether they keep it wherever no joint is farther from the posture than `delta`.
    """
    first = scene.body[scene.pair[k, 0]] - scene.robot
    second = scene.body[scene.pair[k, 1]] - scene.robot
    if second < 0:
        return False
    distances = scene.distances
    n = distances.of_bodies[first, second]
    if n < 0:
        return False
    least = distance_bound(distances, n, work.q)
    if grown:
        for m in range(2):
            least -= distances.reach[n, m] * work.delta[distances.joint[n, m]] * GROWN
    return least >= within


@inner
def is_near_on_piece(scene: MotionScene, work: MotionWorkspace, k: int) -> bool:
    """Return whether pair k may touch on the current piece of a curve."""
    i, j, base = scene.pair[k, 0], scene.pair[k, 1], scene.pair[k, 2]
    place_shape(scene, work, i)
    if base > 0:
        place_shape(scene, work, j)
    return _may_touch_on_piece(scene, work, k, work.motion[i, base], ROUNDING)


@inner
def _groups_may_touch(shapes: FloatArray, i: int, j: int, within: float) -> bool:
    """Return whether two shapes or boxes around groups may be closer than a distance [m].

    Two boxes may be unless a face of one separates them: what is in them is checked next anyway.
    """
    if not spheres_overlap(shapes, i, shapes, j, within) or not _sphere_near(shapes, i, j, within):
        return False
    if shapes[i, TYPE] != BOX or shapes[j, TYPE] != BOX:
        return closer(shapes, i, shapes, j, within)
    return not _face_separates(shapes, i, j, within) and not _face_separates(shapes, j, i, within)


@inner
def _face_separates(shapes: FloatArray, i: int, j: int, within: float) -> bool:
    """Return whether box i is at least a distance [m] beyond a face of box j."""
    x, y, z = (
        shapes[i, CENTRE] - shapes[j, CENTRE],
        shapes[i, CENTRE + 1] - shapes[j, CENTRE + 1],
        shapes[i, CENTRE + 2] - shapes[j, CENTRE + 2],
    )
    for m in range(3):
        nx, ny, nz = (
            shapes[j, ROTATION + m],
            shapes[j, ROTATION + 3 + m],
            shapes[j, ROTATION + 6 + m],
        )
        extent = shapes[j, SIZE + m] + within
        for n in range(3):
            extent += shapes[i, SIZE + n] * abs(
                nx * shapes[i, ROTATION + n]
                + ny * shapes[i, ROTATION + 3 + n]
                + nz * shapes[i, ROTATION + 6 + n]
            )
        if abs(nx * x + ny * y + nz * z) >= extent:
            return True
    return False


@inner
def _may_touch(shapes: FloatArray, i: int, j: int, within: float, moved: float) -> bool:
    """Return whether two shapes may be closer than a distance [m], after a motion of one [m]."""
    return (
        spheres_overlap(shapes, i, shapes, j, within)
        and _sphere_near(shapes, i, j, within)
        and (moved > COARSE or closer(shapes, i, shapes, j, within))
    )


@inner
def _sphere_near(shapes: FloatArray, i: int, j: int, within: float) -> bool:
    """Return whether the bounding sphere of shape i is closer than a distance [m] to shape j."""
    x, y, z = (
        shapes[i, CENTRE] - shapes[j, CENTRE],
        shapes[i, CENTRE + 1] - shapes[j, CENTRE + 1],
        shapes[i, CENTRE + 2] - shapes[j, CENTRE + 2],
    )
    reach = shapes[i, BOUND] + within
    if shapes[j, TYPE] == BOX:
        square = 0.0
        for m in range(3):
            along = (
                shapes[j, ROTATION + m] * x
                + shapes[j, ROTATION + 3 + m] * y
                + shapes[j, ROTATION + 6 + m] * z
            )
            beyond = max(abs(along) - shapes[j, SIZE + m], 0.0)
            square += beyond * beyond
        return square < reach * reach
    if shapes[j, TYPE] == CAPSULE:
        ux, uy, uz = shapes[j, ROTATION + 2], shapes[j, ROTATION + 5], shapes[j, ROTATION + 8]
        half = shapes[j, SIZE + 1]
        along = min(max(ux * x + uy * y + uz * z, -half), half)
        dx, dy, dz = x - along * ux, y - along * uy, z - along * uz
        reach += shapes[j, SIZE]
        return dx * dx + dy * dy + dz * dz < reach * reach
    return True

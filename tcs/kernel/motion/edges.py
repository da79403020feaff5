"""Certified freedom from contact of curves in joint space.

A curve is a cubic Bezier curve of joint angles; a straight edge is one with equally spaced control
points. A piece of it is certified when, at its middle posture, every pair of shapes is farther
apart than its gap plus a bound on how far the shapes move on the piece. Other pieces are halved and
the pairs in question checked again, until all are certified or a pair is in contact. So nothing
lies between samples, however thin.

The bound: with the joints changed one after the other, from the last to the first, a point at
distance d from the axis of joint k moves by at most `delta_k d` when that joint turns; and its
distance from the axis has grown by no more than the motion before (Schwarzer, Saha, Latombe 2005
bound the motion of all postures at once, which is looser).
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import CAPSULE, FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE, closer, move, spheres_overlap
from tcs.kernel.kinematics import link_poses
from tcs.kernel.motion.scene import DEPTH, MotionScene, MotionWorkspace
from tcs.kernel.views import unowned

RESOLUTION = 1e-5
"""Motion [m] below which a piece that is not certified counts as blocked: a path keeps at most this
much more clearance than required."""
COARSE = 0.15
"""Motion [m] above which bounding spheres alone decide whether a pair may meet on a piece: the
exact distance is seldom greater, and the piece is halved anyway."""
ROUNDING = 1e-9
"""Excess of the bounds [relative, and m], far above rounding errors of positions."""
NO_PAIR = -1


@inner
def place_shape(scene: MotionScene, work: MotionWorkspace, i: int) -> None:
    """Place shape i of the arm at the current posture and fill its row of `motion`."""
    if work.placed[i] == work.posture[0]:
        return
    work.placed[i] = work.posture[0]
    frame, shapes = scene.link_frame[i], work.shapes
    move(work.link_R[frame], work.link_p[frame], scene.links, i, shapes, i)
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
    total = 0.0
    work.motion[i, frame] = 0.0
    for k in range(frame, 0, -1):
        angle = work.delta[k - 1]
        if angle > 0.0:
            R, p = work.link_R[k], work.link_p[k]
            dx, dy, dz = x - p[0], y - p[1], z - p[2]
            square = _from_axis(R, dx + ax, dy + ay, dz + az)
            if half > 0.0:
                square = max(square, _from_axis(R, dx - ax, dy - ay, dz - az))
            total += angle * (np.sqrt(square) + radius + total) * (1.0 + ROUNDING)
        work.motion[i, k - 1] = total


@inner
def _from_axis(R: FloatArray, x: float, y: float, z: float) -> float:
    """Return the squared distance of a point from the z axis of an orientation R [m^2]."""
    cx, cy, cz = y * R[2, 2] - z * R[1, 2], z * R[0, 2] - x * R[2, 2], x * R[1, 2] - y * R[0, 2]
    return cx * cx + cy * cy + cz * cz


@inner
def take_posture(scene: MotionScene, work: MotionWorkspace) -> None:
    """Make `work.q` the current posture: shapes are placed anew when next used."""
    work.posture[0] += 1
    link_poses(scene.chain_R, scene.chain_p, work.q, work.link_R, work.link_p)


@inner
def is_near(scene: MotionScene, work: MotionWorkspace, k: int, grown: bool) -> bool:
    """Return whether pair k may touch: at the current posture, or `grown`, on the current piece."""
    i, j, base = scene.pair[k, 0], scene.pair[k, 1], scene.pair[k, 2]
    place_shape(scene, work, i)
    if base > 0:
        place_shape(scene, work, j)
    gap, moved = scene.gap[k], 0.0
    if grown:
        moved = work.motion[i, base] + ROUNDING
    shapes = work.shapes
    return spheres_overlap(shapes, i, shapes, j, gap + moved) and (
        moved > COARSE or closer(shapes, i, shapes, j, gap + moved)
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
    pair, gap, first = scene.pair, scene.gap, scene.first_pair
    shapes, motion, near = work.shapes, work.motion, work.pairs
    count = 0
    for i in range(len(scene.links)):
        place_shape(scene, work, i)
    for i in range(len(scene.links)):
        x, y, z = shapes[i, CENTRE], shapes[i, CENTRE + 1], shapes[i, CENTRE + 2]
        for k in range(first[i], first[i + 1]):
            j = pair[k, 1]
            moved = motion[i, pair[k, 2]]
            within = gap[k] + moved + extra
            dx, dy, dz = shapes[j, CENTRE] - x, shapes[j, CENTRE + 1] - y, shapes[j, CENTRE + 2] - z
            apart = shapes[i, BOUND] + shapes[j, BOUND] + within
            if dx * dx + dy * dy + dz * dz >= apart * apart:
                continue
            if moved > COARSE or closer(shapes, i, shapes, j, within):
                near[count] = k
                count += 1
                if count == most:
                    return count
    return count


@inner
def posture_is_free(scene: MotionScene, work: MotionWorkspace, q: FloatArray) -> bool:
    """Return whether nothing touches at joint angles q; fills `contact` if something does.

    The last pair in contact is checked first.
    """
    for k in range(7):
        work.q[k], work.delta[k] = q[k], 0.0
    take_posture(scene, work)
    last = work.contact[0]
    if last >= 0 and is_near(scene, work, last, False):
        return False
    if list_near(scene, work, 0.0, 1) > 0:
        work.contact[0] = work.pairs[0]
        return False
    return True


@jit
def posture_contact(owned_scene: MotionScene, owned_work: MotionWorkspace, q: FloatArray) -> int:
    """Return a pair in contact at joint angles q [rad], shape (7,), or NO_PAIR."""
    scene, work = unowned(owned_scene), unowned(owned_work)
    return NO_PAIR if posture_is_free(scene, work, q) else work.contact[0]


@jit
def certified(owned_scene: MotionScene, owned_work: MotionWorkspace, control: FloatArray) -> float:
    """Return how far a curve is certified free of contact, from its begin: 1 for all of it.

    Args:
        owned_scene: The scene.
        owned_work: Scratch; where the result is below 1, `contact` is the pair that blocks it.
        control: Control points of the cubic Bezier curve [rad], shape (4, 7).
    """
    scene, work = unowned(owned_scene), unowned(owned_work)
    for m in range(4):
        for k in range(7):
            work.control[m, k] = control[m, k]
    return curve_is_free_until(scene, work)


@inner
def edge_is_free(
    scene: MotionScene, work: MotionWorkspace, start: FloatArray, end: FloatArray
) -> bool:
    """Return whether the straight edge between two postures [rad] is certified, ends included."""
    if not posture_is_free(scene, work, end):
        work.hits[work.contact[0]] += 1
        return False
    control = work.control
    for k in range(7):
        step = end[k] - start[k]
        control[0, k], control[3, k] = start[k], end[k]
        control[1, k], control[2, k] = start[k] + step / 3.0, end[k] - step / 3.0
    return curve_is_free_until(scene, work) == 1.0


@inner
def curve_is_free_until(scene: MotionScene, work: MotionWorkspace) -> float:
    """Return how far the curve `work.control` is certified, from its begin; 1 for all of it."""
    span, stretch = work.span, work.stretch
    _take_middle(work, 0.0, 1.0)
    take_posture(scene, work)
    span[0, 0], span[0, 1] = 0.0, 1.0
    stretch[0, 0], stretch[0, 1] = 0, list_near(scene, work, ROUNDING, len(scene.pair))
    top = 1 if stretch[0, 1] > 0 else 0
    while top:
        top -= 1
        begin, end = span[top, 0], span[top, 1]
        first, last = stretch[top, 0], stretch[top, 1]
        left = _uncertified(scene, work, begin, end, first, last)
        if left < 0 or (left > 0 and top + 2 > 2 * DEPTH):
            work.hits[work.contact[0]] += 1
            return begin
        if left > 0:
            # The first half goes on top, so that what is certified grows from the begin.
            middle = 0.5 * (begin + end)
            span[top, 0], span[top, 1] = middle, end
            span[top + 1, 0], span[top + 1, 1] = begin, middle
            for n in range(2):
                stretch[top + n, 0], stretch[top + n, 1] = last, last + left
            top += 2
    return 1.0


@inner
def _uncertified(
    scene: MotionScene, work: MotionWorkspace, begin: float, end: float, first: int, last: int
) -> int:
    """Certify pairs on a piece of the curve, and list those that are not certified.

    Args:
        scene: The scene.
        work: Holds the curve; `pairs[first:last]` are the pairs to check. Those not certified are
            listed from `pairs[last]` on.
        begin: Begin of the piece, in [0, 1].
        end: End of the piece.
        first: First pair.
        last: One after the last pair.

    Returns:
        Number of pairs not certified, or -1 where one is in contact, or moves less than RESOLUTION.
    """
    _take_middle(work, begin, end)
    take_posture(scene, work)
    left = 0
    for n in range(first, last):
        k = work.pairs[n]
        if not is_near(scene, work, k, True):
            continue
        moved = work.motion[scene.pair[k, 0], scene.pair[k, 2]]
        if moved < RESOLUTION or is_near(scene, work, k, False):
            work.contact[0] = k
            return -1
        work.pairs[last + left] = k
        left += 1
    return left


@inner
def _take_middle(work: MotionWorkspace, begin: float, end: float) -> None:
    """Fill the posture in the middle of a piece, and how far each joint is from it on the piece."""
    control, t, half = work.control, 0.5 * (begin + end), 0.5 * (end - begin)
    u = 1.0 - t
    for k in range(7):
        a, b, c, d = control[0, k], control[1, k], control[2, k], control[3, k]
        work.q[k] = u * u * (u * a + 3.0 * t * b) + t * t * (3.0 * u * c + t * d)
        # The derivative of the curve lies between three times the differences of its points.
        work.delta[k] = 3.0 * half * max(abs(b - a), abs(c - b), abs(d - c))

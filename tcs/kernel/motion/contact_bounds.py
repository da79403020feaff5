"""Which pairs of shapes may touch, at a posture or on a piece of a curve around it.

A pair may touch on a piece if it is closer, at the middle posture, than its gap plus a bound on how
far its shapes move on the piece.

The bound: with the joints changed one after the other, from the last to the first, a point at
distance d from the axis of joint k moves by at most `delta_k d` when that joint turns, or by
`delta_k` if it is prismatic; and its
distance from the axis has grown by no more than the motion before (Schwarzer, Saha, Latombe 2005
bound the motion of all postures at once, which is looser). Where the twist of the link at the
middle posture is known, and what it leaves, `separating_planes`, the motion from there is bounded
by their sum too. Where the tool follows a straight line, `tool_line`, so is the motion of the last
links by the joints between them and the tool.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE, closer, move, spheres_overlap
from tcs.kernel.distances import distance_bound
from tcs.kernel.motion.link_poses import place_links, place_turned
from tcs.kernel.motion.scene import FRAMES, SEEN_FROM_TOOL, MotionScene, MotionWorkspace
from tcs.kernel.motion.separating_planes import TWISTED, plane_between
from tcs.kernel.motion.tool_line import follows_line, line_motion, off_line

COARSE = 0.02
"""Motion [m] above which bounding spheres alone decide whether a pair may meet on a piece: the
exact distance is seldom greater, and the piece is halved anyway."""
SMALL = 1e-3
"""Motion [m] above which planes alone decide that for boxes: their exact distance takes as long as
checking the pair on four pieces."""
ROUNDING = 1e-9
"""Excess of the bounds [relative, and m], far above rounding errors of positions."""
GROWN = 1.0 + ROUNDING


@inner
def place_shape(scene: MotionScene, work: MotionWorkspace, i: int) -> None:
    """Place shape i of the arm at the current posture and fill its row of `piece.motion`."""
    posture, piece = work.posture, work.piece
    if posture.placed[i] == posture.number[0]:
        return
    posture.placed[i] = posture.number[0]
    frame, shapes = scene.shapes.link_frame[i], posture.shapes
    move(posture.link_R[frame], posture.link_p[frame], scene.shapes.links, i, shapes, i)
    if piece.known[0] == 0:
        for k in range(_columns(scene, frame)):
            piece.motion[i, k] = 0.0
        return
    root = scene.shapes.root[i]
    if root != i and piece.known[0] == TWISTED:
        _bound_motion_in_box(scene, work, i, root)
    else:
        _bound_motion(scene, work, i)


@inner
def _columns(scene: MotionScene, frame: int) -> int:
    """Return the number of columns of `motion` and `rest` that hold for a shape on a link."""
    coupled = len(scene.chain.coupled)
    return frame + 1 if coupled == 0 else FRAMES + coupled


@inner
def _bound_motion_in_box(scene: MotionScene, work: MotionWorkspace, i: int, root: int) -> None:
    """Fill the rows of `motion` and `rest` of shape i, or box, in box `root` around a link's.

    No point of the box moves farther than its own rows say. Relative to what is fixed, shape i is
    bounded by the twist of its link too, which says what part of the box it is; this takes a
    fifth of the time that `_bound_motion` does.
    """
    posture, shapes, piece = work.posture, scene.shapes, work.piece
    if posture.placed[root] != posture.number[0]:
        posture.placed[root] = posture.number[0]
        frame = shapes.link_frame[root]
        move(
            posture.link_R[frame],
            posture.link_p[frame],
            shapes.links,
            root,
            posture.shapes,
            root,
        )
        _bound_motion(scene, work, root)
    frame = shapes.link_frame[i]
    for k in range(_columns(scene, frame)):
        piece.motion[i, k], piece.rest[i, k] = piece.motion[root, k], piece.rest[root, k]
    piece.by_tool[i] = piece.by_tool[root]
    twist = piece.tool_twist if piece.by_tool[i] else piece.twist
    piece.motion[i, 0] = min(
        piece.motion[root, 0],
        _motion_of_twist(work, i, twist[frame]) + piece.rest[root, 0],
    )


@inner
def _bound_motion(scene: MotionScene, work: MotionWorkspace, i: int) -> None:
    """Fill the rows of `motion` and `rest` of shape i, placed at the current posture."""
    piece, chain = work.piece, scene.chain
    frame = scene.shapes.link_frame[i]
    total = second = 0.0
    piece.motion[i, frame] = piece.rest[i, frame] = 0.0
    last, part = frame, 1.0
    if frame >= FRAMES:
        last, part = int(chain.coupled[frame - FRAMES, 0]) + 1, chain.coupled[frame - FRAMES, 1]
    for k in range(last, 0, -1):
        if len(chain.coupled) > 0:
            _bound_between(scene, work, i, k, part, total, second)
        if piece.delta[k - 1] > 0.0:
            slide = part * chain.slides[k - 1]
            total, second = _with_joint(work, i, k, slide, total, second)
        piece.motion[i, k - 1], piece.rest[i, k - 1] = total, 0.5 * second
        part = 1.0
    piece.by_tool[i] = False
    if piece.known[0] == TWISTED:
        if SEEN_FROM_TOOL <= frame < FRAMES and follows_line(work):
            _bound_motion_by_tool(scene, work, i, frame)
        twist = piece.tool_twist if piece.by_tool[i] else piece.twist
        moved = _motion_of_twist(work, i, twist[frame]) + piece.rest[i, 0]
        piece.motion[i, 0] = min(piece.motion[i, 0], moved)


@inner
def _bound_between(
    scene: MotionScene,
    work: MotionWorkspace,
    i: int,
    k: int,
    part: float,
    total: float,
    second: float,
) -> None:
    """Fill the rows of `motion` and `rest` of shape i relative to links between coupled joints.

    Args:
        scene: The scene.
        work: Scratch.
        i: The shape.
        k: The joint, 1 .. 7, that the links are between.
        part: Fraction of the motion of that joint that the shape makes.
        total: As for `_with_joint`.
        second: As for `_with_joint`.
    """
    chain, piece = scene.chain, work.piece
    for n in range(len(chain.coupled)):
        if int(chain.coupled[n, 0]) == k - 1 and chain.coupled[n, 1] < part:
            slide = (part - chain.coupled[n, 1]) * chain.slides[k - 1]
            moved = slide * piece.delta[k - 1] * GROWN
            bend = slide * piece.bend[k - 1] * GROWN
            piece.motion[i, FRAMES + n] = total + moved
            piece.rest[i, FRAMES + n] = 0.5 * (second + bend)


@inner
def _bound_motion_by_tool(scene: MotionScene, work: MotionWorkspace, i: int, frame: int) -> None:
    """Bound the motion of shape i on link `frame` by the joints between it and the tool.

    The tool follows a line, so these joints alone decide how far the shape is from where
    `tool_twist` leads it. Fills the rows of `motion` and `rest` relative to what is fixed, and
    `by_tool`, where they are less than by the joints between the shape and the base.
    """
    piece = work.piece
    total = second = 0.0
    for k in range(frame + 1, 8):
        if piece.delta[k - 1] > 0.0:
            total, second = _with_joint(work, i, k, scene.chain.slides[k - 1], total, second)
    off = off_line(work, total)
    if 0.5 * second + off < piece.rest[i, 0]:
        piece.by_tool[i], piece.rest[i, 0] = True, 0.5 * second + off
        piece.motion[i, 0] = min(piece.motion[i, 0], total + line_motion(work) + off)


@inner
def _with_joint(
    work: MotionWorkspace, i: int, k: int, slide: float, total: float, second: float
) -> tuple[float, float]:
    """Return how far a point of shape i moves on the piece if joint k moves too [m].

    Args:
        work: Scratch; shape i is placed.
        i: The shape.
        k: The joint, 1 .. 7, the next one on the way from the shape to the base, or to the tool.
        slide: Motion of the shape per unit of a prismatic joint [m/m], 0 for a revolute one.
        total: Bound on the motion by the joints between.
        second: Bound on their terms of the second derivative.

    Returns:
        `total` and `second` with joint k.
    """
    posture, piece = work.posture, work.piece
    shapes, angle = posture.shapes, piece.delta[k - 1]
    if slide > 0.0:
        # It moves all points alike, whatever the joints between do.
        return total + slide * angle * GROWN, second + slide * piece.bend[k - 1] * GROWN
    R, p = posture.link_R[k], posture.link_p[k]
    dx, dy, dz = (
        shapes[i, CENTRE] - p[0],
        shapes[i, CENTRE + 1] - p[1],
        shapes[i, CENTRE + 2] - p[2],
    )
    if shapes[i, TYPE] == CAPSULE:
        # The two cap centres; one centre for others.
        half, radius = shapes[i, SIZE + 1], shapes[i, SIZE]
        ax, ay, az = (
            half * shapes[i, ROTATION + 2],
            half * shapes[i, ROTATION + 5],
            half * shapes[i, ROTATION + 8],
        )
        square = max(
            _from_axis(R, dx + ax, dy + ay, dz + az), _from_axis(R, dx - ax, dy - ay, dz - az)
        )
    else:
        square, radius = _from_axis(R, dx, dy, dz), shapes[i, BOUND]
        if shapes[i, TYPE] == BOX:
            radius = _radius_about(shapes, i, R)
    away = np.sqrt(square) + radius + total
    # Of the second derivative of a point: the terms of two joints, of one, of its own.
    second += (angle * (2.0 * total + angle * away) + piece.bend[k - 1] * away) * GROWN
    return total + angle * away * GROWN, second


@inner
def _motion_of_twist(work: MotionWorkspace, i: int, twist: FloatArray) -> float:
    """Return a bound on the motion of any point of shape i by a twist of its link [m]."""
    shapes = work.posture.shapes
    wx, wy, wz = twist[0], twist[1], twist[2]
    x, y, z = shapes[i, CENTRE], shapes[i, CENTRE + 1], shapes[i, CENTRE + 2]
    vx, vy, vz = (
        wy * z - wz * y + twist[3],
        wz * x - wx * z + twist[4],
        wx * y - wy * x + twist[5],
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
    """Make `posture.q` the current posture: shapes are placed anew when next used."""
    posture, piece, chain = work.posture, work.piece, scene.chain
    posture.number[0] += 1
    piece.known[0] = 0
    for k in range(7):
        if piece.delta[k] > 0.0:
            piece.known[0] = 1
    place_links(
        chain.R,
        chain.p,
        posture.q,
        posture.turns,
        posture.link_R,
        posture.link_p,
    )
    for n in range(len(chain.coupled)):
        k = int(chain.coupled[n, 0])
        R, p = posture.link_R[k + 1], posture.link_p[k + 1]
        behind = (1.0 - chain.coupled[n, 1]) * chain.slides[k] * posture.q[k]
        for r in range(3):
            for c in range(3):
                posture.link_R[FRAMES + n, r, c] = R[r, c]
            posture.link_p[FRAMES + n, r] = p[r] - behind * R[r, 2]


@inner
def take_turned_posture(scene: MotionScene, work: MotionWorkspace) -> None:
    """Do as `take_posture` where no joint moves, given the joints' sines and cosines in `turns`."""
    posture = work.posture
    posture.number[0] += 1
    work.piece.known[0] = 0
    place_turned(
        scene.chain.R,
        scene.chain.p,
        posture.q,
        posture.turns,
        posture.link_R,
        posture.link_p,
    )


@inner
def is_near(scene: MotionScene, work: MotionWorkspace, k: int, grown: bool) -> bool:
    """Return whether pair k may touch: at the current posture, or `grown`, near it.

    Near it is wherever no joint is farther from the posture than `delta`.
    """
    pairs = scene.pairs
    i, j, base = pairs.members[k, 0], pairs.members[k, 1], pairs.members[k, 2]
    place_shape(scene, work, i)
    if base > 0:
        place_shape(scene, work, j)
    moved = work.piece.motion[i, base] + ROUNDING if grown else 0.0
    return _may_touch(work.posture.shapes, i, j, pairs.gap[k] + moved, moved) and not _table_clears(
        scene, work, k, pairs.gap[k], grown
    )


@inner
def count_hit(scene: MotionScene, work: MotionWorkspace, k: int) -> None:
    """Count that pair k blocks a curve."""
    work.contacts.hits[
        scene.shapes.body[scene.pairs.members[k, 0]], scene.shapes.body[scene.pairs.members[k, 1]]
    ] += 1


@inner
def is_of_groups(scene: MotionScene, k: int) -> bool:
    """Return whether there are pairs below pair k, so that it cannot be in contact itself."""
    pairs = scene.pairs
    return k < len(pairs.below) and pairs.below[k, 0] < pairs.below[k, 1]


@inner
def may_touch_on_piece(
    scene: MotionScene, work: MotionWorkspace, k: int, moved: float, extra: float
) -> bool:
    """Return whether pair k may be closer than its gap, and `extra` [m], on the current piece.

    Its shapes are placed; they move by at most `moved` [m] relative to each other.
    """
    pairs = scene.pairs
    i, j, base = pairs.members[k, 0], pairs.members[k, 1], pairs.members[k, 2]
    shapes, within, of_groups = work.posture.shapes, pairs.gap[k] + extra, is_of_groups(scene, k)
    if moved == 0.0:
        if of_groups:
            return groups_may_touch(shapes, i, j, within)
        near = _may_touch(shapes, i, j, within, moved)
        return near and not _table_clears(scene, work, k, within, False)
    far = within + moved
    if not spheres_overlap(shapes, i, shapes, j, far) or not _sphere_near(shapes, i, j, far):
        return False
    if plane_between(scene, work, i, j, base, within, far, not of_groups):
        return False
    if of_groups:
        return True
    # Boxes may be farther apart than any of these planes tells.
    boxes = shapes[i, TYPE] == BOX and shapes[j, TYPE] == BOX
    near = not boxes or moved > SMALL or closer(shapes, i, shapes, j, far)
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
    shapes = scene.shapes
    first = shapes.body[scene.pairs.members[k, 0]] - shapes.robot
    second = shapes.body[scene.pairs.members[k, 1]] - shapes.robot
    if second < 0:
        return False
    distances = scene.distances
    n = distances.of_bodies[first, second]
    if n < 0:
        return False
    least = distance_bound(distances, n, work.posture.q)
    if grown:
        for m in range(2):
            least -= distances.reach[n, m] * work.piece.delta[distances.joint[n, m]] * GROWN
    return least >= within


@inner
def is_near_on_piece(scene: MotionScene, work: MotionWorkspace, k: int) -> bool:
    """Return whether pair k may touch on the current piece of a curve."""
    pairs = scene.pairs
    i, j, base = pairs.members[k, 0], pairs.members[k, 1], pairs.members[k, 2]
    place_shape(scene, work, i)
    if base > 0:
        place_shape(scene, work, j)
    return may_touch_on_piece(scene, work, k, work.piece.motion[i, base], ROUNDING)


@inner
def groups_may_touch(shapes: FloatArray, i: int, j: int, within: float) -> bool:
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

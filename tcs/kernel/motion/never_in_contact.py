"""Pairs of shapes that the joints between their links never let touch: they are left out.

First, boxes take the place of the shapes beyond the last joint between: they enclose some of these
shapes whatever its angle. The ranges of the one or two joints that remain are divided into parts
until each part is certified. Pairs with two joints between that this does not decide are checked in
the same way by themselves, and so are those whose last joint is prismatic. Pairs with links between
coupled joints stay.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.collide import CENTRE, ROTATION, SIZE, TYPE
from tcs.kernel.motion.box_trees import NONE, boxes_between, extents
from tcs.kernel.motion.contact_bounds import is_near, take_posture
from tcs.kernel.motion.scene import (
    FRAMES,
    MotionScene,
    MotionWorkspace,
    moved_shapes,
    new_motion_workspace,
    shape_pairs,
    with_pairs,
)
from tcs.kernel.views import unowned

CELLS = 1000
"""Greatest number of parts of the ranges of the joints that are checked for a shape and those of a
body: pairs that take more are not left out."""
DIVIDED = 2
"""Greatest number of joints whose ranges are divided."""
MOST_BETWEEN = DIVIDED + 1
"""Number of joints between two shapes up to which their pair is checked."""
IN_BOX = 16
"""Number of shapes that one box encloses at any angle of a joint."""


def with_needed_pairs(scene: MotionScene) -> MotionScene:
    """Return a scene, one without groups, without the pairs that never touch."""
    return with_pairs(scene, needed_pairs(scene, np.ones(len(scene.pairs.members), np.bool_)))


def needed_pairs(scene: MotionScene, checked: BoolArray) -> BoolArray:
    """Return which pairs are needed, shape (n_pairs,): all but those of `checked` that never touch.

    Args:
        scene: A scene without groups.
        checked: Which pairs may be left out, shape (n_pairs,).
    """
    pairs = scene.pairs
    needed = np.ones(len(pairs.members), np.bool_)
    frame, base = scene.shapes.link_frame[pairs.members[:, 0]], pairs.members[:, 2]
    between = frame - base
    checked = checked & (frame < FRAMES) & (base < FRAMES)
    which = np.flatnonzero(checked & (between <= MOST_BETWEEN))
    turned = which[scene.chain.slides[frame[which] - 1] == 0.0]
    if turned.size:
        needed[turned] = _needed_at_any_angle(scene, turned)
    which = which[needed[which] & (between[which] <= DIVIDED)]
    if which.size:
        needed[which] = _needed(with_pairs(scene, which))
    return needed


def _needed(scene: MotionScene) -> BoolArray:
    """Return which pairs, with DIVIDED joints between their shapes at most, are needed."""
    needed = np.zeros(len(scene.pairs.members), np.bool_)
    list_needed(scene, new_motion_workspace(scene), needed)
    return needed


class _Boxes(NamedTuple):
    """Boxes that take the place of shapes of the arm, each on the link before theirs."""

    rows: FloatArray
    """Packed, in the frames of these links, shape (n, 17)."""
    link: IntArray
    """Link of each, shape (n,)."""
    body: IntArray
    """Body of the shapes in each, shape (n,)."""
    of_shape: IntArray
    """Number of the box of each shape of the arm that has one, shape (n_arm,)."""


def _needed_at_any_angle(scene: MotionScene, which: IntArray) -> BoolArray:
    """Return which pairs may touch if the last joint between their shapes has any angle.

    Args:
        scene: A scene without groups.
        which: Numbers of the pairs, shape (n,), which is that of the result.
    """
    shapes = scene.shapes
    count, frame = len(shapes.links), shapes.link_frame
    first, second = scene.pairs.members[which, :2].T
    boxes = _boxes_at_any_angle(scene, np.unique(first))
    added = len(boxes.rows)
    at = boxes.of_shape[first], second
    gap = np.zeros((added, count + len(shapes.fixed)))
    np.maximum.at(gap, at, scene.pairs.gap[which])
    box, other = np.nonzero(gap)
    carrying = np.where(other < count, frame[np.minimum(other, count - 1)], 0)
    # The boxes come after the shapes of the arm.
    pair = np.stack([count + box, other + added * (other >= count), carrying], axis=1)
    links = np.concatenate([shapes.links, boxes.rows])
    of_boxes = scene._replace(
        shapes=shapes._replace(
            links=links,
            link_frame=np.concatenate([frame, boxes.link]),
            body=np.insert(shapes.body, count, boxes.body),
            root=np.arange(len(links)),
        ),
        pairs=shape_pairs(links, shapes.fixed, pair, gap[box, other]),
        # Tables hold at the angle of that joint alone.
        distances=scene.distances._replace(of_bodies=np.full_like(scene.distances.of_bodies, -1)),
    )
    needed = np.zeros(gap.shape, np.bool_)
    needed[box, other] = _needed(of_boxes)
    of_pairs: BoolArray = needed[at]
    return of_pairs


def _boxes_at_any_angle(scene: MotionScene, members: IntArray) -> _Boxes:
    """Return boxes that enclose shapes of the arm, `members`, at any angle of their link's joint.

    They enclose shapes of one body each that are beside each other along the axis of the joint.
    """
    shapes = scene.shapes
    carrier = shapes.link_frame[members] * (shapes.body.max() + 1) + shapes.body[members]
    order = np.lexsort((shapes.links[members, CENTRE + 2], carrier))
    members, carrier = members[order], carrier[order]
    place = np.arange(len(members)) - np.searchsorted(carrier, carrier)
    begin = np.flatnonzero(place % IN_BOX == 0)
    rows, link = _turned_boxes(shapes.links[members], begin), shapes.link_frame[members[begin]] - 1
    for f in np.unique(link):
        rows[link == f] = moved_shapes(rows[link == f], scene.chain.R[f], scene.chain.p[f, :3])
    of_shape = np.full(len(shapes.links), NONE)
    of_shape[members] = np.repeat(np.arange(len(begin)), np.diff(np.append(begin, len(members))))
    return _Boxes(rows, link, shapes.body[members[begin]], of_shape)


def _turned_boxes(rows: FloatArray, begin: IntArray) -> FloatArray:
    """Return boxes that enclose shapes at any angle of the joint of their link, packed.

    Args:
        rows: Shapes, packed, in the frames of their links, which turn about z.
        begin: The first of the shapes in each box, which are consecutive, ascending from 0.
    """
    centre, half = rows[:, CENTRE : CENTRE + 3], extents(rows)
    radius = np.maximum.reduceat(_farthest_from_axis(rows), begin)
    corners = np.empty((len(begin), 6))
    corners[:, :2], corners[:, 3:5] = -radius[:, None], radius[:, None]
    corners[:, 2] = np.minimum.reduceat(centre[:, 2] - half[:, 2], begin)
    corners[:, 5] = np.maximum.reduceat(centre[:, 2] + half[:, 2], begin)
    return boxes_between(corners)


def _farthest_from_axis(rows: FloatArray) -> FloatArray:
    """Return the greatest distance of any point of packed shapes from the z axis [m], (n,)."""
    is_box, is_capsule = rows[:, TYPE] == BOX, rows[:, TYPE] == CAPSULE
    size, R = rows[:, SIZE : SIZE + 3], rows[:, ROTATION:].reshape(-1, 3, 3)
    signs = np.stack(np.meshgrid(*3 * [[-1.0, 1.0]]), axis=-1).reshape(-1, 1, 3)
    # The corners of boxes, and the ends of the segment in a capsule.
    core = np.where(is_box[:, None], size, is_capsule[:, None] * size[:, 1:2] * [0.0, 0.0, 1.0])
    points = rows[:, CENTRE : CENTRE + 3] + np.einsum("nij,snj->sni", R, signs * core)
    away: FloatArray = np.hypot(points[..., 0], points[..., 1]).max(axis=0)
    return away + np.where(is_box, 0.0, size[:, 0])


@jit
def list_needed(owned_scene: MotionScene, owned_work: MotionWorkspace, needed: BoolArray) -> None:
    """Fill which pairs can touch as far as the joints between their shapes decide.

    A pair that is certified over their whole ranges never touches.

    Args:
        owned_scene: The scene; DIVIDED joints are between the shapes of a pair at most.
        owned_work: Scratch.
        needed: Filled, shape (n_pairs,).
    """
    scene, work = unowned(owned_scene), unowned(owned_work)
    pairs = scene.pairs
    for n in range(7):
        work.posture.q[n], work.piece.delta[n] = 0.0, 0.0
    first = 0
    while first < len(pairs.members):
        i, base = pairs.members[first, 0], pairs.members[first, 2]
        body = scene.shapes.body[pairs.members[first, 1]]
        last = first + 1
        while last < len(pairs.members) and _is_of(scene, last, i, base, body):
            last += 1
        if scene.shapes.link_frame[i] == base:
            take_posture(scene, work)
            for k in range(first, last):
                needed[k] = is_near(scene, work, k, False)
        else:
            _find_needed(scene, work, first, last, needed)
        first = last


@inner
def _is_of(scene: MotionScene, k: int, i: int, base: int, body: int) -> bool:
    """Return whether pair k is of shape i and one of a body on link `base`."""
    pair = scene.pairs.members[k]
    return bool(pair[0] == i and pair[2] == base and scene.shapes.body[pair[1]] == body)


@inner
def _find_needed(
    scene: MotionScene, work: MotionWorkspace, begin: int, end: int, needed: BoolArray
) -> None:
    """Fill which of some pairs, of one shape with shapes of one body, are not certified.

    Parts of the ranges of the two joints between the links, or of one, that are not certified for
    all pairs are halved along the joint of the wider one, for those that are left.

    Args:
        scene: The scene.
        work: Scratch.
        begin: First pair.
        end: One after the last pair.
        needed: Filled.
    """
    uncertified, piece = work.uncertified, work.piece
    span, stretch, pairs, top = uncertified.span, uncertified.stretch, uncertified.pairs, 2
    first, second = (
        scene.pairs.members[begin, 2],
        scene.shapes.link_frame[scene.pairs.members[begin, 0]] - 1,
    )
    _take_ranges(scene, work, first, second)
    cells = 0
    for k in range(begin, end):
        pairs[k - begin], needed[k] = k, False
    stretch[0, 0], stretch[0, 1] = 0, end - begin
    while top:
        top -= 2
        for n in range(2):
            # If both are the same joint, the second part is in force.
            joint, low, high = second if n == 1 else first, span[top + n, 0], span[top + n, 1]
            work.posture.q[joint], piece.delta[joint] = 0.5 * (low + high), 0.5 * (high - low)
        take_posture(scene, work)
        cells += 1
        used = to = stretch[top, 1]
        for m in range(stretch[top, 0], used):
            k = pairs[m]
            if needed[k] or not is_near(scene, work, k, True):
                continue
            if cells >= CELLS or top + 4 > len(span) or is_near(scene, work, k, False):
                needed[k] = True
            else:
                pairs[to] = k
                to += 1
        if to > used:
            n = 0 if piece.delta[first] > piece.delta[second] else 1
            for m in range(2):
                span[top + 2 + m, 0], span[top + 2 + m, 1] = span[top + m, 0], span[top + m, 1]
                stretch[top + 2 * m, 0], stretch[top + 2 * m, 1] = used, to
            middle = 0.5 * (span[top + n, 0] + span[top + n, 1])
            span[top + n, 1], span[top + 2 + n, 0] = middle, middle
            top += 4


@inner
def _take_ranges(scene: MotionScene, work: MotionWorkspace, first: int, second: int) -> None:
    """Fill the first two rows of `span` with the whole ranges of two joints; others rest at 0."""
    limits = scene.limits
    for n in range(7):
        work.posture.q[n], work.piece.delta[n] = 0.0, 0.0
    for n in range(2):
        joint = second if n == 1 else first
        low, high = limits.lower[joint], limits.upper[joint]
        if limits.period[joint] > 0.0:
            low, high = -np.pi, np.pi
        work.uncertified.span[n, 0], work.uncertified.span[n, 1] = low, high

"""Boxes around groups of shapes, and the tree of pairs that they make.

A link of many shapes gets a binary tree of boxes in its frame: the root encloses all its shapes,
and two boxes below each box one body and the others, or one half of its shapes each. So do fixed
shapes that never move relative to each other, such as those of the robot's base. The pairs that
are checked always are those of the roots. Below a pair are the two pairs of what is below the
larger one of its boxes with the other one, down to the pairs of shapes: these are the pairs of the
scene without groups, and they alone can be in contact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, BoolArray, FloatArray, IntArray
from tcs.kernel.collide import BOUND, CENTRE, COLUMNS, ROTATION, SIZE, TYPE
from tcs.kernel.motion.scene import NO_PAIR, MotionScene, pair_fields

LEAST = 8
"""Number of shapes of a link up to which they get no boxes: checking each pair takes no longer."""
ENCLOSING = 1e-9
"""Excess of the half sizes of boxes around shapes [m], above rounding errors."""
NONE = -1


class Groups(NamedTuple):
    """Shapes and the boxes around groups of them."""

    rows: FloatArray
    """Shapes, then boxes, packed, in the frames of what carries them, shape (n, 17)."""
    frame: IntArray
    """What carries each, shape (n,): shapes that it carries never move relative to each other."""
    parts: IntArray
    """The two shapes or boxes in each box, NONE for shapes, shape (n, 2)."""
    roots: IntArray
    """Shapes and boxes that are in no other box."""


class _Level(NamedTuple):
    """Pairs at one depth of the tree of pairs."""

    first: IntArray
    """Shape or box of the arm, on the link that is farther from the base, shape (n,)."""
    second: IntArray
    """The other shape or box; those that are fixed come after all of the arm, shape (n,)."""
    split: BoolArray
    """Whether there are two pairs below, shape (n,): two by two, these are the next level."""


def grouped(scene: MotionScene, carrier: IntArray | None = None) -> MotionScene:
    """Return a scene whose pairs are checked by groups; only pairs of shapes can be in contact.

    Args:
        scene: A scene without groups. It is returned unchanged if there are no groups.
        carrier: Number of what carries each fixed shape, NONE for shapes that are not grouped,
            shape (n_fixed,); None to group none. Boxes come after the fixed shapes.
    """
    count, shapes = len(scene.links), len(scene.fixed)
    arm = boxes_around(scene.links, scene.link_frame, scene.body[:count])
    carrier = np.full(shapes, NONE) if carrier is None else carrier
    around = boxes_around(scene.fixed, carrier, scene.body[count:])
    added = len(arm.rows) - count
    if added == 0 and len(around.rows) == shapes:
        return scene
    levels = _levels(arm, around)
    pairs = scene.pair + added * np.array([0, 1, 0]) * (scene.pair[:, 1:2] >= count)
    gaps = _gaps(levels, pairs, scene.gap, (len(arm.rows), len(arm.rows) + len(around.rows)))
    kept = [gap > 0.0 for gap in gaps]
    first = np.concatenate([level.first[keep] for level, keep in zip(levels, kept, strict=True)])
    second = np.concatenate([level.second[keep] for level, keep in zip(levels, kept, strict=True)])
    frame = np.concatenate([arm.frame, np.zeros(len(around.rows), np.int64)])
    fields = pair_fields(
        arm.rows,
        around.rows,
        np.stack([first, second, frame[second]], axis=1),
        np.concatenate([gap[keep] for gap, keep in zip(gaps, kept, strict=True)]),
        _below(levels, kept),
        int(kept[0].sum()),
    )
    bodies = (_bodies(arm, scene.body[:count]), _bodies(around, scene.body[count:]))
    leaf, leaves, root = _leaves(arm)
    leaf_pair = np.full((len(leaf), shapes), NO_PAIR)
    column = np.full(len(arm.rows), len(leaf))
    column[leaf] = np.arange(len(leaf))
    of_leaf = (column[first] < len(leaf)) & (second >= len(arm.rows))
    of_leaf &= second < len(arm.rows) + shapes
    pair = np.flatnonzero(of_leaf)
    leaf_pair[column[first[pair]], second[pair] - len(arm.rows)] = pair
    return scene._replace(
        leaf=np.concatenate(
            [arm.rows[leaf, CENTRE : CENTRE + 3], arm.rows[leaf, BOUND, None]], 1
        ).T.copy(),
        leaves=leaves,
        leaf_shape=leaf,
        root=root,
        leaf_pair=leaf_pair,
        boxes=np.array([count, len(arm.rows) + shapes]),
        links=arm.rows,
        link_frame=arm.frame,
        fixed=around.rows,
        body=np.concatenate(bodies),
        **fields,
    )


def _leaves(groups: Groups) -> tuple[IntArray, IntArray, IntArray]:
    """Return the shapes in boxes that are in no other box, and which of them are in each of those.

    Returns:
        Numbers of the shapes, box by box, shape (n,); the first and one after the last of them for
        each shape or box, equal for those without, shape (n_rows, 2); and the box that each shape
        or box is in, itself for those in none, shape (n_rows,).
    """
    found: list[int] = []
    spans, roots = np.zeros((len(groups.rows), 2), np.int64), np.arange(len(groups.rows))
    for root in groups.roots:
        if groups.parts[root, 0] == NONE:
            continue
        begin, stack = len(found), [int(root)]
        while stack:
            top = stack.pop()
            roots[top] = root
            if groups.parts[top, 0] == NONE:
                found.append(top)
            else:
                stack += groups.parts[top].tolist()
        spans[root] = begin, len(found)
    return np.array(found, np.int64), spans, roots


def _bodies(groups: Groups, body: IntArray) -> IntArray:
    """Return the body of each shape and, for boxes, that of a shape with the same carrier.

    Args:
        groups: Shapes and boxes.
        body: Body of each shape.
    """
    frames = groups.frame[: len(body)]
    of_boxes = [int(np.argmax(frames == f)) for f in groups.frame[len(body) :]]
    return np.concatenate([body, body[np.array(of_boxes, np.int64)]])


def boxes_around(links: FloatArray, link_frame: IntArray, body: IntArray) -> Groups:
    """Return the boxes around groups of the shapes of each link, or other carrier, that has many.

    Args:
        links: Shapes, packed, in link frames, shape (n, 17).
        link_frame: Link of each, shape (n,); NONE for shapes that are not grouped.
        body: Body of each, shape (n,): bodies that are fixed to each other are on one link.
    """
    half = _extents(links)
    low, high = links[:, CENTRE : CENTRE + 3] - half, links[:, CENTRE : CENTRE + 3] + half
    # Least coordinates, and the greatest ones with their signs changed, of shapes and boxes.
    corners = list(np.concatenate([low, -high], axis=1))
    parts: list[tuple[int, ...]] = []
    frames: list[int] = []

    def halves(members: IntArray) -> tuple[IntArray, IntArray]:
        """Return the shapes of one body and the others, or those on either side of the middle."""
        of_first = body[members] == body[members[0]]
        if not np.all(of_first):
            return members[of_first], members[~of_first]
        centres = links[members, CENTRE : CENTRE + 3]
        order = members[
            np.argsort(
                centres[:, np.argmax(centres.max(axis=0) - centres.min(axis=0))], kind="stable"
            )
        ]
        return order[: len(order) // 2], order[len(order) // 2 :]

    def box(members: IntArray, frame: int) -> int:
        """Return the number of a shape, or of a new box around several."""
        if len(members) == 1:
            return int(members[0])
        pair = tuple(box(half, frame) for half in halves(members))
        parts.append(pair)
        corners.append(np.minimum(corners[pair[0]], corners[pair[1]]))
        frames.append(frame)
        return len(links) + len(parts) - 1

    roots: list[int] = []
    for frame in np.unique(link_frame):
        members = np.flatnonzero(link_frame == frame)
        alone = frame == NONE or len(members) <= LEAST
        roots += members.tolist() if alone else [box(members, int(frame))]
    rows = _boxes(np.array(corners[len(links) :]).reshape(-1, 6) * np.repeat([1.0, -1.0], 3))
    shapes = np.full((len(links), 2), NONE)
    return Groups(
        rows=np.concatenate([links, rows]),
        frame=np.concatenate([link_frame, np.array(frames, link_frame.dtype)]),
        parts=np.concatenate([shapes, np.array(parts, np.int64).reshape(-1, 2)]),
        roots=np.array(roots, np.int64),
    )


def _extents(rows: FloatArray) -> FloatArray:
    """Return how far each shape extends from its centre along the axes of its frame, (n, 3)."""
    size, R = rows[:, SIZE : SIZE + 3], np.abs(rows[:, ROTATION:].reshape(-1, 3, 3))
    of_boxes = np.einsum("nij,nj->ni", R, size)
    of_capsules = size[:, :1] + R[:, :, 2] * size[:, 1:2]
    kind = rows[:, TYPE, None]
    return np.where(kind == BOX, of_boxes, np.where(kind == CAPSULE, of_capsules, size[:, :1]))


def _boxes(corners: FloatArray) -> FloatArray:
    """Return boxes between two corners [m], shape (n, 6), as packed shapes."""
    rows = np.zeros((len(corners), COLUMNS))
    half = (corners[:, 3:] - corners[:, :3]) / 2.0 + ENCLOSING
    rows[:, TYPE] = BOX
    rows[:, BOUND] = np.linalg.norm(half, axis=1)
    rows[:, SIZE : SIZE + 3] = half
    rows[:, CENTRE : CENTRE + 3] = (corners[:, :3] + corners[:, 3:]) / 2.0
    rows[:, ROTATION:] = np.eye(3).ravel()
    return rows


def _levels(arm: Groups, around: Groups) -> list[_Level]:
    """Return the tree of all pairs on different links or with fixed shapes, level by level."""
    count = len(arm.rows)
    bound = np.concatenate([arm.rows[:, BOUND], around.rows[:, BOUND]])
    parts = np.concatenate([arm.parts, np.where(around.parts == NONE, NONE, count + around.parts)])
    roots = np.sort(arm.roots)
    others = np.concatenate([count + np.sort(around.roots), roots])
    first, second = (part.ravel() for part in np.meshgrid(roots, others, indexing="ij"))
    frame = np.concatenate([arm.frame, np.zeros(len(around.rows), arm.frame.dtype)])
    apart = frame[first] > frame[second]
    first, second = first[apart], second[apart]
    levels: list[_Level] = []
    while len(first):
        size_first = np.where(parts[first, 0] == NONE, 0.0, bound[first])
        size_second = np.where(parts[second, 0] == NONE, 0.0, bound[second])
        split = np.maximum(size_first, size_second) > 0.0
        levels.append(_Level(first, second, split))
        of_first = (size_first >= size_second)[split, None]
        first, second = first[split, None], second[split, None]
        first, second = (
            np.where(of_first, parts[first[:, 0]], first).ravel(),
            np.where(of_first, second, parts[second[:, 0]]).ravel(),
        )
    return levels


def _gaps(
    levels: list[_Level], pair: IntArray, gap: FloatArray, shape: tuple[int, int]
) -> list[FloatArray]:
    """Return the greatest gap of the pairs of shapes below each pair, 0 if none is checked [m]."""
    of_shapes = np.zeros(shape)
    of_shapes[pair[:, 0], pair[:, 1]] = gap
    found: list[FloatArray] = []
    for level in reversed(levels):
        gaps = of_shapes[level.first, level.second]
        if found:
            gaps[level.split] = found[-1].reshape(-1, 2).max(axis=1)
        found.append(gaps)
    return found[::-1]


def _below(levels: list[_Level], kept: list[BoolArray]) -> IntArray:
    """Return the first and one after the last of the pairs below each pair that is kept."""
    found, begin = [], 0
    next_levels = [*kept[1:], np.zeros(0, np.bool_)]
    for level, keep, next_kept in zip(levels, kept, next_levels, strict=True):
        begin += int(keep.sum())
        ends = np.concatenate([[0], np.cumsum(next_kept)]) + begin
        below = np.zeros((len(keep), 2), np.int64)
        below[level.split, 0], below[level.split, 1] = ends[0:-1:2], ends[2::2]
        found.append(below[keep])
    return np.concatenate(found)

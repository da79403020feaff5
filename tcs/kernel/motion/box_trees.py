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

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray, IntArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.collide import BOUND, CENTRE, COLUMNS, ROTATION, SIZE, TYPE
from tcs.kernel.motion.scene import NO_PAIR, LeafSpheres, MotionScene, depth, shape_pairs

LEAST = 3
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
    """The two shapes or boxes in each box, which come before it, NONE for shapes, shape (n, 2)."""
    roots: IntArray
    """Shapes and boxes that are in no other box."""


def boxes_around(links: FloatArray, link_frame: IntArray, body: IntArray) -> Groups:
    """Return the boxes around groups of the shapes of each link, or other carrier, that has many.

    Args:
        links: Shapes, packed, in link frames, shape (n, 17).
        link_frame: Link of each, shape (n,); NONE for shapes that are not grouped.
        body: Body of each, shape (n,): bodies that are fixed to each other are on one link.
    """
    count = len(links)
    centres = np.ascontiguousarray(links[:, CENTRE : CENTRE + 3])
    half = extents(links)
    roots, parts, frames = [], [np.full((count, 2), NONE)], [link_frame]
    top = count
    for frame in np.unique(link_frame):
        members = np.flatnonzero(link_frame == frame)
        if frame == NONE or len(members) <= LEAST:
            roots += members.tolist()
            continue
        below = np.empty((len(members) - 1, 2), np.int64)
        _divide(members, centres, body, top, below)
        top += len(below)
        roots.append(top - 1)
        parts.append(below)
        frames.append(np.full(len(below), frame, link_frame.dtype))
    parts_of_all = np.concatenate(parts)
    corners = np.empty((top, 6))
    corners[:count, :3], corners[:count, 3:] = centres - half, centres + half
    _enclose(parts_of_all, corners)
    return Groups(
        rows=np.concatenate([links, boxes_between(corners[count:])]),
        frame=np.concatenate(frames),
        parts=parts_of_all,
        roots=np.array(roots, np.int64),
    )


@jit
def _divide(
    members: IntArray, centres: FloatArray, body: IntArray, first: int, parts: IntArray
) -> None:
    """Fill the parts of the boxes around some shapes, each box after its parts.

    Args:
        members: The shapes, two or more; their order changes.
        centres: Centre of every shape [m], shape (n, 3).
        body: Body of every shape, shape (n,).
        first: Number of the first box.
        parts: Filled, shape (len(members) - 1, 2).
    """
    # From the largest box on: its number is the greatest.
    span = np.empty((len(parts), 2), np.int64)
    span[0, 0], span[0, 1] = 0, len(members)
    last, made = first + len(parts) - 1, 1
    for n in range(len(parts)):
        begin, end = span[n, 0], span[n, 1]
        middle = _halve(members, centres, body, begin, end)
        for m in range(2):
            low, high = (begin, middle) if m == 0 else (middle, end)
            if high - low == 1:
                parts[len(parts) - 1 - n, m] = members[low]
                continue
            span[made, 0], span[made, 1] = low, high
            parts[len(parts) - 1 - n, m] = last - made
            made += 1


@inner
def _halve(members: IntArray, centres: FloatArray, body: IntArray, begin: int, end: int) -> int:
    """Order some members so that one group comes first; return where the other one begins.

    These are the shapes of one body and the others, or those on either side of the middle.
    """
    of_first = begin
    for n in range(begin, end):
        i = members[n]
        if body[i] == body[members[begin]]:
            for m in range(n, of_first, -1):
                members[m] = members[m - 1]
            members[of_first] = i
            of_first += 1
    if of_first < end:
        return of_first
    axis, widest = 0, -1.0
    for r in range(3):
        low = high = centres[members[begin], r]
        for n in range(begin, end):
            low, high = min(low, centres[members[n], r]), max(high, centres[members[n], r])
        if high - low > widest:
            axis, widest = r, high - low
    for n in range(begin + 1, end):
        i, m = members[n], n
        while m > begin and centres[members[m - 1], axis] > centres[i, axis]:
            members[m] = members[m - 1]
            m -= 1
        members[m] = i
    return begin + (end - begin) // 2


@jit
def _enclose(parts: IntArray, corners: FloatArray) -> None:
    """Fill least and greatest coordinates of boxes, those of shapes being filled, shape (n, 6)."""
    for n in range(len(parts)):
        if parts[n, 0] != NONE:
            for r in range(3):
                corners[n, r] = min(corners[parts[n, 0], r], corners[parts[n, 1], r])
                corners[n, 3 + r] = max(corners[parts[n, 0], 3 + r], corners[parts[n, 1], 3 + r])


def extents(rows: FloatArray) -> FloatArray:
    """Return how far each shape extends from its centre along the axes of its frame, (n, 3)."""
    size, R = rows[:, SIZE : SIZE + 3], np.abs(rows[:, ROTATION:].reshape(-1, 3, 3))
    of_boxes = np.einsum("nij,nj->ni", R, size)
    of_capsules = size[:, :1] + R[:, :, 2] * size[:, 1:2]
    kind = rows[:, TYPE, None]
    return np.where(kind == BOX, of_boxes, np.where(kind == CAPSULE, of_capsules, size[:, :1]))


def boxes_between(corners: FloatArray) -> FloatArray:
    """Return boxes between two corners [m], shape (n, 6), as packed shapes."""
    rows = np.zeros((len(corners), COLUMNS))
    half = (corners[:, 3:] - corners[:, :3]) / 2.0 + ENCLOSING
    rows[:, TYPE] = BOX
    rows[:, BOUND] = np.linalg.norm(half, axis=1)
    rows[:, SIZE : SIZE + 3] = half
    rows[:, CENTRE : CENTRE + 3] = (corners[:, :3] + corners[:, 3:]) / 2.0
    rows[:, ROTATION:] = np.eye(3).ravel()
    return rows


class PairTree(NamedTuple):
    """Pairs of a shape or box of the arm and another one."""

    first: IntArray
    """Shape or box of the arm, shape (n,)."""
    second: IntArray
    """The other shape or box, shape (n,)."""
    gap: FloatArray
    """Distance that the pair must keep, the greatest one of the pairs of shapes below it [m], shape
    (n,)."""
    below: IntArray
    """First and one after the last of the pairs below each pair, equal if there are none, shape
    (n, 2)."""


def pair_tree(
    first: IntArray, second: IntArray, parts: IntArray, bound: FloatArray, gap: FloatArray
) -> tuple[PairTree, int]:
    """Return the pairs below which a pair of shapes is checked, level by level.

    Below a pair are the two pairs of what is below the larger one of its boxes with the other one.

    Args:
        first: Shape or box of the arm of each pair that is below no other, shape (n_roots,).
        second: The other shape or box of these pairs, shape (n_roots,).
        parts: The two shapes or boxes in each box, which come before it, NONE for shapes; shape
            (n, 2).
        bound: Radius of the bounding sphere of each shape and box [m], shape (n,).
        gap: Distance that each pair of shapes must keep, 0 if it is not checked [m]. Rows and
            columns are shapes; those of boxes, if they come last, may be left out.

    Returns:
        The pairs, and the number of the first ones, those that are below no other.
    """
    shapes = np.empty(len(parts), np.int64)
    _count_shapes(parts, shapes)
    # As many pairs as a binary tree has whose leaves are the pairs of shapes.
    size = 2 * int(np.sum(shapes[first] * shapes[second])) - len(first)
    every = _unfilled(size)
    every.first[: len(first)], every.second[: len(first)] = first, second
    _grow(every, len(first), parts, bound, gap)
    # Preceded by none: the number of pairs kept before each pair.
    kept = np.concatenate([[0], np.cumsum(every.gap > 0.0)])
    tree = _unfilled(int(kept[-1]))
    _keep(every, kept, tree)
    return tree, int(kept[len(first)])


def _unfilled(size: int) -> PairTree:
    """Return a tree of some size, to be filled."""
    return PairTree(
        np.empty(size, np.int64),
        np.empty(size, np.int64),
        np.empty(size),
        np.empty((size, 2), np.int64),
    )


@jit
def _count_shapes(parts: IntArray, shapes: IntArray) -> None:
    """Fill the number of shapes in each box, 1 for shapes."""
    for n in range(len(parts)):
        shapes[n] = 1 if parts[n, 0] == NONE else shapes[parts[n, 0]] + shapes[parts[n, 1]]


@jit
def _grow(tree: PairTree, roots: int, parts: IntArray, bound: FloatArray, gap: FloatArray) -> None:
    """Fill all pairs of a tree, whose first ones are filled, and the gaps of those of shapes."""
    first, second, below = tree.first, tree.second, tree.below
    top = roots
    for n in range(len(first)):
        i, j = first[n], second[n]
        below[n, 0] = below[n, 1] = top
        if parts[i, 0] == NONE and parts[j, 0] == NONE:
            continue
        of_first = parts[j, 0] == NONE or (parts[i, 0] != NONE and bound[i] >= bound[j])
        for m in range(2):
            first[top + m] = parts[i, m] if of_first else i
            second[top + m] = j if of_first else parts[j, m]
        top += 2
        below[n, 1] = top
    for back in range(len(first)):
        n = len(first) - 1 - back
        if below[n, 0] == below[n, 1]:
            tree.gap[n] = gap[first[n], second[n]]
        else:
            tree.gap[n] = max(tree.gap[below[n, 0]], tree.gap[below[n, 0] + 1])


@jit
def _keep(every: PairTree, kept: IntArray, tree: PairTree) -> None:
    """Fill a tree with the pairs whose gap is above 0.

    Args:
        every: All pairs, n.
        kept: Number of pairs kept before each of them, and of all, shape (n + 1,).
        tree: Filled.
    """
    for n in range(len(kept) - 1):
        if kept[n] == kept[n + 1]:
            continue
        to = kept[n]
        tree.first[to], tree.second[to], tree.gap[to] = (
            every.first[n],
            every.second[n],
            every.gap[n],
        )
        for m in range(2):
            tree.below[to, m] = kept[every.below[n, m]]


def grouped(scene: MotionScene, carrier: IntArray | None = None) -> MotionScene:
    """Return a scene whose pairs are checked by groups; only pairs of shapes can be in contact.

    Args:
        scene: A scene without groups. It is returned unchanged if there are no groups.
        carrier: Number of what carries each fixed shape, NONE for shapes that are not grouped,
            shape (n_fixed,); None to group none. Boxes come after the fixed shapes.
    """
    count, shapes = len(scene.shapes.links), len(scene.shapes.fixed)
    arm = boxes_around(scene.shapes.links, scene.shapes.link_frame, scene.shapes.body[:count])
    carrier = np.full(shapes, NONE) if carrier is None else carrier
    around = boxes_around(scene.shapes.fixed, carrier, scene.shapes.body[count:])
    added = len(arm.rows) - count
    if added == 0 and len(around.rows) == shapes:
        return scene
    gap = np.zeros((count, len(arm.rows) + shapes))
    gap[
        scene.pairs.members[:, 0],
        scene.pairs.members[:, 1] + added * (scene.pairs.members[:, 1] >= count),
    ] = scene.pairs.gap
    frame = np.concatenate([arm.frame, np.zeros(len(around.rows), np.int64)])
    tree, roots = _pairs(arm, around, depth(frame, scene.chain.coupled), gap)
    first, second = tree.first, tree.second
    pairs = shape_pairs(
        arm.rows,
        around.rows,
        np.stack([first, second, frame[second]], axis=1),
        tree.gap,
        tree.below,
        roots,
    )
    bodies = (_bodies(arm, scene.shapes.body[:count]), _bodies(around, scene.shapes.body[count:]))
    leaf, leaves, root = _leaves(arm)
    leaf_pair = np.full((len(leaf), shapes), NO_PAIR)
    column = np.full(len(arm.rows), len(leaf))
    column[leaf] = np.arange(len(leaf))
    of_leaf = (column[first] < len(leaf)) & (second >= len(arm.rows))
    of_leaf &= second < len(arm.rows) + shapes
    pair = np.flatnonzero(of_leaf)
    leaf_pair[column[first[pair]], second[pair] - len(arm.rows)] = pair
    spheres = np.concatenate([arm.rows[leaf, CENTRE : CENTRE + 3], arm.rows[leaf, BOUND, None]], 1)
    return scene._replace(
        shapes=scene.shapes._replace(
            links=arm.rows,
            link_frame=arm.frame,
            fixed=around.rows,
            body=np.concatenate(bodies),
            boxes=np.array([count, len(arm.rows) + shapes]),
            root=root,
        ),
        pairs=pairs,
        leaves=LeafSpheres(spheres=spheres.T.copy(), span=leaves, shape=leaf, pair=leaf_pair),
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


def _pairs(arm: Groups, around: Groups, away: FloatArray, gap: FloatArray) -> tuple[PairTree, int]:
    """Return the tree of pairs on different links or with fixed shapes, and how many are its roots.

    Args:
        arm: Shapes and boxes of the arm.
        around: Fixed shapes and boxes, numbered after those of the arm.
        away: Depth of the link of all of them, 0 of those that are fixed.
        gap: As for `pair_tree`.
    """
    count = len(arm.rows)
    bound = np.concatenate([arm.rows[:, BOUND], around.rows[:, BOUND]])
    parts = np.concatenate([arm.parts, np.where(around.parts == NONE, NONE, count + around.parts)])
    others = np.concatenate([count + np.sort(around.roots), np.sort(arm.roots)])
    first, second = (
        part.ravel() for part in np.meshgrid(np.sort(arm.roots), others, indexing="ij")
    )
    apart = away[first] > away[second]
    return pair_tree(first[apart], second[apart], parts, bound, gap)

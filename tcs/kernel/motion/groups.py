"""Boxes around groups of shapes, and the tree of pairs that they make.

A link of many shapes gets a binary tree of boxes in its frame: the root encloses all its shapes,
and two boxes below each box one body and the others, or one half of its shapes each. So do fixed
shapes that never move relative to each other, such as those of the robot's base. The pairs that
are checked always are those of the roots. Below a pair are the two pairs of what is below the
larger one of its boxes with the other one, down to the pairs of shapes: these are the pairs of the
scene without groups, and they alone can be in contact.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.collide import BOUND, CENTRE
from tcs.kernel.motion.box_tree import NONE, Groups, boxes_around
from tcs.kernel.motion.pair_tree import PairTree, pair_tree
from tcs.kernel.motion.scene import NO_PAIR, LeafSpheres, MotionScene, depth, shape_pairs


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

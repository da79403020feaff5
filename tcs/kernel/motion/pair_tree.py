"""The tree of pairs that two trees of boxes make, see `groups`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import jit
from tcs.kernel.motion.box_tree import NONE


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

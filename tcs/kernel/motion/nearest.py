"""The nearest node of a tree: the one from which the arm moves least to a posture.

Each joint counts by how far from its axis the arm reaches. The first blocked steps from a node
count as distance: nodes next to an obstacle, which are the nearest to all that is behind it, leave
the growing to others (compare Yershova, Jaillet, Simeon, LaValle 2005, who limit the domain of such
nodes).
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.motion.scene import MotionScene
from tcs.kernel.motion.trees import CHUNK, Trees

BLOCKED, COUNTED = 0.1, 3
"""What each of the first blocked steps from a node adds to its squared distance, as a fraction, and
how many of them count. Of 25 queries of the PR2 that take more than 15 ms, each with two seeds, the
mean is 130 ms with these, 134 ms where all blocked steps count and 150 ms where none does; in a
scene as narrow everywhere as the benchmark's cage, queries take a seventh less time with these, and
where none counts, than where all do."""


@jit
def place_node(trees: Trees, side: int, n: int) -> None:
    """Place node n of a tree, whose posture and blocked steps are known, among those to search."""
    for k in range(7):
        trees.joint[side, k, n] = trees.q[side, n, k]
    trees.penalty[side, n] = 1.0 + BLOCKED * min(trees.failures[side, n], COUNTED)


@jit
def count_blocked(trees: Trees, side: int, n: int) -> None:
    """Count a blocked step from node n of a tree."""
    trees.failures[side, n] += 1
    place_node(trees, side, n)


@jit
def nearest(scene: MotionScene, trees: Trees, side: int, target: FloatArray) -> int:
    """Return the node of a tree from which the arm moves least to a posture [rad], shape (7,)."""
    square, best, least = trees.square, 0, np.inf
    for first in range(0, trees.nodes[side], CHUNK):
        last = min(first + CHUNK, trees.nodes[side])
        if _any_nearer(scene, trees, side, target, first, last, least):
            for n in range(last - first):
                if square[n] < least:
                    best, least = first + n, square[n]
    return best


@inner
def _any_nearer(
    scene: MotionScene,
    trees: Trees,
    side: int,
    target: FloatArray,
    first: int,
    last: int,
    least: float,
) -> bool:
    """Return whether one of a chunk of nodes is nearer than a squared distance.

    Args:
        scene: The scene.
        trees: `square` is filled with the squared distances of the chunk.
        side: The tree.
        target: The posture [rad], shape (7,).
        first: First node.
        last: One after the last node, CHUNK after the first at most.
        least: The squared distance [rad^2].
    """
    square, penalty = trees.square[: last - first], trees.penalty[side, first:last]
    half = np.float32(0.5)
    for n in range(len(square)):
        square[n] = np.float32(0.0)
    # No branch and no early end: LLVM makes these loops vector loops.
    for k in range(7):
        joint, at = trees.joint[side, k, first:last], np.float32(target[k])
        weight, period = np.float32(scene.chain.weight[k]), np.float32(scene.limits.period[k])
        if period > 0.0:
            for n in range(len(square)):
                angle = joint[n] - at
                angle -= period * np.floor(angle / period + half)
                square[n] += weight * angle * angle
        else:
            for n in range(len(square)):
                angle = joint[n] - at
                square[n] += weight * angle * angle
    nearer = 0
    for n in range(len(square)):
        square[n] *= penalty[n]
        nearer += int(square[n] < least)
    return nearer > 0

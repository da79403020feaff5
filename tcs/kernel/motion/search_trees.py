"""Memory of a query: two trees of postures and the path between them, and random numbers.

Distances of postures are norms of the joints. The nearest node of a tree is the one from which the
arm moves least to a posture: each joint counts by how far from its axis the arm reaches. The first
blocked steps from a node count as distance: nodes next to an obstacle, which are the nearest to all
that is behind it, leave the growing to others (compare Yershova, Jaillet, Simeon, LaValle 2005, who
limit the domain of such nodes). Random numbers are those of SplitMix64 (Steele, Lea, Flood 2014),
one state per query.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.motion.scene import MotionScene

RandomState = NDArray[np.uint64]
"""State of a generator, shape (1,)."""
_STEP, _FIRST, _SECOND = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB
_S11, _S27, _S30, _S31 = (np.uint64(shift) for shift in (11, 27, 30, 31))
MOST_NODES = 20_000
"""Capacity of each tree."""
MOST_POINTS = 1024
"""Capacity of a path."""
NONE = -1
CHUNK = 128
"""Number of nodes whose distances one vector loop computes."""
SAME = 1e-12
"""Greatest distance of two postures that are the same up to rounding of full turns [rad]."""
BLOCKED, COUNTED = 0.1, 3
"""What each of the first blocked steps from a node adds to its squared distance, as a fraction, and
how many of them count. Of 25 queries of the PR2 that take more than 15 ms, each with two seeds, the
mean is 130 ms with these, 134 ms where all blocked steps count and 150 ms where none does; in a
scene as narrow everywhere as the benchmark's cage, queries take a seventh less time with these, and
where none counts, than where all do."""


def random_state(seed: int) -> RandomState:
    """Return the state that a seed starts from."""
    return np.array([seed % 2**64], dtype=np.uint64)


@inner
def uniform(state: RandomState) -> float:
    """Return a random number in [0, 1) and advance the state."""
    state[0] += np.uint64(_STEP)
    z = state[0]
    z = (z ^ (z >> _S30)) * np.uint64(_FIRST)
    z = (z ^ (z >> _S27)) * np.uint64(_SECOND)
    z ^= z >> _S31
    return np.float64(z >> _S11) * (1.0 / 9007199254740992.0)


class Trees(NamedTuple):
    """The two trees of a query, from the starts (0) and from the goals (1), and its path."""

    q: FloatArray
    """Postures [rad], shape (2, MOST_NODES, 7)."""
    joint: NDArray[np.float32]
    """The same, joint by joint, shape (2, 7, MOST_NODES): single precision is enough to compare
    distances, and vector loops take half the time."""
    penalty: NDArray[np.float32]
    """Factor of the squared distance to each node for its blocked steps, shape (2, MOST_NODES)."""
    square: NDArray[np.float32]
    """Scratch: squared distances of a chunk of nodes, shape (CHUNK,)."""
    parent: IntArray
    """Node that each node was extended from, NONE for a root, shape (2, MOST_NODES)."""
    nodes: IntArray
    """Number of nodes, shape (2,)."""
    roots: IntArray
    """Number of these that are roots, shape (2,)."""
    certified: IntArray
    """1 where the edge to a node is certified, shape (2, MOST_NODES)."""
    failures: IntArray
    """Number of blocked steps from each node, shape (2, MOST_NODES)."""
    renumbered: IntArray
    """Scratch: new number of each node, NONE for those removed, shape (MOST_NODES,)."""
    target: FloatArray
    """Posture to grow towards, and next posture [rad], shape (2, 7)."""
    turned: FloatArray
    """End of a shortcut, full turns taken off [rad], shape (7,)."""
    path: FloatArray
    """Postures of the path, from a start to a goal [rad], shape (MOST_POINTS, 7)."""
    spare: FloatArray
    """Scratch to rebuild the path [rad], shape (MOST_POINTS, 7)."""
    ends: IntArray
    """Start and goal that the path connects, shape (2,)."""
    met: IntArray
    """Node of each tree at which they have met, shape (2,)."""
    cut: IntArray
    """Edges of the path on which the two ends of a shortcut are, shape (2,)."""
    blocked: IntArray
    """Posture of the path from which on it is blocked, shape (1,)."""
    random: RandomState
    """State of the random numbers."""


def new_trees(seed: int) -> Trees:
    """Return memory for a query."""
    return Trees(
        q=np.empty((2, MOST_NODES, 7)),
        joint=np.empty((2, 7, MOST_NODES), np.float32),
        penalty=np.empty((2, MOST_NODES), np.float32),
        square=np.empty(CHUNK, np.float32),
        parent=np.empty((2, MOST_NODES), np.int64),
        nodes=np.zeros(2, np.int64),
        roots=np.zeros(2, np.int64),
        certified=np.empty((2, MOST_NODES), np.int64),
        failures=np.zeros((2, MOST_NODES), np.int64),
        renumbered=np.empty(MOST_NODES, np.int64),
        target=np.empty((2, 7)),
        turned=np.empty(7),
        path=np.empty((MOST_POINTS, 7)),
        spare=np.empty((MOST_POINTS, 7)),
        ends=np.zeros(2, np.int64),
        met=np.zeros(2, np.int64),
        cut=np.zeros(2, np.int64),
        blocked=np.zeros(1, np.int64),
        random=random_state(seed),
    )


@inner
def difference(scene: MotionScene, start: float, end: float, k: int) -> float:
    """Return the angle of joint k from one position to another, the short way round [rad]."""
    period = scene.limits.period[k]
    angle = end - start
    if period > 0.0:
        angle -= period * np.floor(angle / period + 0.5)
    return angle


@inner
def unwound(scene: MotionScene, start: float, end: float, k: int) -> float:
    """Return the position of joint k nearest to `start` that equals `end` up to full turns."""
    period = scene.limits.period[k]
    return end - period * np.floor((end - start) / period + 0.5) if period > 0.0 else end


@inner
def edge_length(a: FloatArray, b: FloatArray) -> float:
    """Return the length of a straight edge [rad, norm of the joints]."""
    square = 0.0
    for k in range(7):
        square += (b[k] - a[k]) ** 2
    return np.sqrt(square)


@inner
def distance(scene: MotionScene, a: FloatArray, b: FloatArray) -> float:
    """Return the distance of two postures [rad, norm of the joints]."""
    square = 0.0
    for k in range(7):
        angle = difference(scene, a[k], b[k], k)
        square += angle * angle
    return np.sqrt(square)


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

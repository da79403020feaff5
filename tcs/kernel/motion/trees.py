"""Memory of a query: two trees of postures and the path between them; distances of postures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.motion.random import RandomState, random_state
from tcs.kernel.motion.scene import MotionScene

MOST_NODES = 20_000
"""Capacity of each tree."""
MOST_POINTS = 1024
"""Capacity of a path."""
NONE = -1
CHUNK = 128
"""Number of nodes whose distances one vector loop computes."""
SAME = 1e-12
"""Greatest distance of two postures that are the same up to rounding of full turns [rad]."""


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

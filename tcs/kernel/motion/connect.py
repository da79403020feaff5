"""A path between two sets of postures: RRT-Connect (Kuffner, LaValle 2000) with certified edges.

Edges of the trees are checked at postures only, and those of a path that they make are certified:
where one is not, what has grown beyond it is removed, and the trees grow on (Bohlin, Kavraki 2000).
Two trees grow, from the starts and from the goals. The smaller one takes a step towards a random
posture; the other one is then extended to the new posture until it arrives or is blocked. The
nearest node is the one from which the arm moves least, see `search_trees`. A query that is not
solved soon is a hard one, where paths lead through narrow passages: its trees take several steps,
or half a one, and look for postures with joints at their limits.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.motion.contact_bounds import count_hit
from tcs.kernel.motion.edges import (
    edge_is_certified,
    edge_is_free,
    edge_seems_free,
    posture_is_free,
)
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace
from tcs.kernel.motion.search_trees import (
    MOST_NODES,
    MOST_POINTS,
    NONE,
    SAME,
    Trees,
    count_blocked,
    difference,
    distance,
    nearest,
    place_node,
    uniform,
    unwound,
)
from tcs.kernel.motion.shortcut import cut_corners, drop_postures
from tcs.kernel.views import unowned

STEP = 0.5
"""Longest edge of a tree [rad, norm of the joints]."""
LOCAL = 0.5
"""Fraction of the random postures that are drawn around a node of the tree that grows: next to a
narrow passage few others can be reached from it. With 0.3 and 0.7 hard queries take longer."""
SPREAD = 3.0
"""Greatest scale of these: the standard deviation of each joint is half of it [rad]. The scale is
this times the square of a random number, so that some targets are near enough for a trapped tree.
"""
EASY = 100
"""Iterations after which a query is a hard one: before, what a hard one needs takes a third longer
and makes paths longer by 6 % on MotionBenchMaker's problems, most of which are solved by then."""
BEYOND = 0.3
"""In hard queries, how far beyond its limits a joint is drawn before it is set to them, as a
fraction of its range. The PR2's ways past a person in a chair lead along a limit of its shoulder,
where uniform postures never are. With 0.1, 0.6 and 1 hard queries take longer."""
GREEDY = 8
"""In hard queries, the number of steps towards a random posture. Six that are solved in one of two
tries with a single step are solved in nine of ten with 5 or 20."""
DIRECT = 4
"""Pairs of start and goal, the nearest ones, that are connected directly if possible."""


@jit
def connect(
    owned_scene: MotionScene,
    owned_work: MotionWorkspace,
    owned_trees: Trees,
    starts: FloatArray,
    goals: FloatArray,
    iterations: int,
    shortcuts: int,
) -> int:
    """Find a path of certified edges from one of the starts to one of the goals.

    Args:
        owned_scene: The scene.
        owned_work: Scratch; `contacts.hits` counts which bodies blocked an edge.
        owned_trees: Holds the random state; `path` and `ends` are filled. Joints without limits
            may end full turns away from the goal.
        starts: Postures at which nothing touches [rad], shape (n, 7).
        goals: Postures at which nothing touches [rad], shape (m, 7).
        iterations: Greatest number of random postures to grow towards.
        shortcuts: Number of random shortcuts to try; with 0 the path is not shortened.

    Returns:
        Number of postures of the path, 0 if none was found.
    """
    scene, work, trees = unowned(owned_scene), unowned(owned_work), unowned(owned_trees)
    _plant(trees, 0, starts)
    _plant(trees, 1, goals)
    if len(starts) == 0 or len(goals) == 0:
        return 0
    if _connect_directly(scene, work, trees, len(starts), len(goals)):
        return _path(scene, trees, trees.ends[0], trees.ends[1])
    used = 0
    while used < iterations:
        used = _grow_until_met(scene, work, trees, used, iterations)
        if trees.met[0] == NONE:
            return 0
        count = _certified_path(scene, work, trees, shortcuts)
        if count > 0:
            return count
    return 0


@inner
def _certified_path(scene: MotionScene, work: MotionWorkspace, trees: Trees, shortcuts: int) -> int:
    """Fill the path over the nodes that have met, `trees.met`, with certified edges.

    With shortcuts, postures are dropped first, so that few edges have to be certified.

    Returns:
        Number of postures of the path; 0 if an edge is blocked, which is then removed.
    """
    first, second = trees.met[0], trees.met[1]
    if shortcuts > 0:
        count = _path(scene, trees, first, second)
        if count > 0:
            count = drop_postures(scene, work, trees, count)
            if count == 0:
                _remove_blocked(trees, first)
        return cut_corners(scene, work, trees, count, shortcuts)
    if not (
        _branch_is_certified(scene, work, trees, 0, first)
        and _branch_is_certified(scene, work, trees, 1, second)
    ):
        return 0
    return _path(scene, trees, first, second)


@inner
def _grow_until_met(
    scene: MotionScene, work: MotionWorkspace, trees: Trees, first: int, last: int
) -> int:
    """Grow both trees until they meet, at the nodes `trees.met`; NONE if they do not.

    Args:
        scene: The scene.
        work: Scratch.
        trees: The trees.
        first: Number of iterations that the query has used before.
        last: How many it may use.

    Returns:
        Number of iterations used.
    """
    target, following = trees.target[0], trees.target[1]
    for n in range(first, last):
        grown = trees.nodes[0] - trees.roots[0], trees.nodes[1] - trees.roots[1]
        side = 0 if grown[0] <= grown[1] else 1
        is_hard = n >= EASY
        _draw_target(scene, trees, side, BEYOND if is_hard else 0.0)
        if max(trees.nodes[0], trees.nodes[1]) >= MOST_NODES:
            break
        near = nearest(scene, trees, side, target)
        new = _extend(scene, work, trees, side, near, target, GREEDY if is_hard else 1, is_hard)
        if new == near:
            continue
        for k in range(7):
            following[k] = trees.q[side, new, k]
        other = 1 - side
        near = nearest(scene, trees, other, following)
        met = _extend(scene, work, trees, other, near, following, MOST_NODES, is_hard)
        if distance(scene, trees.q[other, met], following) <= SAME:
            trees.met[side], trees.met[other] = new, met
            return n + 1
    trees.met[0] = trees.met[1] = NONE
    return last


@inner
def _draw_target(scene: MotionScene, trees: Trees, side: int, beyond: float) -> None:
    """Fill the posture to grow towards: a random one, or one around a random node of the tree.

    Args:
        scene: The scene.
        trees: Their `target` is filled.
        side: The tree.
        beyond: How far beyond its limits a joint is drawn, as a fraction of its range.
    """
    limits = scene.limits
    target, q = trees.target[0], trees.q[side]
    local = uniform(trees.random) < LOCAL
    root = uniform(trees.random)
    scale = SPREAD * root * root
    n = int(uniform(trees.random) * trees.nodes[side])
    for k in range(7):
        low, high = limits.lower[k], limits.upper[k]
        if limits.period[k] > 0.0:
            low, high = -np.pi, np.pi
        first = uniform(trees.random)
        target[k] = low + (high - low) * (first * (1.0 + 2.0 * beyond) - beyond)
        if local:
            # The sum of three is close to normal, with a standard deviation of 0.5.
            about = first + uniform(trees.random) + uniform(trees.random) - 1.5
            target[k] = q[n, k] + scale * about
        if limits.period[k] == 0.0:
            target[k] = min(max(target[k], low), high)


@inner
def _plant(trees: Trees, side: int, roots: FloatArray) -> None:
    """Make the postures the roots of a tree, as many as it holds."""
    count = min(len(roots), MOST_NODES - 1)
    for n in range(count):
        trees.parent[side, n], trees.failures[side, n] = NONE, 0
        for k in range(7):
            trees.q[side, n, k] = roots[n, k]
        place_node(trees, side, n)
    trees.nodes[side], trees.roots[side] = count, count


@inner
def _connect_directly(
    scene: MotionScene, work: MotionWorkspace, trees: Trees, starts: int, goals: int
) -> bool:
    """Try one edge between each of the nearest pairs of start and goal; fills `ends`."""
    least, end = -1.0, trees.target[1]
    for _ in range(DIRECT):
        nearest = np.inf
        for i in range(starts):
            for j in range(goals):
                d = distance(scene, trees.q[0, i], trees.q[1, j])
                if least < d < nearest:
                    nearest, trees.ends[0], trees.ends[1] = d, i, j
        if nearest == np.inf:
            return False
        start, goal = trees.q[0, trees.ends[0]], trees.q[1, trees.ends[1]]
        for k in range(7):
            end[k] = unwound(scene, start[k], goal[k], k)
        if edge_is_free(scene, work, start, end):
            return True
        least = nearest
    return False


@inner
def _extend(
    scene: MotionScene,
    work: MotionWorkspace,
    trees: Trees,
    side: int,
    n: int,
    target: FloatArray,
    steps: int,
    halved: bool,
) -> int:
    """Extend node n of a tree towards a posture until it arrives or is blocked.

    Args:
        scene: The scene.
        work: Scratch.
        trees: The trees.
        side: The tree.
        n: The node.
        target: The posture [rad], shape (7,).
        steps: Greatest number of steps.
        halved: Whether half a step is tried where a whole one is blocked.

    Returns:
        The last new node, n if there is none.
    """
    for _ in range(steps):
        if trees.nodes[side] >= MOST_NODES or distance(scene, trees.q[side, n], target) <= SAME:
            break
        new = _grow(scene, work, trees, side, n, target, 1.0)
        if new == NONE and halved:
            new = _grow(scene, work, trees, side, n, target, 0.5)
        if new == NONE:
            break
        n = new
    return n


@inner
def _grow(
    scene: MotionScene,
    work: MotionWorkspace,
    trees: Trees,
    side: int,
    n: int,
    target: FloatArray,
    part: float,
) -> int:
    """Extend node n of a tree towards a posture by a part of a step.

    A step leads to the posture, or by STEP towards it.

    Returns:
        The new node, or NONE if the edge is not free. At the posture itself, the new node equals
        it, up to full turns.
    """
    new, q = trees.nodes[side], trees.q[side]
    d = distance(scene, q[n], target)
    fraction = part if d <= STEP else part * STEP / d
    for k in range(7):
        angle = difference(scene, q[n, k], target[k], k)
        reached = fraction == 1.0 and scene.limits.period[k] == 0.0
        q[new, k] = target[k] if reached else q[n, k] + fraction * angle
    if not posture_is_free(scene, work, q[new]):
        count_hit(scene, work, work.contacts.pair[0])
        count_blocked(trees, side, n)
        return NONE
    if not edge_seems_free(scene, work, q[n], q[new]):
        count_blocked(trees, side, n)
        return NONE
    trees.parent[side, new], trees.certified[side, new] = n, 0
    trees.failures[side, new] = 0
    place_node(trees, side, new)
    trees.nodes[side] += 1
    return new


@inner
def _branch_is_certified(
    scene: MotionScene, work: MotionWorkspace, trees: Trees, side: int, n: int
) -> bool:
    """Certify the edges from a node of a tree to its root; remove what is beyond a blocked one."""
    q, parent = trees.q[side], trees.parent[side]
    while parent[n] != NONE:
        before = parent[n]
        if trees.certified[side, n] == 0:
            if not edge_is_certified(scene, work, q[before], q[n]):
                _remove(trees, side, n)
                return False
            trees.certified[side, n] = 1
        n = before
    return True


@inner
def _remove_blocked(trees: Trees, first: int) -> None:
    """Remove the node beyond the blocked edge of the path, and all that has grown from it.

    Args:
        trees: `blocked` is the posture from which on the path over the nodes `met` is blocked.
        first: The node of the first tree.
    """
    depth, n = 0, first
    while n != NONE:
        depth, n = depth + 1, trees.parent[0, n]
    # The nodes of the first tree are the first postures of the path, from its root on.
    beyond = trees.blocked[0] + 1
    side = 0 if beyond < depth else 1
    steps = depth - 1 - beyond if side == 0 else beyond - depth
    n = trees.met[side]
    for _ in range(steps):
        n = trees.parent[side, n]
    _remove(trees, side, n)


@inner
def _remove(trees: Trees, side: int, n: int) -> None:
    """Remove a node from a tree, with all that has grown from it."""
    q, parent, certified = trees.q[side], trees.parent[side], trees.certified[side]
    failures, renumbered, kept = trees.failures[side], trees.renumbered, 0
    for m in range(trees.nodes[side]):
        before = parent[m]
        if m == n or (before != NONE and renumbered[before] == NONE):
            renumbered[m] = NONE
            continue
        renumbered[m] = kept
        parent[kept] = NONE if before == NONE else renumbered[before]
        certified[kept], failures[kept] = certified[m], failures[m]
        for k in range(7):
            q[kept, k] = q[m, k]
        place_node(trees, side, kept)
        kept += 1
    trees.nodes[side] = kept


@inner
def _path(scene: MotionScene, trees: Trees, first: int, second: int) -> int:
    """Fill the path from the start over two nodes that meet to the goal; return its length."""
    depth, n = 0, first
    while n != NONE:
        depth, n = depth + 1, trees.parent[0, n]
    at, n = depth, first
    while n != NONE:
        at -= 1
        trees.ends[0] = n
        if at < MOST_POINTS:
            for k in range(7):
                trees.path[at, k] = trees.q[0, n, k]
        n = trees.parent[0, n]
    count, n = depth, second
    # The two nodes are the same posture, unless they were connected directly.
    if distance(scene, trees.q[0, first], trees.q[1, second]) <= SAME:
        n = trees.parent[1, second]
        trees.ends[1] = second
    while n != NONE:
        trees.ends[1] = n
        if count < MOST_POINTS:
            for k in range(7):
                trees.path[count, k] = trees.q[1, n, k]
        count, n = count + 1, trees.parent[1, n]
    if count > MOST_POINTS:
        return 0
    for n in range(1, count):
        for k in range(7):
            trees.path[n, k] = unwound(scene, trees.path[n - 1, k], trees.path[n, k], k)
    return count

"""Shortcuts of a path: straight certified edges in place of detours."""

from __future__ import annotations

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.motion.edges import edge_is_certified, edge_seems_free
from tcs.kernel.motion.random import uniform
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace
from tcs.kernel.motion.trees import MOST_POINTS, Trees, distance, edge_length, unwound
from tcs.kernel.views import unowned

LEAST_GAIN = 0.01
"""Fraction of the length between two points of a path that a shortcut must save."""


@jit
def shorten(
    owned_scene: MotionScene,
    owned_work: MotionWorkspace,
    owned_trees: Trees,
    count: int,
    attempts: int,
) -> int:
    """Shorten `path` in place, see `cut_corners`; returns the number of its postures."""
    scene, work, trees = unowned(owned_scene), unowned(owned_work), unowned(owned_trees)
    count = drop_postures(scene, work, trees, count, True)
    return cut_corners(scene, work, trees, count, attempts, True)


@inner
def cut_corners(
    scene: MotionScene,
    work: MotionWorkspace,
    trees: Trees,
    count: int,
    attempts: int,
    certify: bool,
) -> int:
    """Shorten `path` in place; its ends stay up to full turns.

    Args:
        scene: The scene.
        work: Scratch.
        trees: Holds path and random state.
        count: Number of postures of the path.
        attempts: Number of random shortcuts to try; postures are dropped after them.
        certify: Whether new edges are certified, or only checked at postures.

    Returns:
        Number of postures of the shorter path.
    """
    for _ in range(attempts):
        if count < 3 or count + 2 > MOST_POINTS:
            break
        count = _cut(scene, work, trees, count, certify)
    return drop_postures(scene, work, trees, count, certify) if attempts > 0 else count


@inner
def path_is_certified(scene: MotionScene, work: MotionWorkspace, trees: Trees, count: int) -> bool:
    """Return whether all edges of `path` are certified; `count` is the number of its postures."""
    path = trees.path
    for n in range(count - 1):
        if not edge_is_certified(scene, work, path[n], path[n + 1]):
            return False
    return True


@inner
def _edge_is_free(
    scene: MotionScene,
    work: MotionWorkspace,
    trees: Trees,
    start: FloatArray,
    end: FloatArray,
    certify: bool,
) -> bool:
    """Return whether the edge to a posture, the short way round, is free; fills `trees.turned`.

    Without `certify` it is checked at postures only.
    """
    for k in range(7):
        trees.turned[k] = unwound(scene, start[k], end[k], k)
    return edge_seems_free(scene, work, start, trees.turned) and (
        not certify or edge_is_certified(scene, work, start, trees.turned)
    )


@inner
def _turn(path: FloatArray, first: int, count: int, before: FloatArray, after: FloatArray) -> None:
    """Add the full turns from one position of the joints to another to the rest of the path."""
    for k in range(7):
        turns = after[k] - before[k]
        if turns != 0.0:
            for n in range(first, count):
                path[n, k] += turns


@inner
def drop_postures(
    scene: MotionScene, work: MotionWorkspace, trees: Trees, count: int, certify: bool
) -> int:
    """Drop postures between which an edge is free, long runs first; return how many stay.

    The end of a run is found by halving: where an edge is blocked, longer ones seldom are free.

    Args:
        scene: The scene.
        work: Scratch.
        trees: Holds the path.
        count: Number of postures of the path.
        certify: Whether new edges are certified, or only checked at postures.
    """
    path, begin = trees.path, 0
    while begin < count - 2:
        end, blocked, trial = begin + 1, count, count - 1
        while trial > end:
            if _edge_is_free(scene, work, trees, path[begin], path[trial], certify):
                end = trial
            else:
                blocked = trial
            trial = (end + blocked) // 2
        dropped = end - begin - 1
        if dropped > 0:
            for k in range(7):
                trees.turned[k] = unwound(scene, path[begin, k], path[end, k], k)
            _turn(path, end + 1, count, path[end], trees.turned)
            for k in range(7):
                path[end, k] = trees.turned[k]
        for n in range(end, count):
            for k in range(7):
                path[n - dropped, k] = path[n, k]
        count -= dropped
        begin += 1
    return count


@inner
def _cut(scene: MotionScene, work: MotionWorkspace, trees: Trees, count: int, certify: bool) -> int:
    """Try one shortcut between two random points of the path; return the number of postures."""
    path, ends, spare = trees.path, trees.target, trees.spare
    total = 0.0
    for n in range(count - 1):
        total += edge_length(path[n], path[n + 1])
    first, second = uniform(trees.random) * total, uniform(trees.random) * total
    early, late = min(first, second), max(first, second)
    m, n = _take_point(path, count, early, ends[0]), _take_point(path, count, late, ends[1])
    if m == n or distance(scene, ends[0], ends[1]) > (1.0 - LEAST_GAIN) * (late - early):
        return count
    if not _edge_is_free(scene, work, trees, ends[0], ends[1], certify):
        return count
    _turn(path, n + 1, count, ends[1], trees.turned)
    kept = count - (n + 1)
    for i in range(kept):
        for k in range(7):
            spare[i, k] = path[n + 1 + i, k]
    for k in range(7):
        path[m + 1, k], path[m + 2, k] = ends[0, k], trees.turned[k]
    for i in range(kept):
        for k in range(7):
            path[m + 3 + i, k] = spare[i, k]
    return m + 3 + kept


@inner
def _take_point(path: FloatArray, count: int, along: float, point: FloatArray) -> int:
    """Fill the point at a distance along the path [rad]; return the number of its edge."""
    n = 0
    length = edge_length(path[0], path[1])
    while along > length and n < count - 2:
        along -= length
        n += 1
        length = edge_length(path[n], path[n + 1])
    fraction = min(along / length, 1.0) if length > 0.0 else 0.0
    for k in range(7):
        point[k] = path[n, k] + fraction * (path[n + 1, k] - path[n, k])
    return n

"""Shortcuts of a path: straight certified edges in place of detours."""

from __future__ import annotations

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.motion.edges import edge_is_certified, edge_seems_free
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace
from tcs.kernel.motion.search_trees import (
    MOST_POINTS,
    Trees,
    distance,
    edge_length,
    uniform,
    unwound,
)
from tcs.kernel.views import unowned

LEAST_GAIN = 0.05
"""Fraction of the length between two points of a path that a shortcut must save: to certify those
that save less takes a tenth of the time of a query, and makes paths 0.5 % shorter."""
MOST_BLOCKED = 2
"""Number of shortcuts that are blocked, one after the other, after which no more are tried."""


@jit
def shorten(
    owned_scene: MotionScene,
    owned_work: MotionWorkspace,
    owned_trees: Trees,
    count: int,
    attempts: int,
) -> int:
    """Shorten `path`, whose edges are certified, in place; returns the number of its postures."""
    scene, work, trees = unowned(owned_scene), unowned(owned_work), unowned(owned_trees)
    count = drop_postures(scene, work, trees, count)
    return cut_corners(scene, work, trees, count, attempts)


@inner
def cut_corners(
    scene: MotionScene, work: MotionWorkspace, trees: Trees, count: int, attempts: int
) -> int:
    """Shorten `path`, whose edges are certified, in place; its ends stay up to full turns.

    Args:
        scene: The scene.
        work: Scratch.
        trees: Holds path and random state.
        count: Number of postures of the path.
        attempts: Number of random shortcuts to try.

    Returns:
        Number of postures of the shorter path, whose edges are certified too.
    """
    blocked = 0
    for _ in range(attempts):
        if count < 3 or count + 2 > MOST_POINTS or blocked == MOST_BLOCKED:
            break
        if not _draw_shortcut(scene, trees, count):
            continue
        if _edge_is_free(scene, work, trees, trees.target[0], trees.target[1]):
            count, blocked = _cut(trees, count), 0
        else:
            blocked += 1
    return count


@inner
def _edge_is_free(
    scene: MotionScene, work: MotionWorkspace, trees: Trees, start: FloatArray, end: FloatArray
) -> bool:
    """Return whether the edge to a posture, the short way round, is certified.

    Fills `trees.turned`, its end, and checks it at some postures first.
    """
    return _edge_seems_free(scene, work, trees, start, end) and edge_is_certified(
        scene, work, start, trees.turned
    )


@inner
def _edge_seems_free(
    scene: MotionScene, work: MotionWorkspace, trees: Trees, start: FloatArray, end: FloatArray
) -> bool:
    """Return whether nothing touches at postures of the edge to another, the short way round.

    Fills `trees.turned`, its end.
    """
    for k in range(7):
        trees.turned[k] = unwound(scene, start[k], end[k], k)
    return edge_seems_free(scene, work, start, trees.turned)


@inner
def _turn(path: FloatArray, first: int, count: int, before: FloatArray, after: FloatArray) -> None:
    """Add the full turns from one position of the joints to another to the rest of the path."""
    for k in range(7):
        turns = after[k] - before[k]
        if turns != 0.0:
            for n in range(first, count):
                path[n, k] += turns


@inner
def drop_postures(scene: MotionScene, work: MotionWorkspace, trees: Trees, count: int) -> int:
    """Drop postures of `path` between which an edge is certified, long runs first.

    The end of a run is found by halving: where an edge is blocked, longer ones seldom are free.
    Edges are certified only where they stay.

    Args:
        scene: The scene.
        work: Scratch.
        trees: Holds the path.
        count: Number of postures of the path.

    Returns:
        Number of postures that stay, all edges between them certified; 0 if one of the path's own
        edges is blocked, that from posture `trees.blocked` on.
    """
    path, begin, gone = trees.path, 0, 0
    while begin < count - 1:
        end, blocked, trial = begin + 1, count, count - 1
        while trial > end:
            if _edge_seems_free(scene, work, trees, path[begin], path[trial]):
                end = trial
            else:
                blocked = trial
            trial = (end + blocked) // 2
        while end > begin + 1 and not _edge_is_certified(
            scene, work, trees, path[begin], path[end]
        ):
            end = begin + (end - begin + 1) // 2
        dropped = end - begin - 1
        if dropped > 0:
            _turn(path, end + 1, count, path[end], trees.turned)
            for k in range(7):
                path[end, k] = trees.turned[k]
            for n in range(end, count):
                for k in range(7):
                    path[n - dropped, k] = path[n, k]
            count -= dropped
        elif not edge_is_certified(scene, work, path[begin], path[begin + 1]):
            trees.blocked[0] = begin + gone
            return 0
        begin, gone = begin + 1, gone + dropped
    return count


@inner
def _edge_is_certified(
    scene: MotionScene, work: MotionWorkspace, trees: Trees, start: FloatArray, end: FloatArray
) -> bool:
    """Return whether the edge to a posture, the short way round, is certified; fills `turned`."""
    for k in range(7):
        trees.turned[k] = unwound(scene, start[k], end[k], k)
    return edge_is_certified(scene, work, start, trees.turned)


@inner
def _draw_shortcut(scene: MotionScene, trees: Trees, count: int) -> bool:
    """Draw two points of the path; return whether the edge between them would be much shorter.

    Args:
        scene: The scene.
        trees: Holds path and random state; `target` is filled with the points, `cut` with the
            numbers of their edges.
        count: Number of postures of the path.
    """
    path, ends, cut = trees.path, trees.target, trees.cut
    total = 0.0
    for n in range(count - 1):
        total += edge_length(path[n], path[n + 1])
    first, second = uniform(trees.random) * total, uniform(trees.random) * total
    early, late = min(first, second), max(first, second)
    cut[0] = _take_point(path, count, early, ends[0])
    cut[1] = _take_point(path, count, late, ends[1])
    direct = distance(scene, ends[0], ends[1])
    return cut[0] != cut[1] and direct <= (1.0 - LEAST_GAIN) * (late - early)


@inner
def _cut(trees: Trees, count: int) -> int:
    """Take the edge between the two points drawn last, which ends at `turned`, into the path.

    Returns:
        Number of postures of the path.
    """
    path, ends, spare, m, n = trees.path, trees.target, trees.spare, trees.cut[0], trees.cut[1]
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

"""Pairs of shapes that the joints between their links never let touch: they are left out."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BoolArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.motion.pairs import is_near, take_posture
from tcs.kernel.motion.scene import (
    MotionScene,
    MotionWorkspace,
    new_motion_workspace,
    with_pairs,
)
from tcs.kernel.views import unowned

CELLS = 1000
"""Greatest number of parts of the ranges of the joints that are checked for a shape and those of a
link: pairs that take more are not left out."""
MOST_BETWEEN = 2
"""Number of joints between two shapes up to which their pair is checked."""


def without_idle_pairs(scene: MotionScene) -> MotionScene:
    """Return a scene, one without groups, without the pairs that never touch."""
    return with_pairs(scene, needed_pairs(scene, np.ones(len(scene.pair), np.bool_)))


def needed_pairs(scene: MotionScene, checked: BoolArray) -> BoolArray:
    """Return which pairs are needed, shape (n_pairs,): all but idle ones of those `checked`.

    Args:
        scene: A scene without groups.
        checked: Which pairs may be left out, shape (n_pairs,).
    """
    needed = np.empty(len(scene.pair), np.bool_)
    list_needed(scene, new_motion_workspace(scene), checked, needed)
    return needed


@jit
def list_needed(
    owned_scene: MotionScene, owned_work: MotionWorkspace, checked: BoolArray, needed: BoolArray
) -> None:
    """Fill which pairs can touch as far as the joints between their shapes decide.

    If there are one or two, a pair that is certified over their whole ranges never touches.

    Args:
        owned_scene: The scene.
        owned_work: Scratch.
        checked: Which pairs to check; the others are needed; shape (n_pairs,).
        needed: Filled, shape (n_pairs,).
    """
    scene, work = unowned(owned_scene), unowned(owned_work)
    first = 0
    while first < len(scene.pair):
        i, base = scene.pair[first, 0], scene.pair[first, 2]
        last = first + 1
        while last < len(scene.pair) and scene.pair[last, 0] == i and scene.pair[last, 2] == base:
            last += 1
        is_decided = scene.link_frame[i] - base <= MOST_BETWEEN
        for k in range(first, last):
            needed[k] = not is_decided or not checked[k]
        if is_decided:
            _find_needed(scene, work, first, last, needed)
        first = last


@inner
def _find_needed(
    scene: MotionScene, work: MotionWorkspace, begin: int, end: int, needed: BoolArray
) -> None:
    """Fill which of some pairs, of one shape with shapes of one link, are not certified.

    Parts of the ranges of the two joints between the links, or of one, that are not certified for
    all pairs are halved along the joint of the wider one, for those that are left.

    Args:
        scene: The scene.
        work: Scratch.
        begin: First pair.
        end: One after the last pair.
        needed: Filled where it is False.
    """
    span, stretch, pairs, top = work.span, work.stretch, work.pairs, 2
    first, second = scene.pair[begin, 2], scene.link_frame[scene.pair[begin, 0]] - 1
    _take_ranges(scene, work, first, second)
    count = cells = 0
    for k in range(begin, end):
        if not needed[k]:
            pairs[count] = k
            count += 1
    stretch[0, 0], stretch[0, 1] = 0, count
    while top:
        top -= 2
        cells += 1
        for n in range(2):
            # If both are the same joint, the second part is in force.
            joint, low, high = second if n == 1 else first, span[top + n, 0], span[top + n, 1]
            work.q[joint], work.delta[joint] = 0.5 * (low + high), 0.5 * (high - low)
        take_posture(scene, work)
        used = to = stretch[top, 1]
        for m in range(stretch[top, 0], used):
            k = pairs[m]
            if needed[k] or not is_near(scene, work, k, True):
                continue
            if cells >= CELLS or top + 4 > len(span) or is_near(scene, work, k, False):
                needed[k] = True
            else:
                pairs[to] = k
                to += 1
        if to > used:
            n = 0 if work.delta[first] > work.delta[second] else 1
            for m in range(2):
                span[top + 2 + m, 0], span[top + 2 + m, 1] = span[top + m, 0], span[top + m, 1]
                stretch[top + 2 * m, 0], stretch[top + 2 * m, 1] = used, to
            middle = 0.5 * (span[top + n, 0] + span[top + n, 1])
            span[top + n, 1], span[top + 2 + n, 0] = middle, middle
            top += 4


@inner
def _take_ranges(scene: MotionScene, work: MotionWorkspace, first: int, second: int) -> None:
    """Fill the first two rows of `span` with the whole ranges of two joints; others rest at 0."""
    for n in range(7):
        work.q[n], work.delta[n] = 0.0, 0.0
    for n in range(2):
        joint = second if n == 1 else first
        low, high = scene.lower[joint], scene.upper[joint]
        if scene.period[joint] > 0.0:
            low, high = -np.pi, np.pi
        work.span[n, 0], work.span[n, 1] = low, high

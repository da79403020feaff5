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

CELLS = 300
"""Greatest number of parts of the ranges of the joints that are checked for a pair: one that takes
more is not left out."""
MOST_BETWEEN = 2
"""Number of joints between two shapes up to which their pair is checked."""


def without_idle_pairs(scene: MotionScene) -> MotionScene:
    """Return a scene, one without groups, without the pairs that never touch."""
    needed = np.ones(len(scene.pair), np.bool_)
    list_needed(scene, new_motion_workspace(scene), needed)
    return with_pairs(scene, needed)


def needed_pairs(scene: MotionScene, robot: int) -> BoolArray:
    """Return which pairs are needed, shape (n_pairs,): all but idle ones of the robot's own shapes.

    Args:
        scene: A scene without groups.
        robot: Number of the first body of the robot in `scene.body`.
    """
    own = scene.body[scene.pair[:, 1]] >= robot
    among = with_pairs(scene, own)
    needed = np.ones(len(among.pair), np.bool_)
    list_needed(among, new_motion_workspace(among), needed)
    every = np.ones(len(scene.pair), np.bool_)
    every[own] = needed
    return every


@jit
def list_needed(owned_scene: MotionScene, owned_work: MotionWorkspace, needed: BoolArray) -> None:
    """Fill which pairs can touch as far as the joints between their shapes decide.

    If there are one or two, a pair that is certified over their whole ranges never touches.

    Args:
        owned_scene: The scene.
        owned_work: Scratch.
        needed: Filled, shape (n_pairs,).
    """
    scene, work = unowned(owned_scene), unowned(owned_work)
    for k in range(len(scene.pair)):
        link, base = scene.link_frame[scene.pair[k, 0]], scene.pair[k, 2]
        needed[k] = True
        if link - base <= MOST_BETWEEN:
            needed[k] = not _never_touches(scene, work, k, base, link - 1)


@inner
def _never_touches(
    scene: MotionScene, work: MotionWorkspace, k: int, first: int, second: int
) -> bool:
    """Return whether a pair is certified over the whole ranges of two joints, or of one.

    Parts of the ranges that are not certified are halved along the joint of the wider one.
    """
    span, top = work.span, 2
    for n in range(7):
        work.q[n], work.delta[n] = 0.0, 0.0
    for n in range(2):
        joint = second if n == 1 else first
        low, high = scene.lower[joint], scene.upper[joint]
        if scene.period[joint] > 0.0:
            low, high = -np.pi, np.pi
        span[n, 0], span[n, 1] = low, high
    for _ in range(CELLS):
        top -= 2
        for n in range(2):
            joint, low, high = second if n == 1 else first, span[top + n, 0], span[top + n, 1]
            work.q[joint], work.delta[joint] = 0.5 * (low + high), 0.5 * (high - low)
        take_posture(scene, work)
        if is_near(scene, work, k, True):
            if top + 4 > len(span) or is_near(scene, work, k, False):
                return False
            # If both are the same joint, the second part is in force.
            n = 0 if work.delta[first] > work.delta[second] else 1
            for m in range(2):
                span[top + 2 + m, 0], span[top + 2 + m, 1] = span[top + m, 0], span[top + m, 1]
            middle = 0.5 * (span[top + n, 0] + span[top + n, 1])
            span[top + n, 1], span[top + 2 + n, 0] = middle, middle
            top += 4
        if top == 0:
            return True
    return False

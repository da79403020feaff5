"""A plain planner to judge the compiled one: RRT-Connect on lists, edges sampled densely.

It shares no code with `tcs.kernel.motion`; whether a posture touches is for the caller to say.
"""

from __future__ import annotations

import numpy as np

STEP = 0.6
"""Longest edge [rad, norm of the joints]."""
SAMPLE = 0.04
"""Greatest distance of two postures that are checked on an edge [rad]."""


def plain_path(touches, low, high, start, goal, seed, tries=150):
    """Return a path between two postures, a list of joint angles, None if none is found.

    Args:
        touches: Whether something touches at joint angles.
        low: Lower ends of the ranges that random postures are drawn from [rad], shape (7,).
        high: Upper ends [rad], shape (7,).
        start: First posture [rad], shape (7,).
        goal: Last posture [rad], shape (7,).
        seed: Seed of the random postures.
        tries: Number of random postures.
    """
    rng = np.random.default_rng(seed)
    # A tree is a list of postures, each with the number of the one that it was extended from.
    trees = [[(start, None)], [(goal, None)]]
    for n in range(tries):
        growing, waiting = trees[n % 2], trees[1 - n % 2]
        # The goal itself is drawn first.
        target = goal if n == 0 else rng.uniform(low, high)
        if not extend(growing, target, touches):
            continue
        new = growing[-1][0]
        while extend(waiting, new, touches):
            if np.array_equal(waiting[-1][0], new):
                first, second = branch(trees[0]), branch(trees[1])
                return first[::-1] + second[1:]
    return None


def extend(tree, target, touches):
    """Extend a tree from its nearest posture towards another; return whether it could be."""
    n = min(range(len(tree)), key=lambda m: np.linalg.norm(target - tree[m][0]))
    q = tree[n][0]
    length = np.linalg.norm(target - q)
    if length == 0.0:
        return False
    end = target if length <= STEP else q + (target - q) * STEP / length
    parts = max(1, int(np.ceil(np.linalg.norm(end - q) / SAMPLE)))
    if any(touches(q + (end - q) * k / parts) for k in range(1, parts + 1)):
        return False
    tree.append((end, n))
    return True


def branch(tree):
    """Return the postures from the last one of a tree back to its root."""
    found, n = [], len(tree) - 1
    while n is not None:
        found.append(tree[n][0])
        n = tree[n][1]
    return found

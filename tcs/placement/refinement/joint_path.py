"""Continuous joint paths through tool poses, one branch of the inverse kinematics followed."""

from __future__ import annotations

import itertools

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.motion.edges import certified
from tcs.kernel.motion.postures import postures_at
from tcs.kernel.motion.scene import goal_from_arm_base, motion_scene, new_motion_workspace
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows

SAMPLES = 48
"""Values of the free joint at each pose."""
MOST_POSTURES = 200
"""Postures at each pose that paths are searched among."""
LONGEST_STEP = 2.0
"""Greatest motion of a joint from one pose to the next [rad]; more is another branch."""
ATTEMPTS = 40
"""Paths that are tried, each without the postures and steps that blocked those before."""


def joint_path(problem: Problem, row: Rows, through: FloatArray | None = None) -> FloatArray | None:
    """Return a joint path through all goals of a problem in their order, None if none is found.

    Of all sequences of postures, one at each goal, the one with the least sum of squared steps is
    taken; each step, straight in joint space, is certified free of contact.

    Args:
        problem: The scene.
        row: The initial configuration.
        through: Further posture at each goal [rad], shape (G, 7), e.g. the best ones of scoring.

    Returns:
        Joint angles [rad], shape (G, 7); continuous joints are not wrapped.
    """
    layers = _layers(problem, row, through)
    if any(not len(layer) for layer in layers):
        return None
    motion = motion_scene(problem, row)
    work = new_motion_workspace(motion)
    periodic = motion.period > 0.0
    costs = [_costs(a, b, periodic) for a, b in itertools.pairwise(layers)]
    for _ in range(ATTEMPTS):
        rows = _cheapest(costs)
        if rows is None:
            return None
        path = _unwrapped(np.array([q[i] for q, i in zip(layers, rows, strict=True)]), periodic)
        blocked = [
            k
            for k in range(max(len(path) - 1, 1))
            if certified(motion, work, _edge(path[k], path[min(k + 1, len(path) - 1)])) < 1.0
        ]
        if not blocked:
            return path
        if not costs:
            return None
        for k in blocked:
            costs[k][rows[k], rows[k + 1]] = np.inf
            for side in (k, k + 1):
                if certified(motion, work, _edge(path[side], path[side])) < 1.0:
                    _forbid(costs, side, rows[side])
    return None


def _layers(problem: Problem, row: Rows, through: FloatArray | None) -> list[FloatArray]:
    """Return postures at each goal, shapes (n, 7)."""
    layers = []
    for g in range(problem.goals.number):
        found = postures_at(problem, *goal_from_arm_base(problem, row, g), SAMPLES)
        found = found[:: max(1, -(-len(found) // MOST_POSTURES))]
        if through is not None:
            found = np.concatenate([found, through[g : g + 1]])
        layers.append(found)
    return layers


def _costs(a: FloatArray, b: FloatArray, periodic: BoolArray) -> FloatArray:
    """Return the squared steps between postures, infinite for steps that are too long."""
    step = b[None] - a[:, None]
    step = np.where(periodic, np.mod(step + np.pi, 2.0 * np.pi) - np.pi, step)
    cost = np.sum(step**2, axis=2)
    cost[np.abs(step).max(axis=2) > LONGEST_STEP] = np.inf
    return np.asarray(cost)


def _cheapest(costs: list[FloatArray]) -> list[int] | None:
    """Return the row in each layer of the cheapest path; None if all are blocked."""
    if not costs:
        return [0]
    total = np.zeros(len(costs[0]))
    before = []
    for cost in costs:
        sums = total[:, None] + cost
        before.append(np.argmin(sums, axis=0))
        total = np.min(sums, axis=0)
    if not np.isfinite(total.min()):
        return None
    rows = [int(np.argmin(total))]
    for back in reversed(before):
        rows.append(int(back[rows[-1]]))
    return rows[::-1]


def _forbid(costs: list[FloatArray], layer: int, row: int) -> None:
    """Block a posture that is in contact."""
    if layer > 0:
        costs[layer - 1][:, row] = np.inf
    if layer < len(costs):
        costs[layer][row] = np.inf


def _unwrapped(path: FloatArray, periodic: BoolArray) -> FloatArray:
    """Return a path whose continuous joints take the shorter way round at each step."""
    return np.where(periodic, np.unwrap(path, axis=0), path)


def _edge(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the control points of a straight step, shape (4, 7)."""
    return np.linspace(a, b, 4)

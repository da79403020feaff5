"""Paths between postures, with rounded corners, certified free of contact."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.motion.connect import connect
from tcs.kernel.motion.edges import certified
from tcs.kernel.motion.scene import ChainLimits, MotionScene, MotionWorkspace
from tcs.motion.curves import Curve
from tcs.motion.stops import Stop

ITERATIONS = 40_000
"""Greatest number of random postures that the planner grows towards. Of 1,390 ways from rest to a
goal of the PR2's shaving in the wheelchair that were found at all, three are not found each time
with half of these, and one with all."""
SHORTCUTS = 20
"""Greatest number of random shortcuts that are tried, as long as not too many are blocked."""
WIDEST_CORNER = 0.3
"""Greatest length of an edge that a rounded corner takes up [rad, norm of the joints]."""
LIMIT_ROUNDING = 1e-10
"""How far control points of a curve may be beyond joint limits, as sums round [rad]."""
NARROWEST_CORNER = 0.005
"""Length below which a corner is not rounded: the arm stops there."""


def find_path(
    stop: Stop,
    starts: FloatArray,
    goals: FloatArray,
    *,
    iterations: int = ITERATIONS,
    turns: bool = True,
) -> tuple[FloatArray, int] | None:
    """Return a path from one of several postures to one of several others, None if none is found.

    Args:
        stop: The initial configuration; its random state advances.
        starts: Joint angles at which nothing touches [rad], shape (n, 7).
        goals: Joint angles at which nothing touches [rad], shape (m, 7).
        iterations: Greatest number of random postures to grow towards.
        turns: Whether joints without limits may end full turns away from the goal.

    Returns:
        Postures of the path [rad], shape (k, 7), with certified straight edges, and the number of
        the goal.
    """
    motion = stop.motion
    if not turns:
        # As joints with limits that are half a turn beyond the postures.
        ends, turning = np.concatenate([starts, goals]), motion.limits.period > 0.0
        lower = np.where(turning, ends.min(axis=0) - np.pi, motion.limits.lower)
        upper = np.where(turning, ends.max(axis=0) + np.pi, motion.limits.upper)
        limits = ChainLimits(lower, upper, period=np.zeros(7))
        motion = motion._replace(limits=limits)
    count = connect(motion, stop.work, stop.trees, starts, goals, iterations, SHORTCUTS)
    return (stop.trees.path[:count].copy(), int(stop.trees.ends[1])) if count else None


def rounded(stop: Stop, path: FloatArray, widest: float = WIDEST_CORNER) -> list[Curve]:
    """Return a path as curves without corners; the arm stops between curves.

    Each corner becomes a parabola that touches both edges, as wide as is certified.

    Args:
        stop: The initial configuration.
        path: Postures with certified straight edges [rad], shape (n, 7).
        widest: Greatest length of an edge that a corner takes up [rad, norm of the joints]; 0
            leaves the edges straight.
    """
    lengths = np.linalg.norm(np.diff(path, axis=0), axis=1)
    path = path[np.concatenate([[True], lengths > 1e-9])]
    lengths = lengths[lengths > 1e-9]
    curves: list[Curve] = []
    if len(path) < 2:
        return curves
    directions = np.diff(path, axis=0) / lengths[:, None]
    knots, q, dq = [0.0], [path[0]], [directions[0]]
    for n in range(1, len(path) - 1):
        most = min(widest, 0.45 * float(np.min(lengths[n - 1 : n + 1])))
        wide = _corner(stop, path[n], directions[n - 1 : n + 1], most)
        here = float(np.sum(lengths[:n]))
        knots.append(here - wide)
        q.append(path[n] - wide * directions[n - 1])
        dq.append(directions[n - 1])
        if wide == 0.0:
            curves.append(_curve(knots, q, dq))
            knots, q, dq = [], [], []
        knots.append(here + wide)
        q.append(path[n] + wide * directions[n])
        dq.append(directions[n])
    knots.append(float(np.sum(lengths)))
    q.append(path[-1])
    dq.append(directions[-1])
    curves.append(_curve(knots, q, dq))
    return curves


def is_certified(motion: MotionScene, work: MotionWorkspace, curve: Curve) -> bool:
    """Return whether every piece of a curve is certified free of contact, within joint limits.

    Args:
        motion: The scene.
        work: Scratch.
        curve: The curve.
    """
    for piece in range(curve.pieces):
        control = curve.control_points(piece)
        beyond = (
            np.maximum(motion.limits.lower - control, control - motion.limits.upper)
            > LIMIT_ROUNDING
        )
        if np.any(beyond & (motion.limits.period == 0.0)) or certified(motion, work, control) < 1.0:
            return False
    return True


def _corner(stop: Stop, corner: FloatArray, directions: FloatArray, wide: float) -> float:
    """Return how far from a corner its rounding may begin [rad], 0 if none is certified.

    Args:
        stop: The initial configuration.
        corner: The posture [rad], shape (7,).
        directions: Unit directions of the edges before and after it, shape (2, 7).
        wide: How far it may begin at most [rad].
    """
    while wide > NARROWEST_CORNER:
        begin, end = corner - wide * directions[0], corner + wide * directions[1]
        third = 2.0 / 3.0
        control = np.array(
            [begin, begin + third * (corner - begin), end + third * (corner - end), end]
        )
        if certified(stop.motion, stop.work, control) == 1.0:
            return wide
        wide /= 2.0
    return 0.0


def _curve(knots: list[float], q: list[FloatArray], dq: list[FloatArray]) -> Curve:
    """Return the spline through points with given directions; its parameter begins at 0."""
    at = np.array(knots) - knots[0]
    kept = np.concatenate([[True], np.diff(at) > 1e-12])
    return Curve(at[kept], np.array(q)[kept], np.array(dq)[kept])

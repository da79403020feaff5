"""The joint motion along a path of the free joint, as a certified spline."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.analytic.ik import sample_joints, wrist_goal
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.approach.grid import PIECES, LineGrid
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.contacts import Workspace
from tcs.kernel.motion.edges import curve_is_free_until
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace
from tcs.kernel.motion.straight import (
    OFF_LINE,
    StraightWorkspace,
    error_between,
    evaluate_on_line,
    keep_within_limits,
    new_straight_workspace,
    take_piece,
    take_pieces,
)
from tcs.kernel.numeric.newton import factorise, step_to_goal

FIRST = int_constant(0)
FEWEST, DOUBLINGS = 2, 3
"""Number of pieces of the spline tried first, and how often it is doubled until the spline is close
enough to the line."""
AT_POINT = 1e-7
"""Greatest error of a point of the spline [rad and m], as for solutions."""


class CurveWorkspace(NamedTuple):
    """A spline and its scratch."""

    points: FloatArray
    """Joint angles at equal distances of the tool, from the goal on [rad], shape (n, 7)."""
    tangents: FloatArray
    """Derivatives of the joints by the fraction of the line [rad], shape (n, 7)."""
    line: StraightWorkspace
    """The line, and kinematics at one posture."""
    goal: FloatArray
    """A pose on the line as from `wrist_goal`, shape (4, 3)."""
    blocked: IntArray
    """Level of the grid at or after which it is blocked, seen from the goal, and the pair; shape
    (2,)."""
    pieces: IntArray
    """Number of pieces of the spline, shape (1,)."""


def new_curve() -> CurveWorkspace:
    """Return memory for one worker."""
    most = FEWEST * 2**DOUBLINGS + 1
    return CurveWorkspace(
        np.empty((most, 7)),
        np.empty((most, 7)),
        new_straight_workspace(),
        np.empty((4, 3)),
        np.zeros(2, np.int64),
        np.zeros(1, np.int64),
    )


@inner
def place_line(work: Workspace, curve: CurveWorkspace) -> None:
    """Let the line begin at the current goal."""
    for r in range(3):
        curve.line.p_AT[r] = work.p_AG[r]
        for c in range(3):
            curve.line.R_AT[r, c] = work.R_AG[r, c]
    for k in range(7):
        curve.line.locked[k] = 0


@inner
def fill_spline(
    arm: ArmSolver,
    scene: MotionScene,
    motion: MotionWorkspace,
    grid: LineGrid,
    curve: CurveWorkspace,
    b: int,
    offset: FloatArray,
    fastest: FloatArray,
) -> bool:
    """Follow the line from the goal along `grid.path` on branch b.

    Args:
        arm: The arm.
        scene: The scene.
        motion: Scratch.
        grid: `path` is the free joint at each level.
        curve: The line is in place; the spline is filled.
        b: The branch.
        offset: Motion of the tool along the line, in A [m], shape (3,).
        fastest: Greatest motion of each joint for the whole line at constant rate [rad], shape
            (7,).

    Returns:
        Whether the joints keep their limits.
    """
    pieces = FEWEST
    for _ in range(DOUBLINGS + 1):
        points, tangents = curve.points[: pieces + 1], curve.tangents[: pieces + 1]
        if not _fill_points(arm, scene, grid, curve, b, offset, fastest, points, tangents):
            return False
        keep_within_limits(scene, points, tangents)
        worst = 0.0
        for n in range(pieces):
            take_piece(motion, points, tangents, n)
            error = error_between(scene, motion, curve.line, offset, (n + 0.5) / pieces)
            worst = max(worst, error)
        curve.pieces[0] = pieces
        if worst <= OFF_LINE:
            return True
        pieces *= 2
    return False


@inner
def spline_is_free(scene: MotionScene, motion: MotionWorkspace, curve: CurveWorkspace) -> bool:
    """Return whether the spline is certified; fills `curve.blocked` if it is not.

    Args:
        scene: The shapes around the arm are in place.
        motion: So are they here.
        curve: Holds the spline.
    """
    pieces = curve.pieces[0]
    points, tangents = curve.points[: pieces + 1], curve.tangents[: pieces + 1]
    take_pieces(motion, points, tangents, FIRST, pieces)
    if curve_is_free_until(scene, motion) == 1.0:
        return True
    curve.blocked[0] = min(int(np.ceil(motion.met[0] * PIECES)), PIECES)
    curve.blocked[1] = motion.contact[0]
    return False


@inner
def _fill_points(
    arm: ArmSolver,
    scene: MotionScene,
    grid: LineGrid,
    curve: CurveWorkspace,
    b: int,
    offset: FloatArray,
    fastest: FloatArray,
    points: FloatArray,
    tangents: FloatArray,
) -> bool:
    """Fill points and tangents of the spline; return whether the joints keep their limits."""
    line, pieces = curve.line, len(points) - 1
    p_AT = grid.p_AT
    for n in range(pieces + 1):
        fraction, q = n / pieces, points[n]
        for r in range(3):
            line.target[r] = p_AT[r] = line.p_AT[r] + fraction * offset[r]
        wrist_goal(arm, line.R_AT, p_AT, curve.goal)
        angle, rate = _path_at(grid.path, fraction)
        sample_joints(arm, curve.goal, arm.branches[b], angle, q)
        if n > 0:
            for k in range(7):
                if scene.period[k] > 0.0:
                    turns = np.floor((q[k] - points[n - 1, k]) / scene.period[k] + 0.5)
                    q[k] -= turns * scene.period[k]
                if abs(q[k] - points[n - 1, k]) * pieces > fastest[k]:
                    return False
        if evaluate_on_line(scene, line, q) > AT_POINT:
            return False
        newton, tangent = line.newton, tangents[n]
        for r in range(6):
            along = offset[r - 3] if r >= 3 else 0.0
            newton.error[r] = along - newton.J[r, arm.free] * rate
            newton.J[r, arm.free] = 0.0
        factorise(newton, 0.0)
        for k in range(7):
            tangent[k] = rate if k == arm.free else 0.0
        if not np.isfinite(step_to_goal(newton, tangent, np.inf)):
            return False
        for k in range(7):
            if abs(tangent[k]) > fastest[k]:
                return False
    return True


@inner
def _path_at(path: FloatArray, fraction: float) -> tuple[float, float]:
    """Return the free joint at a fraction of the line [rad], and its derivative by the fraction.

    Between levels it follows cubics, with the mean rate of the two pieces at a level.
    """
    at = fraction * PIECES
    n = min(int(at), PIECES - 1)
    t, before, after = at - n, max(n - 1, 0), min(n + 2, PIECES)
    step = path[n + 1] - path[n]
    rate = (path[n + 1] - path[before]) / (n + 1 - before)
    end_rate = (path[after] - path[n]) / (after - n)
    c, d = 3.0 * step - 2.0 * rate - end_rate, rate + end_rate - 2.0 * step
    angle = path[n] + t * (rate + t * (c + t * d))
    return angle, PIECES * (rate + t * (2.0 * c + 3.0 * t * d))

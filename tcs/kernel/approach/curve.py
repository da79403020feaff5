"""The joint motion along a path of the free joint, as a certified spline."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.analytic.ik import wrist_goal
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.approach.grid import PIECES, LineGrid
from tcs.kernel.approach.turns import place_sample
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.motion.contact_bounds import is_near, take_turned_posture
from tcs.kernel.motion.edges import curve_is_free
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace
from tcs.kernel.motion.straight import (
    OFF_LINE,
    StraightWorkspace,
    error_between,
    evaluate_on_line,
    keep_within_limits,
    new_straight_workspace,
    release_joints,
    take_piece,
    take_pieces,
)
from tcs.kernel.motion.tool_line import take_line
from tcs.kernel.numeric.newton import factorise, step_to_goal
from tcs.kernel.workspace import Workspace

FIRST = int_constant(0)
FEWEST, MOST = 2, 16
"""Number of pieces of the spline tried first, and the greatest one: it is doubled until the spline
is close enough to the line."""
FAR_OFF = 16.0
"""Error of a spline, as a multiple of what is allowed, above which its pieces are divided by four:
errors fall with the fourth power of their length."""
PROBES = 8
"""Number of contacts on lines that are kept, see `path_touches`."""
AT_POINT = 1e-7
"""Greatest error of a point of the spline [rad and m], as for solutions."""


class CurveWorkspace(NamedTuple):
    """A spline and its scratch."""

    points: FloatArray
    """Joint angles at equal distances of the tool, from the goal on [rad], shape (n, 7)."""
    tangents: FloatArray
    """Derivatives of the joints by the fraction of the line [rad], shape (n, 7), within what limits
    allow."""
    slopes: FloatArray
    """These derivatives as they are, shape (n, 7)."""
    ahead: FloatArray
    """Scratch: where joints move at their rates from one point to the next [rad], shape (7,)."""
    line: StraightWorkspace
    """The line, and kinematics at one posture."""
    goal: FloatArray
    """A pose on the line as from `wrist_goal`, shape (4, 3)."""
    blocked: IntArray
    """Level of the grid at or after which it is blocked, seen from the goal, and the pair; shape
    (2,)."""
    pieces: IntArray
    """Number of pieces of the spline, shape (1,)."""
    probe: FloatArray
    """Fractions of the line at which earlier lines to the same goal were blocked, shape
    (PROBES,)."""
    probe_pair: IntArray
    """The pair that blocked each, shape (PROBES,)."""
    probes: IntArray
    """Number of all lines that were blocked; the last PROBES are kept; shape (1,)."""


def new_curve() -> CurveWorkspace:
    """Return memory for one worker."""
    return CurveWorkspace(
        np.empty((MOST + 1, 7)),
        np.empty((MOST + 1, 7)),
        np.empty((MOST + 1, 7)),
        np.empty(7),
        new_straight_workspace(),
        np.empty((4, 3)),
        np.zeros(2, np.int64),
        np.zeros(1, np.int64),
        np.zeros(PROBES),
        np.zeros(PROBES, np.int64),
        np.zeros(1, np.int64),
    )


@inner
def place_line(scene: MotionScene, work: Workspace, curve: CurveWorkspace) -> None:
    """Let the line begin at the current goal."""
    curve.probes[0] = 0
    for r in range(3):
        curve.line.p_AT[r] = work.p_AG[r]
        for c in range(3):
            curve.line.R_AT[r, c] = work.R_AG[r, c]
    release_joints(scene, curve.line)


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
    pieces, known = FEWEST, 0
    while True:
        if not _fill_points(arm, scene, grid, curve, b, offset, fastest, pieces, known):
            return False
        error = finish_spline(scene, motion, curve, offset, pieces)
        if error <= OFF_LINE:
            return True
        if pieces == MOST:
            return False
        known = 4 if error > FAR_OFF * OFF_LINE and 4 * pieces <= MOST else 2
        pieces *= known
        _spread_points(curve, pieces, known)


@inner
def finish_spline(
    scene: MotionScene,
    motion: MotionWorkspace,
    curve: CurveWorkspace,
    offset: FloatArray,
    pieces: int,
) -> float:
    """Make a spline of its points and slopes; return its greatest error [rad and m].

    Above OFF_LINE, it is that of the first piece that is too far from the line.

    Args:
        scene: The scene.
        motion: The spline is the line that its tool follows, unless it is too far from that.
        curve: `points` and `slopes` are filled; so is the rest.
        offset: Motion of the tool along the line, in A [m], shape (3,).
        pieces: Number of pieces.
    """
    points, tangents = curve.points[: pieces + 1], curve.tangents[: pieces + 1]
    for n in range(pieces + 1):
        for k in range(7):
            tangents[n, k] = curve.slopes[n, k]
    keep_within_limits(scene, points, tangents)
    curve.pieces[0] = pieces
    worst = off = turned = 0.0
    for n in range(pieces):
        take_piece(motion, points, tangents, n)
        error = error_between(scene, motion, curve.line, offset, (n + 0.5) / pieces)
        if error > OFF_LINE:
            return error
        at_middle = curve.line.newton.error
        worst = max(worst, error)
        turned = max(turned, _length(at_middle[:3]))
        off = max(off, _length(at_middle[3:]))
    slopes = curve.slopes[: pieces + 1]
    take_line(scene, motion, offset, points, tangents, slopes, off, turned)
    return worst


@inner
def _length(vector: FloatArray) -> float:
    """Return the length of a vector, shape (3,)."""
    return np.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])


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
    if curve_is_free(scene, motion, True):
        return True
    curve.blocked[0] = _level_after(motion.contacts.met[0])
    curve.blocked[1] = motion.contacts.pair[0]
    n = curve.probes[0] % PROBES
    curve.probe[n], curve.probe_pair[n] = motion.contacts.met[0], motion.contacts.pair[0]
    curve.probes[0] += 1
    return False


@inner
def path_touches(
    arm: ArmSolver,
    scene: MotionScene,
    motion: MotionWorkspace,
    grid: LineGrid,
    curve: CurveWorkspace,
    b: int,
    offset: FloatArray,
) -> bool:
    """Return whether the line along `grid.path` is blocked where another one was.

    Of the postures of the line, only those are looked at where earlier lines to the same goal were
    blocked, and only the pairs that blocked them.

    Args:
        arm: The arm.
        scene: The scene.
        motion: The shapes around the arm are in place.
        grid: `path` is the free joint at each level.
        curve: The line is in place; `blocked` is filled if it is blocked.
        b: The branch.
        offset: Motion of the tool along the line, in A [m], shape (3,).
    """
    last = curve.probes[0]
    for back in range(min(last, PROBES)):
        n = (last - 1 - back) % PROBES
        fraction, k = curve.probe[n], curve.probe_pair[n]
        for r in range(3):
            grid.p_AT[r] = curve.line.p_AT[r] + fraction * offset[r]
        wrist_goal(arm, curve.line.R_AT, grid.p_AT, curve.goal)
        angle, _ = _path_at(grid, fraction)
        place_sample(
            arm, curve.goal, arm.branches[b], angle, motion.posture.q, motion.posture.turns
        )
        take_turned_posture(scene, motion)
        if is_near(scene, motion, k, False):
            curve.blocked[0], curve.blocked[1] = _level_after(fraction), k
            return True
    return False


@inner
def _level_after(fraction: float) -> int:
    """Return the level of the grid at or after a fraction of the line."""
    return min(int(np.ceil(fraction * PIECES)), PIECES)


@inner
def _spread_points(curve: CurveWorkspace, pieces: int, factor: int) -> None:
    """Move the points of a spline, of fewer pieces by a factor, to where they are among more."""
    for back in range(pieces // factor + 1):
        n = pieces // factor - back
        for k in range(7):
            curve.points[factor * n, k] = curve.points[n, k]
            curve.slopes[factor * n, k] = curve.slopes[n, k]


@inner
def _fill_points(
    arm: ArmSolver,
    scene: MotionScene,
    grid: LineGrid,
    curve: CurveWorkspace,
    b: int,
    offset: FloatArray,
    fastest: FloatArray,
    pieces: int,
    known: int,
) -> bool:
    """Fill points and slopes of a spline; return whether the joints keep their limits.

    Args:
        arm: The arm.
        scene: The scene.
        grid: `path` is the free joint at each level.
        curve: The line is in place.
        b: The branch.
        offset: Motion of the tool along the line, in A [m], shape (3,).
        fastest: As for `fill_spline`.
        pieces: Number of pieces.
        known: Every how many points one is filled already; 0 if none is.
    """
    line, points = curve.line, curve.points
    p_AT = grid.p_AT
    for n in range(pieces + 1):
        fraction, q = n / pieces, points[n]
        if known > 0 and n % known == 0:
            if n > 0 and is_too_fast(points, n, pieces, fastest):
                return False
            continue
        for r in range(3):
            line.target[r] = p_AT[r] = line.p_AT[r] + fraction * offset[r]
        wrist_goal(arm, line.R_AT, p_AT, curve.goal)
        angle, rate = _path_at(grid, fraction)
        place_sample(arm, curve.goal, arm.branches[b], angle, q, line.turns)
        if n > 0:
            for k in range(7):
                if scene.limits.period[k] > 0.0:
                    turns = np.floor((q[k] - points[n - 1, k]) / scene.limits.period[k] + 0.5)
                    q[k] -= turns * scene.limits.period[k]
            if is_too_fast(points, n, pieces, fastest):
                return False
        if evaluate_on_line(scene, line, q) > AT_POINT:
            return False
        newton, tangent = line.newton, curve.slopes[n]
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
def is_too_fast(points: FloatArray, n: int, pieces: int, fastest: FloatArray) -> bool:
    """Return whether a joint moves too fast from the point before point n to that."""
    for k in range(7):
        if abs(points[n, k] - points[n - 1, k]) * pieces > fastest[k]:
            return True
    return False


@inner
def _path_at(grid: LineGrid, fraction: float) -> tuple[float, float]:
    """Return the free joint at a fraction of the line [rad], and its derivative by the fraction.

    Between levels it follows cubics.
    """
    path, at = grid.path, fraction * PIECES
    n = min(int(at), PIECES - 1)
    t, step = at - n, path[n + 1] - path[n]
    rate, end_rate = _rate_at(grid, n), _rate_at(grid, n + 1)
    c, d = 3.0 * step - 2.0 * rate - end_rate, rate + end_rate - 2.0 * step
    angle = path[n] + t * (rate + t * (c + t * d))
    return angle, PIECES * (rate + t * (2.0 * c + 3.0 * t * d))


@inner
def _rate_at(grid: LineGrid, level: int) -> float:
    """Return the rate of the free joint at a level, per piece between levels [rad].

    It is the mean rate of the two pieces; at an end that of one, or of the parabola through three
    levels.
    """
    path = grid.path
    before, after = max(level - 1, 0), min(level + 1, PIECES)
    rate = (path[after] - path[before]) / (after - before)
    if grid.is_bent[0] and level == 0:
        rate += 0.5 * (rate - (path[2] - path[1]))
    elif grid.is_bent[0] and level == PIECES:
        rate += 0.5 * (rate - (path[PIECES - 1] - path[PIECES - 2]))
    return rate

"""All solutions of one goal within the limits, for an arm that no closed form solves.

Postures of the arm's table are brought to the goal; each that arrives on a curve not known yet has
it traced. Along the curves, candidates for a collision check are spread.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.analytic.ik import within
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant, jit
from tcs.kernel.dexterity import UNLIMITED
from tcs.kernel.dexterity.measures import limit_penalty
from tcs.kernel.kinematics import link_poses
from tcs.kernel.numeric.arm import ACROSS, TILTS, TURNS, UP, NumericArm, figures_at, numeric_arm_of
from tcs.kernel.numeric.curves import (
    SAME_CURVE,
    Curves,
    is_known,
    new_curves,
    point_between,
    slack_of,
    trace,
)
from tcs.kernel.numeric.newton import converge
from tcs.kernel.problem import Problem

TURN = 2.0 * np.pi
MOST_POINTS, MOST_CURVES, MOST_CANDIDATES = 4096, 64, 16_384
STRIDE = 0.2
"""Longest stride along a curve [rad, as a norm of the joints]."""
BEYOND = 0.6
"""How far beyond its limits a joint is followed [rad]: curves that leave the limits for a while
come back, and a start may converge a little beyond."""
STARTS = 96
"""Postures of the table that are brought to the goal, at most."""
ITERATIONS = int_constant(10)
"""Most Newton iterations of a start; typically 4."""
ON_CURVE = 1e-5
"""Error [rad and m] of a start that has arrived."""
SPACING = 0.05
"""Of candidates along a curve [rad, as a norm of the joints]: the free joint of the closed form,
spaced 0.0125, moves all joints together by a norm 3 or 4 times that."""
INSIDE = 3e-5
"""How far inside the limits a candidate next to them lies [rad]: the cubic is good to 1e-5."""
HALVINGS = 8
"""Of the way to the last place within the limits: down to SPACING / 256."""
GOLDEN = 0.381966
"""Share of a bracket at which a golden section cuts it."""
LAST_FRACTION = 1.0 - 1e-12
"""Greatest share of the way from a point to the next: a whole one would be the next point, which
the last of a curve has not got."""
NEAREST = np.array([0, 1, 2, 4, 8, 3, 5, 6, 9, 10, 12, 7, 11, 13, 14, 15])
"""Neighbours of a cell as sets of the figures in which they differ, those in few first."""


class CurveSearch(NamedTuple):
    """Scratch of one worker, reused from pair to pair."""

    curves: Curves
    figures: FloatArray
    """Where the goal is in the table, shape (4,)."""
    at: FloatArray
    """Where each candidate is: number of the point before it, and share of the way to the next,
    added up; shape (MOST_CANDIDATES,)."""
    measure: FloatArray
    """Its measure; TRIED once it was found to collide."""
    pair: IntArray
    """What it touches, as `Workspace.last`; -1 for nothing; shape (MOST_CANDIDATES, 3)."""
    best: FloatArray
    """Joint angles of the best solution so far [rad], shape (7,)."""


@jit
def new_curve_search(points: int, curves: int, candidates: int) -> CurveSearch:
    """Return scratch memory."""
    return CurveSearch(
        new_curves(points, curves),
        np.empty(4),
        np.empty(candidates),
        np.empty(candidates),
        np.empty((candidates, 3), np.int64),
        np.empty(7),
    )


class NumericSolver(NamedTuple):
    """Constants of an arm and the search over its curves."""

    arm: NumericArm
    search: CurveSearch
    best: FloatArray
    """The array `best` of the search."""


def new_numeric_solver(problem: Problem) -> NumericSolver:
    """Return the solver of a problem's arm, with scratch memory for one worker."""
    search = new_curve_search(MOST_POINTS, MOST_CURVES, MOST_CANDIDATES)
    return NumericSolver(numeric_arm_of(problem), search, search.best)


@jit
def is_within_span(arm: NumericArm, R_AG: FloatArray, p_AG: FloatArray) -> bool:
    """Return whether lengths alone let the arm come to a goal.

    Args:
        arm: The arm.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
    """
    square, F, f = 0.0, arm.R[7], arm.p[7]
    for r in range(3):
        # Axis 7 in A: R_AL7 = R_AG R7^T.
        axis = away = 0.0
        for c in range(3):
            axis += R_AG[r, c] * F[2, c]
            for k in range(3):
                away += R_AG[r, c] * F[k, c] * f[k]
        apart = p_AG[r] - away + arm.ends[1] * axis
        apart -= arm.p[0, r] + arm.ends[0] * arm.R[0, r, 2]
        square += apart * apart
    near, far = max(arm.span[0], 0.0), arm.span[1]
    return near * near <= square <= far * far


@jit
def find_curves(
    arm: NumericArm, R_AG: FloatArray, p_AG: FloatArray, search: CurveSearch, of: int
) -> int:
    """Trace all curves of solutions that the starts of the table lead to.

    Args:
        arm: The arm.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        search: `curves` gets filled.
        of: ISOTROPY or INVERSE_CONDITION, what to evaluate along them.

    Returns:
        How many there are.
    """
    F, f = arm.R[7], arm.p[7]
    # L7 at the goal but for its own turn, in A and in the frame that joint 1 turns against.
    R_A7, R_F7 = np.empty((3, 3)), np.empty((3, 3))
    p_A, p_F = np.empty(3), np.empty(3)
    for r in range(3):
        for c in range(3):
            R_A7[r, c] = R_AG[r, 0] * F[c, 0] + R_AG[r, 1] * F[c, 1] + R_AG[r, 2] * F[c, 2]
        p_A[r] = p_AG[r] - arm.p[0, r] + arm.ends[1] * R_A7[r, 2]
        for k in range(3):
            p_A[r] -= R_A7[r, k] * f[k]
    for r in range(3):
        p_F[r] = 0.0
        for k in range(3):
            p_F[r] += arm.R[0, k, r] * p_A[k]
        for c in range(3):
            R_F7[r, c] = 0.0
            for k in range(3):
                R_F7[r, c] += arm.R[0, k, r] * R_A7[k, c]
    ax, ay, az = R_F7[0, 2], R_F7[1, 2], R_F7[2, 2]
    azimuth = figures_at(p_F[0], p_F[1], p_F[2], ax, ay, az, search.figures)
    index, side = np.empty(4, np.int64), np.empty(4, np.int64)
    sizes = np.array([ACROSS, UP, TILTS, TURNS])
    for k in range(4):
        place = (search.figures[k] - arm.cell[k, 0]) / arm.cell[k, 1]
        index[k] = int(np.floor(place))
        side[k] = 1 if place - index[k] >= 0.5 else -1
    count = starts = 0
    for near in range(16):
        # The cell of the goal, then those it lies next to.
        flat = 0
        inside = True
        for k in range(4):
            i = index[k] + (side[k] if (NEAREST[near] >> k) & 1 else 0)
            if k == 3:
                i = i % TURNS
            elif i < 0 or i >= sizes[k]:
                # Rounding may put a figure on the outer face of the last cell.
                inside = False
            flat = flat * sizes[k] + i
        if not inside:
            continue
        for n in range(arm.first[flat], arm.first[flat + 1]):
            if starts >= STARTS:
                return count
            if not _start(arm, search, n, azimuth, R_F7):
                continue
            starts += 1
            count = trace_from(arm, R_AG, p_AG, search, count, BEYOND, STRIDE, ITERATIONS, of)
    return count


@inner
def _start(arm: NumericArm, search: CurveSearch, n: int, azimuth: float, R_F7: FloatArray) -> bool:
    """Fill `q_now` with posture n of the table, joints 1 and 7 turned to the goal.

    Returns:
        Whether these two keep their limits, or nearly so.
    """
    q = search.curves.q_now
    for i in range(5):
        q[i + 1] = arm.postures[n, i]
    q[0] = azimuth - arm.azimuth[n]
    q[0] -= TURN * np.floor((q[0] - arm.middle[0]) / TURN + 0.5)
    if abs(q[0] - arm.middle[0]) > arm.half[0] + BEYOND:
        return False
    q[6] = 0.0
    newton = search.curves.newton
    link_poses(arm.R_F, arm.p, q, newton.link_R, newton.link_p)
    S = newton.link_R[7]
    cosine = sine = 0.0
    for r in range(3):
        cosine += S[r, 0] * R_F7[r, 0] + S[r, 1] * R_F7[r, 1]
        sine += S[r, 1] * R_F7[r, 0] - S[r, 0] * R_F7[r, 1]
    q[6] = np.arctan2(sine, cosine)
    q[6] -= TURN * np.floor((q[6] - arm.middle[6]) / TURN + 0.5)
    return abs(q[6] - arm.middle[6]) <= arm.half[6] + BEYOND


@inner
def trace_from(
    arm: NumericArm,
    R_AG: FloatArray,
    p_AG: FloatArray,
    search: CurveSearch,
    count: int,
    beyond: float,
    stride: float,
    iterations: int,
    of: int,
) -> int:
    """Bring `q_now` to the goal and trace the curve found there, unless it is known.

    Args:
        arm: The arm.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        search: `curves.q_now` is where to start; `curves` gets filled.
        count: How many curves there are.
        beyond: How far beyond its limits a joint is followed [rad].
        stride: Longest stride along a curve [rad].
        iterations: Greatest number of Newton iterations.
        of: ISOTROPY or INVERSE_CONDITION.

    Returns:
        How many curves there are now.
    """
    curves = search.curves
    q = curves.q_now
    if not converge(arm, R_AG, p_AG, q, curves.newton, iterations, ON_CURVE):
        return count
    if slack_of(arm, q) < -beyond or is_known(curves, count, q, SAME_CURVE):
        return count
    return trace(arm, R_AG, p_AG, curves, count, beyond, stride, of)


@jit
def find_candidates(
    problem: Problem, arm: NumericArm, search: CurveSearch, count: int, spacing: float
) -> int:
    """Spread candidates over what of the curves keeps all limits; return how many there are.

    They come in the order of their places.
    """
    curves, found = search.curves, 0
    q = curves.q_now
    for k in range(count):
        for n in range(curves.first[k], curves.first[k + 1] - 1):
            # No joint moves farther than the curve is long, and that is little more than its chord.
            length = 1.1 * curves.length[n]
            either = curves.slack[n] + curves.slack[n + 1]
            if either < -length:
                continue
            parts = max(2, int(np.ceil(curves.length[n] / spacing)))
            if n == curves.first[k] and curves.slack[n] >= INSIDE:
                found = _add(problem, search, n, 0.0, found)
            if either - length >= 2.0 * INSIDE:
                for j in range(1, parts + 1):
                    found = _add(problem, search, n, j / parts, found)
                continue
            before, early = curves.slack[n], -np.inf
            for j in range(1, parts + 1):
                fraction = j / parts
                point_between(curves, n, fraction, q)
                slack = slack_of(arm, q)
                if (slack >= INSIDE) != (before >= INSIDE):
                    # The last place that keeps the limits.
                    inner, outer = fraction, (j - 1) / parts
                    if slack < INSIDE:
                        inner, outer = outer, inner
                    found = _at_limit(problem, arm, search, n, inner, outer, found)
                elif early < before < INSIDE and before >= slack and before > -length / parts:
                    # Nearer to the limits than both neighbours: a short stretch may hide here.
                    low = max((j - 2) / parts, 0.0)
                    found = _at_peak(problem, arm, search, n, low, fraction, found)
                elif j == parts and before < slack < INSIDE and slack > -length / parts:
                    # Or on the way to the next point, beyond which it falls again.
                    found = _at_peak(problem, arm, search, n, (j - 1) / parts, fraction, found)
                if slack >= INSIDE:
                    found = _add(problem, search, n, fraction, found)
                early, before = before, slack
    return found


@inner
def _at_limit(
    problem: Problem,
    arm: NumericArm,
    search: CurveSearch,
    n: int,
    inner: float,
    outer: float,
    found: int,
) -> int:
    """Append the outermost place between two that keeps the limits."""
    q = search.curves.q_now
    for _ in range(HALVINGS):
        middle = 0.5 * (inner + outer)
        point_between(search.curves, n, middle, q)
        if slack_of(arm, q) >= INSIDE:
            inner = middle
        else:
            outer = middle
    return _add(problem, search, n, inner, found)


@inner
def _at_peak(
    problem: Problem,
    arm: NumericArm,
    search: CurveSearch,
    n: int,
    low: float,
    high: float,
    found: int,
) -> int:
    """Append the place between two that is farthest inside the limits, if it may be inside."""
    q, before, after = search.curves.q_now, -np.inf, -np.inf
    for _ in range(2 * HALVINGS):
        first, second = low + GOLDEN * (high - low), high - GOLDEN * (high - low)
        point_between(search.curves, n, first, q)
        before = slack_of(arm, q)
        point_between(search.curves, n, second, q)
        after = slack_of(arm, q)
        if before >= INSIDE:
            return _add(problem, search, n, first, found)
        if after >= INSIDE:
            return _add(problem, search, n, second, found)
        if before > after:
            high = second
        else:
            low = first
    # The cubic is too coarse to decide; a candidate counts only once its solution keeps limits.
    if max(before, after) >= -INSIDE:
        found = _add(problem, search, n, 0.5 * (low + high), found)
    return found


@inner
def _add(problem: Problem, search: CurveSearch, n: int, fraction: float, found: int) -> int:
    """Append a candidate; its measure is that of the points about it, interpolated."""
    if found == len(search.at):
        return found
    curves = search.curves
    search.at[found] = n + min(fraction, LAST_FRACTION)
    value = (1.0 - fraction) * curves.value[n] + fraction * curves.value[n + 1]
    if problem.measure.penalty != UNLIMITED:
        point_between(curves, n, fraction, search.best)
        turn_into_limits(problem, search.best)
        lower, upper = problem.arm.lower, problem.arm.upper
        value *= limit_penalty(search.best, lower, upper, problem.measure.penalty)
    search.measure[found] = value
    return found + 1


@inner
def turn_into_limits(problem: Problem, q: FloatArray) -> None:
    """Turn every joint by full turns into its limits."""
    for i in range(7):
        q[i] = within(q[i], problem.arm.lower[i], problem.arm.upper[i])

"""Solutions of one goal within the limits, for an arm without a closed form.

Newton's method brings postures of the arm's table to the goal. Each solution that is not on a known
curve starts a new one, which is traced. Candidates for the collision check are spread along the
curves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.analytic.ik import within
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant, jit
from tcs.kernel.dexterity import LIMIT_WEIGHTED, UNLIMITED
from tcs.kernel.dexterity.measures import limit_penalty, measure_at
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
"""Capacities of the scratch arrays."""
STRIDE = 0.2
"""Longest stride along a curve [rad, norm of the joints]."""
BEYOND = 0.6
"""How far beyond its limits a joint is followed [rad]: a curve that leaves the limits may return,
and Newton's method may converge slightly beyond them."""
STARTS = 96
"""Greatest number of postures of the table to start Newton's method from."""
ITERATIONS = int_constant(10)
"""Greatest number of Newton iterations from a start; 4 are typical."""
ON_CURVE = 1e-5
"""Error [rad and m] below which a start has converged."""
SPACING = 0.05
"""Spacing of candidates along a curve [rad, norm of the joints]. It corresponds to the closed form:
a step of 0.0125 of the free joint moves all joints by a norm 3 or 4 times that."""
INSIDE = 3e-5
"""Distance of a candidate next to the limits from them [rad]: the cubic is accurate to 1e-5."""
HALVINGS = 8
"""Number of bisections towards the last position within the limits: down to SPACING / 256."""
GOLDEN = 0.381966
"""Fraction at which a golden-section search divides its interval."""
LAST_FRACTION = 1.0 - 1e-12
"""Greatest fraction of a stride: 1 would be the next point, and no stride starts at the last point
of a curve."""
NEAREST = np.array([0, 1, 2, 4, 8, 3, 5, 6, 9, 10, 12, 7, 11, 13, 14, 15])
"""Neighbours of a cell, as bit sets of the figures in which they differ, fewest bits first."""


class CurveSearch(NamedTuple):
    """Scratch of one worker, reused from pair to pair."""

    curves: Curves
    """The curves of the goal."""
    figures: FloatArray
    """The four figures of the goal, as in `tcs.kernel.numeric.arm`, shape (4,)."""
    at: FloatArray
    """Position of each candidate: index of the point before it, plus the fraction of the stride to
    the next point, shape (MOST_CANDIDATES,)."""
    measure: FloatArray
    """Interpolated measure of each candidate, TRIED once it is rejected, shape
    (MOST_CANDIDATES,)."""
    pair: IntArray
    """Pair in contact at each candidate, as `Workspace.last`; -1 for none, shape
    (MOST_CANDIDATES, 3)."""
    best: FloatArray
    """Joint angles of the best solution so far [rad], shape (7,)."""


@jit
def new_curve_search(points: int, curves: int, candidates: int) -> CurveSearch:
    """Return scratch memory for one worker."""
    return CurveSearch(
        new_curves(points, curves),
        np.empty(4),
        np.empty(candidates),
        np.empty(candidates),
        np.empty((candidates, 3), np.int64),
        np.empty(7),
    )


class NumericSolver(NamedTuple):
    """Constants of an arm, and scratch of the search over its curves."""

    arm: NumericArm
    search: CurveSearch
    best: FloatArray
    """The array `search.best`."""


def new_numeric_solver(problem: Problem) -> NumericSolver:
    """Return the solver of a problem's arm, with scratch memory for one worker."""
    search = new_curve_search(MOST_POINTS, MOST_CURVES, MOST_CANDIDATES)
    return NumericSolver(numeric_arm_of(problem), search, search.best)


@jit
def is_within_span(arm: NumericArm, R_AG: FloatArray, p_AG: FloatArray) -> bool:
    """Return whether a goal is within the reach bounds of the arm.

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
    """Trace the curves of solutions found from the starts in the table.

    Args:
        arm: The arm.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        search: `curves` is filled.
        of: Function to evaluate along the curves, as in `Dexterity`.

    Returns:
        Number of curves.
    """
    F, f = arm.R[7], arm.p[7]
    # Orientation of L7 and position of the end point on axis 7, from the origin of F, in A and F.
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
        # The cell of the goal, then the nearest neighbours.
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
    """Fill `q_now` with posture n of the table, joints 1 and 7 set to match the goal.

    Returns:
        Whether joints 1 and 7 are at most BEYOND outside their limits.
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
        search: `curves.q_now` is the start; `curves` is filled.
        count: Number of curves.
        beyond: How far beyond its limits a joint is followed [rad].
        stride: Longest stride along a curve [rad, norm of the joints].
        iterations: Greatest number of Newton iterations.
        of: Function to evaluate along the curve, as in `Dexterity`.

    Returns:
        Updated number of curves.
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
    """Spread candidates, in the order of their positions, over the curves within the limits.

    Args:
        problem: The scene.
        arm: Constants of the arm.
        search: `curves` is read; the candidates are filled.
        count: Number of curves.
        spacing: Greatest spacing of candidates [rad, norm of the joints].

    Returns:
        Number of candidates.
    """
    curves, found = search.curves, 0
    q = curves.q_now
    for k in range(count):
        for n in range(curves.first[k], curves.first[k + 1] - 1):
            # No joint moves by more than the length of the curve, little more than its chord.
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
                    # The curve crosses a limit.
                    inner, outer = fraction, (j - 1) / parts
                    if slack < INSIDE:
                        inner, outer = outer, inner
                    found = _at_limit(problem, arm, search, n, inner, outer, found)
                elif early < before < INSIDE and before >= slack and before > -length / parts:
                    # A peak of the slack: a short interval within the limits may lie here.
                    low = max((j - 2) / parts, 0.0)
                    found = _at_peak(problem, arm, search, n, low, fraction, found)
                elif j == parts and before < slack < INSIDE and slack > -length / parts:
                    # The slack rises to the end of the stride: the peak may lie just before it.
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
    """Append the outermost position within the limits, found by bisection of one stride.

    The limits are kept at the fraction `inner` of stride n and violated at `outer`.
    """
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
    """Append the position of greatest slack between two, if it may be within the limits."""
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
    # The cubic is too coarse to decide: only the solution of the candidate does.
    if max(before, after) >= -INSIDE:
        found = _add(problem, search, n, 0.5 * (low + high), found)
    return found


@inner
def _add(problem: Problem, search: CurveSearch, n: int, fraction: float, found: int) -> int:
    """Append a candidate with the measure interpolated between points n and n + 1."""
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
    elif problem.measure.of == LIMIT_WEIGHTED:
        # Between two points a joint may reach and leave its limit: no interpolation.
        point_between(curves, n, fraction, search.best)
        turn_into_limits(problem, search.best)
        value = measure_at(problem, search.best)
    search.measure[found] = value
    return found + 1


@inner
def turn_into_limits(problem: Problem, q: FloatArray) -> None:
    """Shift every joint by full turns into its limits, in place."""
    for i in range(7):
        q[i] = within(q[i], problem.arm.lower[i], problem.arm.upper[i])

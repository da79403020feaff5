"""Self-motion curves of one goal: the sets of solutions along which the tool does not move.

With seven joints the solutions of a goal form curves. From one solution the whole curve is traced:
a stride along the tangent, a correction back to the goal, and so on. Cubics interpolate the points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant, jit
from tcs.kernel.dexterity import INVERSE_CONDITION
from tcs.kernel.dexterity.measures import inverse_condition
from tcs.kernel.kinematics import copy_joints
from tcs.kernel.numeric.arm import NumericArm
from tcs.kernel.numeric.newton import (
    NewtonWorkspace,
    converge,
    evaluate,
    factorise,
    new_newton_workspace,
    null_space_direction,
    step_to_goal,
)

FULL_TURN = 6.283185307179586
LEAST_STRIDE = 1e-3
"""Shortest stride along a curve [rad, norm of the joints]. Tracing ends where the stride would have
to be shorter, next to a singularity."""
EASY_ANGLE = 0.2
"""Angle between successive tangents [rad] above which strides become shorter."""
HARD_ANGLE = 0.5
"""Angle between successive tangents [rad] above which a stride is rejected."""
LONG_CORRECTION = 3e-3
"""Length of a Newton step [rad, norm of the joints] up to which the tool is then within 1e-5 of the
goal; a longer step is followed by a second one."""
MAX_CORRECTED_ERROR = 3e-4
"""Error after the first Newton step [rad and m] above which a stride is rejected."""
MAX_PREDICTED_ERROR = 3e-2
"""Error of the predicted point [rad and m] above which a stride is rejected."""
CORRECTIONS = int_constant(4)
"""Greatest number of Newton iterations from a point on a cubic to the goal; 2 are typical."""
SAME_CURVE = 0.04
"""Greatest distance from a known curve [rad, norm of the joints] of a solution that counts as on
it: points are up to a stride apart, and the curve deviates from their chord."""


class Curves(NamedTuple):
    """Points of the curves of one goal; reused from pair to pair."""

    q: FloatArray
    """Joint angles [rad], continuous along a curve, not shifted into limits, shape (points, 7)."""
    tangent: FloatArray
    """Unit directions along the curve, shape (points, 7)."""
    length: FloatArray
    """Distance from each point to the next one of its curve [rad, norm], shape (points,)."""
    value: FloatArray
    """Isotropy or inverse condition at each point, shape (points,)."""
    slack: FloatArray
    """Least distance of a joint from its limits [rad], negative beyond them, shape (points,)."""
    first: IntArray
    """First point of each curve, and the number of points, shape (curves + 1,)."""
    newton: NewtonWorkspace
    """Scratch of Newton's method."""
    q_now: FloatArray
    """Current joint angles [rad], shape (7,)."""
    tangent_now: FloatArray
    """Current unit tangent, shape (7,)."""
    trial: FloatArray
    """Vector to project onto the null space, shape (7,)."""


@jit
def new_curves(points: int, curves: int) -> Curves:
    """Return memory for at most `points` points and `curves` curves."""
    return Curves(
        np.empty((points, 7)),
        np.empty((points, 7)),
        np.zeros(points),
        np.empty(points),
        np.empty(points),
        np.zeros(curves + 1, np.int64),
        new_newton_workspace(),
        np.empty(7),
        np.empty(7),
        np.empty(7),
    )


@jit
def slack_of(arm: NumericArm, q: FloatArray) -> float:
    """Return the least distance of a joint from its limits [rad], negative beyond them.

    Each joint is shifted by full turns to the angle nearest to the middle of its limits.
    """
    worst = np.inf
    for i in range(7):
        off = q[i] - arm.middle[i]
        off -= FULL_TURN * np.floor(off / FULL_TURN + 0.5)
        worst = min(worst, arm.half[i] - abs(off))
    return worst


@inner
def is_known(curves: Curves, count: int, q: FloatArray, beside: float) -> bool:
    """Return whether joint angles q lie on one of the first `count` curves.

    Args:
        curves: The curves.
        count: Number of curves.
        q: Joint angles [rad], shape (7,).
        beside: Greatest distance from a curve [rad, norm of the joints].
    """
    for k in range(count):
        start, stop = curves.first[k], curves.first[k + 1]
        for n in range(start, stop):
            # Each point covers a little more than half of the strides on either side.
            reach = curves.length[n]
            if n > start:
                reach = max(reach, curves.length[n - 1])
            reach = 0.6 * reach + beside
            square = along = 0.0
            for i in range(7):
                off = q[i] - curves.q[n, i]
                off -= FULL_TURN * np.floor(off / FULL_TURN + 0.5)
                square += off * off
                along += off * curves.tangent[n, i]
                if square > reach * reach:
                    break
            if square <= reach * reach and square - along * along <= beside * beside:
                return True
    return False


@jit
def trace(
    arm: NumericArm,
    R_AG: FloatArray,
    p_AG: FloatArray,
    curves: Curves,
    count: int,
    beyond: float,
    stride: float,
    of: int,
) -> int:
    """Append the curve through the solution in `curves.q_now`, traced in both directions.

    A closed curve is one entry; an open one is two, one for each direction.

    Args:
        arm: The arm.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        curves: Filled.
        count: Number of curves.
        beyond: How far beyond its limits a joint is followed [rad].
        stride: Longest stride [rad, norm of the joints].
        of: Function to evaluate at each point, as in `Dexterity`; the isotropy for LIMIT_WEIGHTED.

    Returns:
        Updated number of curves.
    """
    most = len(curves.first) - 1
    for side in range(2):
        if count >= most:
            return count
        start = curves.first[count]
        sense = 1.0 - 2.0 * side
        stop, closed = _trace_side(arm, R_AG, p_AG, curves, start, sense, beyond, stride, of)
        if stop - start >= 2 or (stop > start and side == 0):
            count += 1
            curves.first[count] = stop
        if closed:
            break
    return count


@inner
def _append_point(
    arm: NumericArm, curves: Curves, n: int, start: int, det: float, of: int
) -> float:
    """Store the current joints and tangent as point n of a curve; return its slack [rad]."""
    J = curves.newton.J
    if of != INVERSE_CONDITION:
        total = 0.0
        for i in range(6):
            for k in range(7):
                total += J[i, k] * J[i, k]
        curves.value[n] = det ** (1.0 / 6.0) / (total / 6.0)
    else:
        curves.value[n] = inverse_condition(J)
    square = 0.0
    for i in range(7):
        curves.q[n, i] = curves.q_now[i]
        curves.tangent[n, i] = curves.tangent_now[i]
        if n > start:
            off = curves.q[n, i] - curves.q[n - 1, i]
            square += off * off
    curves.length[n] = 0.0
    if n > start:
        curves.length[n - 1] = np.sqrt(square)
    curves.slack[n] = slack_of(arm, curves.q_now)
    return curves.slack[n]


@inner
def _trace_side(
    arm: NumericArm,
    R_AG: FloatArray,
    p_AG: FloatArray,
    curves: Curves,
    start: int,
    side: float,
    beyond: float,
    stride: float,
    of: int,
) -> tuple[int, bool]:
    """Trace a curve in one direction from the solution in `q_now`, which is restored at the end.

    Returns:
        Index after the last point, and whether the curve is closed.
    """
    q, tangent, newton = curves.q_now, curves.tangent_now, curves.newton
    if start >= len(curves.slack):
        return start, False
    evaluate(arm, R_AG, p_AG, q, newton)
    det = factorise(newton, 0.0)
    # The joint with the largest part in the self-motion defines the direction of travel.
    best = 0.0
    for i in range(7):
        curves.trial[:] = 0.0
        curves.trial[i] = side
        part = null_space_direction(newton, curves.trial, newton.step)
        if part > best:
            best = part
            copy_joints(newton.step, tangent)
    _append_point(arm, curves, start, start, det, of)
    n = start + 1
    h = 0.5 * stride
    travelled = 0.0
    while n < len(curves.slack):
        last = n - 1
        # Predict to second order, the curvature taken from the last two tangents.
        curvature = 0.0
        if last > start:
            curvature = 0.5 * h * h / curves.length[last - 1]
        for i in range(7):
            q[i] = curves.q[last, i] + h * curves.tangent[last, i]
            if curvature > 0.0:
                q[i] += curvature * (curves.tangent[last, i] - curves.tangent[last - 1, i])
        worst = evaluate(arm, R_AG, p_AG, q, newton)
        good = worst < MAX_PREDICTED_ERROR
        if good:
            det = factorise(newton, 0.0)
            if step_to_goal(newton, q, h) > LONG_CORRECTION:
                worst = evaluate(arm, R_AG, p_AG, q, newton)
                good = worst < MAX_CORRECTED_ERROR
                det = factorise(newton, 0.0)
                step_to_goal(newton, q, h)
        cosine = 0.0
        if good:
            for i in range(7):
                curves.trial[i] = curves.tangent[last, i]
            cosine = null_space_direction(newton, curves.trial, tangent)
            good = cosine > np.cos(HARD_ANGLE)
        if not good:
            h *= 0.5
            if h < LEAST_STRIDE:
                break
            continue
        slack = _append_point(arm, curves, n, start, det, of)
        travelled += h
        n += 1
        if slack < -beyond:
            break
        if travelled > 2.0 * stride and _has_closed(curves, start, n - 1):
            copy_joints(curves.q[start], curves.q_now)
            return n, True
        angle = np.arccos(min(cosine, 1.0))
        h = min(stride, h * min(max(EASY_ANGLE / max(angle, 1e-3), 0.5), 1.6))
    copy_joints(curves.q[start], curves.q_now)
    return n, False


@inner
def _has_closed(curves: Curves, start: int, n: int) -> bool:
    """Return whether the curve has returned to its start, between points n - 1 and n."""
    before = after = apart = 0.0
    for i in range(7):
        off = curves.q[start, i] - curves.q[n, i]
        off -= FULL_TURN * np.floor(off / FULL_TURN + 0.5)
        step = curves.q[n, i] - curves.q[n - 1, i]
        apart += off * off
        after += off * step
        before += (off + step) * step
    length = curves.length[n - 1]
    beside = apart - (after / length) ** 2
    return after <= 0.0 <= before and beside <= SAME_CURVE * SAME_CURVE


@jit
def point_between(curves: Curves, n: int, fraction: float, q: FloatArray) -> None:
    """Fill joint angles between points n and n + 1 by cubic Hermite interpolation.

    Args:
        curves: The curves.
        n: Index of a point that is not the last of its curve.
        fraction: Fraction of the stride from point n to n + 1, in [0, 1].
        q: Filled [rad], shape (7,).
    """
    length = curves.length[n]
    u, v = fraction, 1.0 - fraction
    a, b = v * v * (1.0 + 2.0 * u), u * u * (1.0 + 2.0 * v)
    c, d = length * u * v * v, -length * u * u * v
    for i in range(7):
        q[i] = a * curves.q[n, i] + b * curves.q[n + 1, i]
        q[i] += c * curves.tangent[n, i] + d * curves.tangent[n + 1, i]


@jit
def correct(
    arm: NumericArm, R_AG: FloatArray, p_AG: FloatArray, curves: Curves, exact: float
) -> bool:
    """Bring `q_now`, already close to the goal, to the goal; return whether that succeeded."""
    return converge(arm, R_AG, p_AG, curves.q_now, curves.newton, CORRECTIONS, exact)

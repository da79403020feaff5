"""Timing within velocity, acceleration and jerk limits: timed curves, averaged over time.

A curve that is timed within velocity and acceleration limits is replaced by its average over a
window of time that moves along it (Biagiotti, Melchiorri 2008). An average keeps the limits of what
it averages, and its jerk is at most twice the acceleration limit by the width of the window. It
begins and ends in the same postures, at rest and without acceleration. Straight lines in joint
space stay what they are; where a path bends, the average cuts inside, the less the slower it is:
what is not accepted there is averaged anew at a slower rate. The result is a cubic spline of the
time with continuous acceleration, so that its jerk is constant between two knots.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from tcs.kernel.arrays import FloatArray
from tcs.motion.curves import Curve
from tcs.motion.limits import MotionLimits
from tcs.motion.timing import DECIMALS, SAMPLE_SECONDS, Timed, timed

SLOWER = (1.0, 1.25, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Factors of the time by which a curve is slowed down, in the order of the attempts. The way that
the average cuts off falls with the sixth power of the factor."""
FINE = 0.002
"""Time between two samples of what is averaged [s]."""
KNOTS_IN_WINDOW = 8
"""Least number of knots of the spline in a window: its jerk is some ten per cent above that of the
average, which costs three per cent of the time."""


def smoothed(curve: Curve, limits: MotionLimits, accepted: Callable[[Curve], bool]) -> Curve | None:
    """Return a motion along a curve within limits of velocity, acceleration and jerk.

    Args:
        curve: The path.
        limits: The limits, at least one of which bounds a jerk.
        accepted: Whether a motion may be made, e.g. because it is certified free of contact.

    Returns:
        A cubic spline of the time [s] with continuous acceleration, at rest and without
        acceleration at both ends; None if none is accepted at any rate.
    """
    for factor in SLOWER:
        slow = replace(curve, fastest=curve.fastest / factor)
        acceleration = limits.acceleration / factor**2
        steady = timed(slow, limits.velocity / factor, acceleration, FINE)
        motion = _within(_averaged(steady, float(np.max(2.0 * acceleration / limits.jerk))), limits)
        if accepted(motion):
            return motion
    return None


def _averaged(steady: Timed, window: float) -> Curve:
    """Return the average of a timed curve over a window of time that moves along it.

    Args:
        steady: Samples; before and after them the joints rest.
        window: Width of the window [s].
    """
    step = np.diff(steady.times)[:, None]
    sums, rates = steady.positions[1:] + steady.positions[:-1], np.diff(steady.velocities, axis=0)
    # The integral of the cubics through the samples.
    parts = step * (0.5 * sums - step * rates / 12.0)
    integral = np.concatenate([np.zeros((1, 7)), np.cumsum(parts, axis=0)])

    def until(times: FloatArray) -> FloatArray:
        inside = np.clip(times, 0.0, steady.duration)
        columns = [np.interp(inside, steady.times, column) for column in integral.T]
        before, after = np.minimum(times, 0.0), np.maximum(times - steady.duration, 0.0)
        ends = np.outer(before, steady.positions[0]) + np.outer(after, steady.positions[-1])
        return np.asarray(np.stack(columns, axis=1) + ends)

    whole = steady.duration + window
    knots = np.linspace(
        0.0, whole, int(np.ceil(whole / min(SAMPLE_SECONDS, window / KNOTS_IN_WINDOW))) + 1
    )
    q = (until(knots) - until(knots - window)) / window
    q[0], q[-1] = steady.positions[0], steady.positions[-1]
    return _spline_at_rest(knots, q)


def _spline_at_rest(knots: FloatArray, q: FloatArray) -> Curve:
    """Return the cubic spline whose velocity and acceleration are 0 at both ends.

    Args:
        knots: Times [s], shape (n,).
        q: Joint angles at the knots [rad], shape (n, 7); those beside the ends are adjusted.
    """
    ends, beside = [0, -1], [1, -2]
    units = np.zeros((len(knots), 2))
    units[beside, [0, 1]] = 1.0
    response = CubicSpline(knots, units, bc_type="natural")(knots[ends], 1)
    velocity = CubicSpline(knots, q, bc_type="natural")(knots[ends], 1)
    q = q.copy()
    q[beside] -= np.linalg.solve(response, velocity)
    dq = CubicSpline(knots, q, bc_type="natural")(knots, 1)
    dq[ends] = 0.0
    return Curve(knots, q, dq)


def _within(motion: Curve, limits: MotionLimits) -> Curve:
    """Return a motion with equal steps, slowed down as a whole until it keeps the limits.

    Its steps are whole multiples of the unit of time of files, which so hold the same curve.
    """
    per_second, steps = 10**DECIMALS, np.arange(len(motion.knots))
    step = float(motion.knots[1]) * per_second
    whole = int(np.ceil(step))
    while True:
        slow = Curve(whole * steps / per_second, motion.q, motion.dq * (step / whole))
        excess = limits.slowing(slow)
        if excess <= 1.0:
            return slow
        whole = max(whole + 1, int(np.ceil(excess * whole)))

"""Bounds of joint rates, from position limits, velocity limits and acceleration."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import Arm

_STILL = 1e-9
"""A joint at this rate [rad/s] stands still: a thousand times the rounding of any motion."""


def rate_bounds(
    arm: Arm, joints: FloatArray, period: float, acceleration: float | FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the rates with which no joint runs past its limits, now or later.

    A joint may approach a limit only so fast that, slowing down by a T in every step of length T
    from the next one on, it comes to rest at the limit: with v = (n + f) a T, n whole and f < 1,
    that way is ((n + 1) f + n (n + 1) / 2) a T^2.

    Args:
        arm: The arm.
        joints: Joint positions [rad], shape (7,), within the limits.
        period: Time of one step [s].
        acceleration: Greatest change of a rate [rad/s^2], one for all joints or shape (7,).

    Returns:
        Lowest rates (<= 0) and highest rates (>= 0) [rad/s], shapes (7,).
    """
    distance = np.array([joints - arm.lower, arm.upper - joints])
    np.maximum(distance, 0.0, out=distance)
    steps = distance / (acceleration * period * period)
    # Continuous joints: a finite number of steps that is never reached.
    np.minimum(steps, 1e12, out=steps)
    whole = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * steps) - 1.0))
    part = (steps - 0.5 * whole * (whole + 1.0)) / (whole + 1.0)
    fastest = (whole + part) * (acceleration * period)
    return -fastest[0], fastest[1]


def stops_in_time(
    arm: Arm,
    joints: FloatArray,
    rates: FloatArray,
    period: float,
    acceleration: float | FloatArray,
) -> bool:
    """Return whether rates are certainly within `rate_bounds`, at a third of its cost.

    Args:
        arm: The arm.
        joints: Joint positions [rad], shape (7,).
        rates: Joint rates [rad/s], shape (7,).
        period: Time of one step [s].
        acceleration: Greatest change of a rate [rad/s^2], one for all joints or shape (7,).
    """
    size = np.abs(rates)
    distance = np.where(rates > 0.0, arm.upper - joints, joints - arm.lower)
    # Coming to rest takes v^2 / 2a and half a step more, in whole steps at most half of one again.
    return bool((size * (size * (0.5 / acceleration) + period) <= distance).all())


def scale_to_bounds(rates: FloatArray, lower: FloatArray, upper: FloatArray) -> tuple[float, int]:
    """Return the factor that scales rates into bounds, and the joint that requires it.

    Scaling all joints alike keeps the direction in which the tool moves.

    Args:
        rates: Joint rates [rad/s], shape (7,).
        lower: Lowest rates, at most 0, shape (7,).
        upper: Highest rates, at least 0, shape (7,).

    Returns:
        A factor in [0, 1], and the joint that requires it, -1 at factor 1.
    """
    bound = np.where(rates > 0.0, upper, lower)
    # A joint at its limit that is not meant to move must not stop the others by its rounding.
    too_fast = np.abs(rates) > np.abs(bound) + _STILL
    if not too_fast.any():
        return 1.0, -1
    factors = np.ones_like(rates)
    np.divide(bound, rates, out=factors, where=too_fast)
    i = int(factors.argmin())
    return float(factors[i]), i


def limit_rate_change(
    before: FloatArray,
    wanted: FloatArray,
    change: float,
) -> tuple[FloatArray, bool]:
    """Return the next rates between the present and the wanted ones.

    All joints change by the same fraction of the difference, so a mixture of two motions that
    hold the tool at one posture holds it as well.

    Args:
        before: Rates of the step before [rad/s], shape (7,).
        wanted: Rates to come to [rad/s], shape (7,).
        change: Greatest change of a rate in one step [rad/s].

    Returns:
        The rates, shape (7,), and whether they are those wanted.
    """
    step = wanted - before
    largest = float(np.abs(step).max())
    arrived = largest <= change
    if not arrived:
        step *= change / largest
    return before + step, arrived

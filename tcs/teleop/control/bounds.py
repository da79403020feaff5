"""Bounds of joint rates, from position limits, velocity limits and acceleration."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import Arm

_STILL = 1e-9
"""Rate [rad/s] below which a joint is at rest: a thousand times the rounding of any motion."""


def rate_bounds(
    arm: Arm, joints: FloatArray, period: float, acceleration: float | FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the rates from which every joint can still stop within its limits.

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
    fastest = stopping_rates(distance, period, acceleration)
    return -fastest[0], fastest[1]


def stopping_rates(
    distance: FloatArray, period: float, acceleration: float | FloatArray
) -> FloatArray:
    """Return the greatest rates from which joints come to rest within distances.

    At its greatest rate v, a joint that slows down by a T in every step of length T from the next
    step on comes to rest at the end of its distance: with v = (n + f) a T, n whole and 0 <= f < 1,
    it travels ((n + 1) f + n (n + 1) / 2) a T^2.

    Args:
        distance: Distances [rad], at least 0, shape (..., 7); may be infinite.
        period: Time of one step [s].
        acceleration: Greatest change of a rate [rad/s^2], one for all joints or shape (7,).

    Returns:
        Rates [rad/s], shape (..., 7).
    """
    steps = distance / (acceleration * period * period)
    # Continuous joints: a finite bound that is never reached.
    np.minimum(steps, 1e12, out=steps)
    whole = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * steps) - 1.0))
    part = (steps - 0.5 * whole * (whole + 1.0)) / (whole + 1.0)
    return np.asarray((whole + part) * (acceleration * period))


def stops_in_time(
    arm: Arm,
    joints: FloatArray,
    rates: FloatArray,
    period: float,
    acceleration: float | FloatArray,
) -> bool:
    """Return True only if rates are within `rate_bounds`, at a third of the computing time.

    Args:
        arm: The arm.
        joints: Joint positions [rad], shape (7,).
        rates: Joint rates [rad/s], shape (7,).
        period: Time of one step [s].
        acceleration: Greatest change of a rate [rad/s^2], one for all joints or shape (7,).
    """
    size = np.abs(rates)
    distance = np.where(rates > 0.0, arm.upper - joints, joints - arm.lower)
    # The stopping distance is v^2 / 2a plus half a step, and at most another half for whole steps.
    return bool((size * (size * (0.5 / acceleration) + period) <= distance).all())


def scale_to_bounds(rates: FloatArray, lower: FloatArray, upper: FloatArray) -> tuple[float, int]:
    """Return the factor that scales rates into bounds, and the joint that requires it.

    Scaling all joints by one factor keeps the direction of the tool's motion.

    Args:
        rates: Joint rates [rad/s], shape (7,).
        lower: Lowest rates, at most 0 [rad/s], shape (7,).
        upper: Highest rates, at least 0 [rad/s], shape (7,).

    Returns:
        A factor in [0, 1], and the joint that requires it, -1 at factor 1.
    """
    bound = np.where(rates > 0.0, upper, lower)
    # A joint at rest at its limit must not stop the others because of rounding.
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
    """Return the next joint rates on the straight line from the current to the required rates.

    All joints change by the same fraction of the difference: if both motions hold the tool at one
    posture, so does every combination of them.

    Args:
        before: Rates of the previous step [rad/s], shape (7,).
        wanted: Required rates [rad/s], shape (7,).
        change: Greatest change of a rate in one step [rad/s].

    Returns:
        The rates [rad/s], shape (7,), and whether they equal the required ones.
    """
    step = wanted - before
    largest = float(np.abs(step).max())
    arrived = largest <= change
    if not arrived:
        step *= change / largest
    return before + step, arrived

"""Limits of a motion, and by how much a cubic spline of the time exceeds them, in closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.motion.curves import Curve


class Rates(NamedTuple):
    """Greatest absolute derivatives of the joints' angles by time."""

    velocity: FloatArray
    """[rad/s]"""
    acceleration: FloatArray
    """[rad/s^2]"""
    jerk: FloatArray
    """Between knots [rad/s^3]."""


def _none(_: Curve) -> float:
    return 0.0


@dataclass(frozen=True, eq=False)
class MotionLimits:
    """Limits of the joints, each of shape (7,), and of what else may be too fast."""

    velocity: FloatArray
    """Velocity limits [rad/s]."""
    acceleration: FloatArray
    """Acceleration limits [rad/s^2]."""
    jerk: FloatArray
    """Jerk limits [rad/s^3]; inf for joints without one."""
    lower: FloatArray = field(default_factory=lambda: np.full(7, -np.inf))
    """Least angles [rad]."""
    upper: FloatArray = field(default_factory=lambda: np.full(7, np.inf))
    """Greatest angles [rad]."""
    other: Callable[[Curve], float] = _none
    """Greatest speed of something else on a motion, as a fraction of its limit."""

    @property
    def bound_jerk(self) -> bool:
        """Whether the jerk of a joint is limited."""
        return bool(np.any(np.isfinite(self.jerk)))

    def slowing(self, motion: Curve) -> float:
        """Return the factor of the time by which a motion is too fast, at most 1 if it is not.

        Args:
            motion: A cubic spline of the time [s]; jerks are those between its knots.
        """
        found = Rates(*(each.max(axis=0) for each in rates(motion)))
        return max(
            float(np.max(found.velocity / self.velocity)),
            float(np.sqrt(np.max(found.acceleration / self.acceleration))),
            float(np.cbrt(np.max(found.jerk / self.jerk))),
            self.other(motion),
        )


def rates(motion: Curve) -> Rates:
    """Return the greatest rates on each piece of a cubic spline of the time [s], shapes (n, 7)."""
    step = np.diff(motion.knots)[:, None]
    return rates_between(step, motion.q[:-1], motion.dq[:-1], motion.q[1:], motion.dq[1:])


def rates_between(
    step: FloatArray, start: FloatArray, leaving: FloatArray, end: FloatArray, arriving: FloatArray
) -> Rates:
    """Return the greatest rates on cubics, shapes (n, 7).

    Args:
        step: Durations [s], shape (n, 1).
        start: Joint angles at the begin [rad], shape (n, 7) or (7,).
        leaving: Velocities there [rad/s], likewise.
        end: Joint angles at the end [rad], shape (n, 7).
        arriving: Velocities there [rad/s], shape (n, 7).
    """
    mean = (end - start) / step
    # The acceleration is linear in the time, so greatest at an end.
    first = (6.0 * mean - 4.0 * leaving - 2.0 * arriving) / step
    last = (4.0 * arriving + 2.0 * leaving - 6.0 * mean) / step
    # The velocity is greatest at an end, or where the acceleration is 0.
    with np.errstate(divide="ignore", invalid="ignore"):
        within = np.where(first * last < 0.0, first / (first - last), 0.0)
    inside = leaving + step * within * (first + 0.5 * within * (last - first))
    velocity = np.maximum(np.abs(inside), np.maximum(np.abs(leaving), np.abs(arriving)))
    acceleration = np.maximum(np.abs(first), np.abs(last))
    return Rates(velocity, acceleration, np.abs(last - first) / step)

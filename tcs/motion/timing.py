"""Timing of curves within velocity and acceleration limits, from standstill to standstill.

The squared rate x of a curve's parameter is bounded everywhere, then reduced until it can be
reached from both ends, in one pass from each (Bobrow, Dubowsky, Gibson 1985). On an interval of the
parameter the rate has a constant derivative u, so that joint k moves with velocity q'_k sqrt(x) and
acceleration q'_k u + q''_k x. Drake's TOPP-RA finds no timing for some of our curves, whose
second derivative jumps where straight pieces meet rounded corners.

A motion is the cubic spline through samples of that: positions and velocities at ends of intervals,
where the acceleration may jump. It is a curve of its own, near the one that was timed: its limits
are computed from its cubics, and it is certified itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.motion.curves import Curve
from tcs.motion.limits import MotionLimits, rates_between

INTERVALS, LEAST_INTERVALS = 240, 12
"""Number of intervals of the parameter on a curve, and the least on each of its pieces."""
INSIDE = np.array([0.0, 0.5, 1.0])
"""Points of each interval at which the limits are imposed, as fractions of it."""
CURVATURE = 0.7
"""Fraction of the acceleration limit that the curvature of the path may take up; the rest is left
to change the rate."""
SAMPLE_SECONDS = 0.05
"""Greatest time between two samples of a motion [s]."""
DECIMALS = 9
"""Decimals of the times of samples [s], which all files hold exactly: messages of ROS count
nanoseconds."""
SPARSE = 1.001
"""Fraction of the limits up to which samples are left out: a motion that is beyond them is made
slower as a whole."""

SWITCH = 0.1
"""Change of the derivative of the rate, as a fraction of its greatest, that is a switch."""


@dataclass(frozen=True, eq=False)
class Timed:
    """A motion: the cubics through positions and velocities at samples."""

    times: FloatArray
    """Time of each sample from the begin [s], shape (n,)."""
    positions: FloatArray
    """Joint angles [rad], shape (n, 7)."""
    velocities: FloatArray
    """Joint velocities [rad/s], shape (n, 7); 0 at both ends."""

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return float(self.times[-1])


def motion_along(
    curve: Curve, limits: MotionLimits, accepted: Callable[[Curve], bool]
) -> Curve | None:
    """Return a motion along a curve within limits, none of which bounds a jerk.

    Args:
        curve: The path.
        limits: The limits.
        accepted: Whether a motion may be made, e.g. because it is certified free of contact.

    Returns:
        A cubic spline of the time [s], at rest at both ends; None if none is accepted, with few
        samples or with all.
    """
    steady = _Timing.of(curve, limits.velocity, limits.acceleration)
    for sparse in (True, False):
        slower = 1.0
        while True:
            motion = _spline(steady, slower, limits, sparse=sparse)
            excess = limits.slowing(motion)
            if excess <= 1.0:
                break
            slower *= excess * (1.0 + 1e-9)
        if accepted(motion):
            return motion
    return None


def timed(
    curve: Curve, velocity: FloatArray, acceleration: FloatArray, sample_seconds: float
) -> Timed:
    """Return samples of a timing, evenly in time: at these it keeps the limits.

    Args:
        curve: The path.
        velocity: Velocity limits [rad/s], shape (7,).
        acceleration: Acceleration limits [rad/s^2], shape (7,).
        sample_seconds: Greatest time between two samples [s].
    """
    steady = _Timing.of(curve, velocity, acceleration)
    samples = max(2, int(np.ceil(steady.ends[-1] / sample_seconds)) + 1)
    times = np.linspace(0.0, steady.ends[-1], samples)
    return Timed(times, *steady.at(times))


@dataclass(frozen=True, eq=False)
class _Timing:
    """The fastest timing of a curve for straight lines: its parameter as a function of time."""

    curve: Curve
    piece: IntArray
    """Piece of each interval, shape (n,)."""
    begin: FloatArray
    """Begin of each interval as a fraction of its piece, shape (n,)."""
    lengths: FloatArray
    """Length of the piece of each interval in the parameter, shape (n,)."""
    rates: FloatArray
    """Rate of the parameter at both ends of each interval [1/s], shape (n + 1,)."""
    ends: FloatArray
    """Time at both ends of each interval [s], shape (n + 1,)."""

    @classmethod
    def of(cls, curve: Curve, velocity: FloatArray, acceleration: FloatArray) -> _Timing:
        """Time a curve, within limits as those of `timed`."""
        count = max(LEAST_INTERVALS, INTERVALS // curve.pieces)
        steps = np.repeat(np.diff(curve.knots) / count, count)
        piece = np.repeat(np.arange(curve.pieces), count)
        begin = np.tile(np.arange(count) / count, curve.pieces)
        squares = _squared_rates(curve, piece, begin, steps, velocity, acceleration)
        rates = np.sqrt(squares)
        ends = np.concatenate([[0.0], np.cumsum(2.0 * steps / (rates[:-1] + rates[1:]))])
        return cls(curve, piece, begin, np.diff(curve.knots)[piece], rates, ends)

    @property
    def switches(self) -> IntArray:
        """Numbers of the interval ends at which the derivative of the rate jumps."""
        change = np.diff(self.rates) / np.diff(self.ends)
        jumps = np.abs(np.diff(change)) > SWITCH * np.max(np.abs(change))
        return np.flatnonzero(jumps) + 1

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return joint angles [rad] and velocities [rad/s] at times [s], shapes (n, 7).

        Args:
            times: The first and the last are both ends of the motion, shape (n,).
        """
        curve, ends, rates = self.curve, self.ends, self.rates
        interval = np.clip(np.searchsorted(ends, times, side="right") - 1, 0, len(ends) - 2)
        within = times - ends[interval]
        change = (rates[interval + 1] - rates[interval]) / (ends[interval + 1] - ends[interval])
        along = within * (rates[interval] + 0.5 * change * within)
        rate = rates[interval] + change * within
        rate[[0, -1]] = 0.0
        fraction = np.minimum(self.begin[interval] + along / self.lengths[interval], 1.0)
        positions, first, _ = curve.derivatives(self.piece[interval], fraction)
        positions[0], positions[-1] = curve.q[0], curve.q[-1]
        return positions, first * rate[:, None]


def _spline(steady: _Timing, slower: float, limits: MotionLimits, *, sparse: bool) -> Curve:
    """Return the cubic spline through samples of a timing.

    Args:
        steady: The timing.
        slower: Factor of its time.
        limits: Where cubics are within these, samples between are left out.
        sparse: Whether any are left out.
    """
    ends = slower * steady.ends
    parts = np.ceil(np.diff(ends) / SAMPLE_SECONDS).astype(np.int64)
    fine = [
        np.linspace(a, b, n, endpoint=False)
        for a, b, n in zip(ends[:-1], ends[1:], parts, strict=True)
    ]
    times = np.unique(np.append(np.concatenate(fine), ends[-1]).round(DECIMALS))
    positions, velocities = steady.at(times / slower)
    velocities /= slower
    switches = np.searchsorted(times, ends[steady.switches].round(DECIMALS))
    kept = [0]
    while kept[-1] < len(times) - 1:
        first = kept[-1]
        last = int(np.searchsorted(times, times[first] + SAMPLE_SECONDS, side="right")) - 1
        # A cubic past a switch would be faster than both sides of it.
        last = int(min([last, *switches[switches > first][:1]]))
        kept.append(first + 1)
        if sparse and last > first + 1:
            kept[-1] = _farthest(times, positions, velocities, limits, first, last)
    times, positions, velocities = times[kept], positions[kept], velocities[kept]
    _keep_within_limits(times, positions, velocities, limits)
    # Adding 0.0 turns -0.0 into 0.0.
    return Curve(times, positions + 0.0, velocities + 0.0)


def _farthest(
    times: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
    limits: MotionLimits,
    first: int,
    last: int,
) -> int:
    """Return the last sample up to which the cubic from another is within the limits."""
    to = np.arange(last, first, -1)
    step = (times[to] - times[first])[:, None]
    q, v = positions[first], velocities[first]
    ends, arriving = positions[to], velocities[to]
    found = rates_between(step, q, v, ends, arriving)
    inner = np.array([q + step * v / 3.0, ends - step * arriving / 3.0])
    within = (
        (found.velocity <= SPARSE * limits.velocity)
        & (found.acceleration <= SPARSE * limits.acceleration)
        & np.all((inner >= limits.lower) & (inner <= limits.upper), axis=0)
    ).all(axis=1)
    return int(to[np.argmax(within)]) if within.any() else first + 1


def _keep_within_limits(
    times: FloatArray, positions: FloatArray, velocities: FloatArray, limits: MotionLimits
) -> None:
    """Reduce velocities such that the control points of all cubics are within the joint limits."""
    step = np.diff(times)[:, None]
    above = 3.0 * np.maximum(limits.upper - positions, 0.0)
    below = 3.0 * np.maximum(positions - limits.lower, 0.0)
    velocities[:-1] = np.clip(velocities[:-1], -below[:-1] / step, above[:-1] / step)
    velocities[1:] = np.clip(velocities[1:], -above[1:] / step, below[1:] / step)


def _squared_rates(
    curve: Curve,
    piece: IntArray,
    begin: FloatArray,
    steps: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> FloatArray:
    """Return the squared rate of the parameter at both ends of each interval [1/s^2].

    Args:
        curve: The path.
        piece: Piece of each interval, shape (n,).
        begin: Begin of each interval as a fraction of its piece, shape (n,).
        steps: Length of each interval in the parameter, shape (n,).
        velocity: Velocity limits [rad/s], shape (7,).
        acceleration: Acceleration limits [rad/s^2], shape (7,).

    Returns:
        Shape (n + 1,); 0 at both ends.
    """
    lengths = np.diff(curve.knots)[piece]
    at = np.array([begin + fraction * steps / lengths for fraction in INSIDE])
    derivatives = [curve.derivatives(piece, row) for row in at]
    first = np.abs([d[1] for d in derivatives]).max(axis=0)
    second = np.abs([d[2] for d in derivatives]).max(axis=0)
    with np.errstate(divide="ignore"):
        most = np.minimum(
            np.min((velocity / first) ** 2, axis=1),
            np.min(CURVATURE * acceleration / second, axis=1),
        )
    most = np.minimum(most, curve.fastest**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = acceleration - np.where(second > 0.0, second * most[:, None], 0.0)
        change = 2.0 * steps * np.min(left / first, axis=1)
    squares: FloatArray = np.minimum(np.append(most, 0.0), np.concatenate([[0.0], most]))
    for n in range(len(steps)):
        squares[n + 1] = min(squares[n + 1], squares[n] + change[n])
    for n in range(len(steps) - 1, -1, -1):
        squares[n] = min(squares[n], squares[n + 1] + change[n])
    return squares

"""Timing of curves within velocity and acceleration limits, from standstill to standstill.

The squared rate x of a curve's parameter is bounded everywhere, then reduced until it can be
reached from both ends, in one pass from each (Bobrow, Dubowsky, Gibson 1985). On an interval of the
parameter the rate has a constant derivative u, so that joint k moves with velocity q'_k sqrt(x) and
acceleration q'_k u + q''_k x. Drake's TOPP-RA finds no timing for some of our curves, whose
second derivative jumps where straight pieces meet rounded corners.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.motion.curves import Curve

INTERVALS, LEAST_INTERVALS = 240, 12
"""Number of intervals of the parameter on a curve, and the least on each of its pieces."""
INSIDE = np.array([0.0, 0.5, 1.0])
"""Points of each interval at which the limits are imposed, as fractions of it."""
CURVATURE = 0.7
"""Fraction of the acceleration limit that the curvature of the path may take up; the rest is left
to change the rate."""
SAMPLE_SECONDS = 0.05
"""Greatest time between two samples of a motion [s]."""


@dataclass(frozen=True, eq=False)
class Timed:
    """A curve as a function of time, sampled."""

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


def timed(
    curve: Curve,
    velocity: FloatArray,
    acceleration: FloatArray,
    sample_seconds: float = SAMPLE_SECONDS,
) -> Timed:
    """Return a timing within the limits, the fastest for straight lines.

    Args:
        curve: The path.
        velocity: Velocity limits [rad/s], shape (7,).
        acceleration: Acceleration limits [rad/s^2], shape (7,).
        sample_seconds: Greatest time between two samples [s].
    """
    count = max(LEAST_INTERVALS, INTERVALS // curve.pieces)
    steps = np.repeat(np.diff(curve.knots) / count, count)
    piece = np.repeat(np.arange(curve.pieces), count)
    begin = np.tile(np.arange(count) / count, curve.pieces)
    squares = _squared_rates(curve, piece, begin, steps, velocity, acceleration)
    rates = np.sqrt(squares)
    durations = 2.0 * steps / (rates[:-1] + rates[1:])
    ends = np.concatenate([[0.0], np.cumsum(durations)])
    samples = max(2, int(np.ceil(ends[-1] / sample_seconds)) + 1)
    times = np.linspace(0.0, ends[-1], samples)
    interval = np.clip(np.searchsorted(ends, times, side="right") - 1, 0, len(steps) - 1)
    within = times - ends[interval]
    change = (rates[interval + 1] - rates[interval]) / durations[interval]
    along = within * (rates[interval] + 0.5 * change * within)
    rate = rates[interval] + change * within
    rate[[0, -1]] = 0.0
    fraction = np.minimum(begin[interval] + along / (steps[interval] * count), 1.0)
    positions, first, _ = _derivatives(curve, piece[interval], fraction)
    positions[0], positions[-1] = curve.q[0], curve.q[-1]
    return Timed(times, positions, first * rate[:, None])


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
    derivatives = [_derivatives(curve, piece, row) for row in at]
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


def _derivatives(
    curve: Curve, piece: IntArray, fraction: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return joint angles and their first two derivatives by the parameter, shapes (n, 7).

    Args:
        curve: The path.
        piece: Number of the piece at each point, shape (n,).
        fraction: Fraction of the piece, shape (n,).
    """
    length = np.diff(curve.knots)[piece][:, None]
    t = np.asarray(fraction)[:, None]
    u = 1.0 - t
    a, d = curve.q[piece], curve.q[piece + 1]
    b, c = a + length * curve.dq[piece] / 3.0, d - length * curve.dq[piece + 1] / 3.0
    position = u**3 * a + 3 * u**2 * t * b + 3 * u * t**2 * c + t**3 * d
    first = 3.0 * (u**2 * (b - a) + 2 * u * t * (c - b) + t**2 * (d - c)) / length
    second = 6.0 * (u * (c - 2 * b + a) + t * (d - 2 * c + b)) / length**2
    return position, first, second

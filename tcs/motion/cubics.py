"""The cubics between the samples of a motion, from their coefficients: what a re-check measures.

Planning computes its limits otherwise, so that a fault there is found here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.motion.timing import Timed

AT_ONCE = 1e-6
"""Time within which the acceleration counts as changed where it jumps [s]."""


class Extremes(NamedTuple):
    """Greatest and least values of the joints on a motion, each of shape (n,) for n joints."""

    least: FloatArray
    """Least angles [rad]."""
    greatest: FloatArray
    """Greatest angles [rad]."""
    velocity: FloatArray
    """Greatest absolute velocities [rad/s]."""
    acceleration: FloatArray
    """Greatest absolute accelerations [rad/s^2]."""
    jerk: FloatArray
    """Greatest absolute jerks, rest before and after the motion included [rad/s^3]."""


def extremes(timing: Timed) -> Extremes:
    """Return the extremes of a motion, from the roots of the derivatives of its cubics."""
    h, v, b, c = _coefficients(timing)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b**2 - 3.0 * c * v)
        # Without cancellation: the product of the roots of v + 2 b t + 3 c t^2 is v / (3 c).
        far = -(b + np.copysign(root, b))
        turns = np.array([far / (3.0 * c), v / far, -b / (3.0 * c)])
    turns = np.where(np.isfinite(turns), np.clip(turns, 0.0, h), 0.0)
    at = np.concatenate([turns, np.zeros((1, *v.shape)), np.broadcast_to(h, (1, *v.shape))])
    angles = timing.positions[:-1] + at * (v + at * (b + at * c))
    velocities = v + at * (2.0 * b + 3.0 * at * c)
    begin, end = 2.0 * b, 2.0 * b + 6.0 * c * h
    at_rest = np.zeros((1, v.shape[1]))
    jumps = np.concatenate([begin, at_rest]) - np.concatenate([at_rest, end])
    jerk = np.concatenate([6.0 * c, jumps / AT_ONCE])
    return Extremes(
        least=angles.min(axis=(0, 1)),
        greatest=angles.max(axis=(0, 1)),
        velocity=np.abs(velocities).max(axis=(0, 1)),
        acceleration=np.abs([begin, end]).max(axis=(0, 1)),
        jerk=np.abs(jerk).max(axis=0),
    )


def at_times(timing: Timed, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return joint angles [rad] and velocities [rad/s] of a motion at times [s], shapes (n, 7)."""
    n = np.clip(np.searchsorted(timing.times, times, side="right") - 1, 0, len(timing.times) - 2)
    _, v, b, c = (each[n] for each in _coefficients(timing))
    t = (times - timing.times[n])[:, None]
    return timing.positions[n] + t * (v + t * (b + t * c)), v + t * (2.0 * b + 3.0 * t * c)


def _coefficients(timing: Timed) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return h, v, b and c: until h [s], shape (n, 1), the angles are q + v t + b t^2 + c t^3."""
    h = np.diff(timing.times)[:, None]
    change, v, w = np.diff(timing.positions, axis=0), timing.velocities[:-1], timing.velocities[1:]
    b = 3.0 * change / h**2 - (2.0 * v + w) / h
    c = (v + w) / h**2 - 2.0 * change / h**3
    return h, v, b, c

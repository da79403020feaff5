"""Curves in joint space: cubic Hermite splines, continuous in position and direction."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray

CHAIN = 7
"""Number of joints of the kernel's chain."""


def in_chain(joints: FloatArray, fill: float = 0.0) -> FloatArray:
    """Return values of an arm's joints as those of the kernel's chain, which has seven.

    Args:
        joints: One value for each joint of the arm, shape (..., n).
        fill: That of the joints that the arm lacks, which come first.

    Returns:
        Shape (..., 7).
    """
    lacking = np.full((*joints.shape[:-1], CHAIN - joints.shape[-1]), fill)
    return np.concatenate([lacking, joints], axis=-1)


@dataclass(frozen=True, eq=False)
class Curve:
    """A cubic Hermite spline of joint angles [rad], of positions [m] where joints are prismatic.

    Shapes are those of the kernel's chain, of seven joints; the motions of a plan have those of the
    arm alone.
    """

    knots: FloatArray
    """Parameter at each knot, ascending from 0, shape (n,)."""
    q: FloatArray
    """Joint angles at each knot [rad], shape (n, 7)."""
    dq: FloatArray
    """Derivative of the joint angles by the parameter at each knot, shape (n, 7)."""
    fastest: float = math.inf
    """Greatest derivative of the parameter by time [1/s]."""

    @property
    def pieces(self) -> int:
        """Number of cubic pieces."""
        return len(self.knots) - 1

    def control_points(self, piece: int) -> FloatArray:
        """Return the Bezier control points of a piece [rad], shape (4, 7)."""
        third = (self.knots[piece + 1] - self.knots[piece]) / 3.0
        start, end = self.q[piece], self.q[piece + 1]
        inner = start + third * self.dq[piece], end - third * self.dq[piece + 1]
        return np.array([start, *inner, end])

    def points(self, piece: int, fractions: FloatArray) -> FloatArray:
        """Return points of a piece [rad], shape (n, 7), at fractions of it, shape (n,)."""
        t = np.asarray(fractions)[:, None]
        a, b, c, d = self.control_points(piece)
        u = 1.0 - t
        return np.asarray(u**3 * a + 3 * u**2 * t * b + 3 * u * t**2 * c + t**3 * d)

    def derivatives(
        self, piece: IntArray, fraction: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return joint angles and their first two derivatives by the parameter, shapes (n, 7).

        Args:
            piece: Number of the piece at each point, shape (n,).
            fraction: Fraction of the piece, shape (n,).
        """
        length = np.diff(self.knots)[piece][:, None]
        t = np.asarray(fraction)[:, None]
        u = 1.0 - t
        a, d = self.q[piece], self.q[piece + 1]
        b, c = a + length * self.dq[piece] / 3.0, d - length * self.dq[piece + 1] / 3.0
        position = u**3 * a + 3 * u**2 * t * b + 3 * u * t**2 * c + t**3 * d
        first = 3.0 * (u**2 * (b - a) + 2 * u * t * (c - b) + t**2 * (d - c)) / length
        second = 6.0 * (u * (c - 2 * b + a) + t * (d - 2 * c + b)) / length**2
        return position, first, second

    def in_chain(self) -> Curve:
        """Return the same curve with the joints of the kernel's chain, which remain at 0."""
        return replace(self, q=in_chain(self.q), dq=in_chain(self.dq))

    def reverse(self) -> Curve:
        """Return the same curve from its end to its begin."""
        knots = self.knots[-1] - self.knots[::-1]
        return replace(self, knots=knots, q=self.q[::-1].copy(), dq=-self.dq[::-1])

    def shifted(self, offset: FloatArray) -> Curve:
        """Return the curve with full turns added to its joints without limits [rad]."""
        return replace(self, q=self.q + offset)

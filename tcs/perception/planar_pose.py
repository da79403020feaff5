"""Poses on the floor: position and heading of one frame in another."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.kernel.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class PlanarPose:
    """Pose X_AB of a frame B on the floor, in a frame A with parallel z axes."""

    x: float
    """x of the origin of B in A [m]."""
    y: float
    """y of the origin of B in A [m]."""
    yaw: float
    """Heading of B in A [rad]."""

    @property
    def R(self) -> FloatArray:
        """Rotation from B to A, shape (2, 2)."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[c, -s], [s, c]])

    @property
    def p(self) -> FloatArray:
        """Origin of B in A [m], shape (2,)."""
        return np.array([self.x, self.y])

    def __matmul__(self, other: PlanarPose) -> PlanarPose:
        """Return X_AC = X_AB X_BC."""
        x, y = self.points(other.p)
        return PlanarPose(float(x), float(y), wrapped(self.yaw + other.yaw))

    def inverse(self) -> PlanarPose:
        """Return X_BA.

        >>> there = PlanarPose(1.0, 2.0, 0.5)
        >>> there @ there.inverse() == PlanarPose(0.0, 0.0, 0.0)
        True
        """
        x, y = -self.p @ self.R
        return PlanarPose(float(x), float(y), wrapped(-self.yaw))

    def points(self, p_B: FloatArray) -> FloatArray:
        """Return points of B in A [m], shape (..., 2)."""
        return np.asarray(p_B @ self.R.T + self.p)

    def to_json(self) -> dict[str, float]:
        """Return the pose as plain numbers, the heading in degrees."""
        return {
            "x": round(self.x, 9),
            "y": round(self.y, 9),
            "yaw_deg": round(math.degrees(self.yaw), 9),
        }


def wrapped(angle: float) -> float:
    """Return an angle wrapped to [-pi, pi] [rad]."""
    return math.remainder(angle, math.tau)


def moved(pose: PlanarPose, covariance: FloatArray, step: PlanarPose) -> FloatArray:
    """Return the covariance of X_AC = X_AB X_BC where X_BC is exact.

    Args:
        pose: X_AB.
        covariance: Covariance of x, y, yaw of X_AB [m, rad], shape (3, 3).
        step: X_BC.
    """
    x, y = pose.R @ step.p
    jacobian = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
    return np.asarray(jacobian @ covariance @ jacobian.T)

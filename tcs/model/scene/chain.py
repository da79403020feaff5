"""Link frames of the kernel's arm chain, chosen from the joint axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.lines import closest_points

AXES_MEET = 1e-6
"""Axes closer than this intersect [m]: far above the rounding of numbers in a URDF (1e-9), far
below any relevant motion of the tool."""

_PARALLEL = 1e-9
"""Squared sine of the angle below which two axes count as parallel: their intersection is
ill-conditioned there."""


@dataclass(frozen=True, slots=True)
class JointAxis:
    """A joint axis and the frame of the link it moves, all joints at zero.

    Attributes:
        R_AJ: Orientation of the joint frame J in the arm base A, shape (3, 3).
        p_AJ: Origin of J in A, a point on the axis [m], shape (3,).
        direction_J: Unit vector of the axis in J, shape (3,).
    """

    R_AJ: FloatArray
    p_AJ: FloatArray
    direction_J: FloatArray

    @property
    def direction_A(self) -> FloatArray:
        """Unit vector of the axis in A, shape (3,)."""
        return self.R_AJ @ self.direction_J


def link_frames(axes: tuple[JointAxis, ...]) -> tuple[FloatArray, FloatArray]:
    """Return the poses of link frames L1..L7 in the arm base A, all joints at zero.

    Each link frame rotates about its own z axis. Its origin is that of the joint frame, except
    where the closed form requires the intersection of axes: L2 and L3 are at the intersection of
    axes 2 and 3; L5, L6 and L7 at that of axes 5, 6 and 7 (spherical wrist). An arm without these
    intersections may have a spherical shoulder instead: then L1, L2 and L3 are at the intersection
    of axes 1, 2 and 3, and L5 and L6 at that of axes 5 and 6.

    Args:
        axes: The seven joint axes, in the order of the chain.

    Returns:
        Rotations (7, 3, 3) and origins (7, 3) [m].
    """
    R_AL = np.stack([axis.R_AJ @ _rotation_to_z(axis.direction_J) for axis in axes])
    p_AL = np.stack([axis.p_AJ for axis in axes])
    shoulder, wrist = meeting_points(axes[1], axes[2]), _common_points(*axes[4:7])
    if shoulder is None or wrist is None:
        round_shoulder, round_wrist = _common_points(*axes[0:3]), meeting_points(axes[4], axes[5])
        if round_shoulder is not None and round_wrist is not None:
            p_AL[0:3], p_AL[4:6] = round_shoulder, round_wrist
            return R_AL, p_AL
    if shoulder is not None:
        p_AL[1:3] = shoulder
    if wrist is not None:
        p_AL[4:7] = wrist
    return R_AL, p_AL


def _common_points(
    first: JointAxis, middle: JointAxis, last: JointAxis
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return the intersection of three consecutive axes, a point on each in A [m], or None."""
    # The outer two may be parallel at zero, so each is intersected with the middle one, which is
    # well conditioned.
    inner, outer = meeting_points(first, middle), meeting_points(last, middle)
    if inner is None or outer is None or np.linalg.norm(inner[1] - outer[1]) >= AXES_MEET:
        return None
    return inner[0], inner[1], outer[0]


def meeting_points(first: JointAxis, second: JointAxis) -> tuple[FloatArray, FloatArray] | None:
    """Return the intersection of two axes, expressed in A [m], or None if they are skew.

    Axes given by rounded numbers do not intersect exactly, so the result is one point on each axis:
    every link origin remains on its own axis, and the chain remains exact.

    >>> z = JointAxis(np.eye(3), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    >>> x = JointAxis(np.eye(3), np.array([5.0, 0.0, 2.0]), np.array([1.0, 0.0, 0.0]))
    >>> [point.tolist() for point in meeting_points(z, x)]
    [[0.0, 0.0, 2.0], [0.0, 0.0, 2.0]]
    """
    a, b = first.direction_A, second.direction_A
    offset = second.p_AJ - first.p_AJ
    cosine = float(a @ b)
    sine_squared = 1.0 - cosine * cosine
    if sine_squared < _PARALLEL:
        return None
    along = closest_points(a, b, offset, sine_squared)
    on_first = first.p_AJ + along[0] * a
    on_second = second.p_AJ + along[1] * b
    if np.linalg.norm(on_first - on_second) >= AXES_MEET:
        return None
    return on_first, on_second


def _rotation_to_z(direction: FloatArray) -> FloatArray:
    """Return a rotation whose z column is `direction`, shape (3, 3).

    For an axis along x, y or z it is a cyclic permutation of exact zeros and ones, so the chain has
    no rounding errors.
    """
    largest = int(np.argmax(np.abs(direction)))
    z = direction / np.linalg.norm(direction)
    helper = np.zeros(3)
    helper[(largest + 1) % 3] = 1.0
    x = helper - (helper @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])

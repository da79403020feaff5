"""End-effector control: from a tool velocity to joint rates (null-space paper, eqs. 6-8)."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.teleop.control.least_squares import bounded_minimum

_CUTOFF = 1e-9
"""Singular values below this share of the largest count as zero, as in any pseudo-inverse."""
_REGULAR = 1e-8
"""What is added to the squared singular values [m^2/rad^2] where joints are held at limits, so
that the answer is unique: 1e-5 of the motion at a singular value of 0.03, which the feedback of
the pose error makes up for."""
_FLIPPED = -0.999
"""Cosine of a turn so near to half a turn that its axis cannot be read off the skew part."""


def rotation_vector(R: FloatArray) -> FloatArray:
    """Return axis times angle of a rotation [rad], shape (3,).

    Args:
        R: Rotation, shape (3, 3).
    """
    skew = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    cosine = 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0)
    if cosine < _FLIPPED:
        vector: FloatArray = Rotation.from_matrix(R).as_rotvec()
        return vector
    sine = 0.5 * math.sqrt(skew @ skew)
    # sin(a) / a is 1 to rounding below that angle.
    factor = 0.5 if sine < 1e-8 else 0.5 * math.atan2(sine, cosine) / sine
    return factor * skew


def pose_error(
    R_target: FloatArray, p_target: FloatArray, R: FloatArray, p: FloatArray
) -> FloatArray:
    """Return the motion that takes the tool to its target: Delta x of eq. (7).

    The print subtracts quaternions. That difference is no angular velocity: it is half of one,
    turned into the four dimensions of the quaternion, it depends on which of the two quaternions
    of the same orientation came out, and a 6 x 7 Jacobian has no fourth row for it. The rotation
    vector is what the angular rows of J are about: turning about it at unit rate for the length
    of the vector brings the tool to its target on the shortest way.

    Args:
        R_target: Orientation to come to, in the base, shape (3, 3).
        p_target: Position to come to [m], shape (3,).
        R: Orientation of the tool, shape (3, 3).
        p: Position of the tool [m], shape (3,).

    Returns:
        Rotation vector [rad], then translation [m], in the base, shape (6,).
    """
    error = np.empty(6)
    error[:3] = rotation_vector(R_target @ R.T)
    error[3:] = p_target - p
    return error


def rotated(R: FloatArray, twist: FloatArray, time: float) -> FloatArray:
    """Return an orientation after turning for a time.

    Args:
        R: Orientation, shape (3, 3).
        twist: Angular velocity in the frame that R is in [rad/s], shape (3,).
        time: How long [s].
    """
    turn = twist * time
    angle = math.sqrt(turn @ turn)
    if angle == 0.0:
        return R
    x, y, z = turn / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # Rodrigues' formula, applied to R.
    KR = K @ R
    return R + math.sin(angle) * KR + (1.0 - math.cos(angle)) * (K @ KR)


def smallest_singular_value(jacobian: FloatArray, length: float) -> float:
    """Return how far a task is from being singular [m/rad].

    Args:
        jacobian: Shape (6, 7), angular rows first, or the three linear rows, (3, 7).
        length: What a turn of 1 rad counts [m].
    """
    return float(np.linalg.svd(_weighted(jacobian, length), compute_uv=False)[-1])


def resolved_rates(
    jacobian: FloatArray,
    twist: FloatArray,
    *,
    length: float = 1.0,
    damping: float = 0.0,
    singular: float = 0.0,
) -> tuple[FloatArray, float]:
    """Return joint rates that move the tool as command, the smallest there are: eq. (7).

    Without damping, that is the pseudo-inverse of the full Jacobian. With it, close to a
    singularity, the squared singular values s^2 are raised by `damping^2 (1 - (s_min /
    singular)^2)`: rates stay bounded, and the tool lags behind in the direction that is lost
    (Nakamura and Hanafusa 1986; Maciejewski and Klein 1988).

    Args:
        jacobian: Shape (6, 7), rows angular then linear [rad/rad; m/rad], or its last three.
        twist: Velocity of the tool [rad/s; m/s], shape (6,) or (3,).
        length: What a turn of 1 rad counts [m], for damping and singular value.
        damping: Greatest damping [m/rad]; 0 for none.
        singular: Smallest singular value below which it begins [m/rad].

    Returns:
        Joint rates [rad/s], shape (7,), and the smallest singular value [m/rad].
    """
    U, s, Vt = np.linalg.svd(_weighted(jacobian, length), full_matrices=False)
    smallest = float(s[-1])
    wanted = _weighted(twist, length) @ U
    if damping > 0.0 and smallest < singular:
        damped = damping * damping * (1.0 - (smallest / singular) ** 2)
        inverse = s / (s * s + damped)
    else:
        inverse = np.where(s > _CUTOFF * s[0], 1.0 / np.maximum(s, 1e-300), 0.0)
    return (inverse * wanted) @ Vt, smallest


def clamped_rates(
    jacobian: FloatArray,
    twist: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    *,
    length: float,
    damping: float = 0.0,
) -> tuple[FloatArray, BoolArray]:
    """Return joint rates between bounds that come closest to the required tool velocity.

    A joint that would run into its limit stays at its bound, and the others take over its part
    as far as they can: with six joints left the tool still moves as commanded; with fewer, the
    difference is shared between turning and moving by `length`.

    Args:
        jacobian: Shape (6, 7), rows angular then linear [rad/rad; m/rad], or its last three.
        twist: Velocity of the tool [rad/s; m/s], shape (6,) or (3,).
        lower: Lowest rates [rad/s], shape (7,).
        upper: Highest rates [rad/s], shape (7,).
        length: What a turn of 1 rad counts [m].
        damping: Damping [m/rad].

    Returns:
        Joint rates [rad/s], shape (7,), and which joints are held at a bound, shape (7,).
    """
    J = _weighted(jacobian, length)
    hessian = J.T @ J
    hessian.flat[:: len(hessian) + 1] += _REGULAR + damping * damping
    return bounded_minimum(hessian, _weighted(twist, length) @ J, lower, upper)


def _weighted(rows: FloatArray, length: float) -> FloatArray:
    """Return a Jacobian or a twist with turns counted as ways; one without angular rows as is."""
    if len(rows) == 3 or length == 1.0:
        return rows
    weighed = rows.copy()
    weighed[:3] *= length
    return weighed

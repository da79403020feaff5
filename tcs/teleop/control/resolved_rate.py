"""End-effector control: from a tool velocity to joint rates (null-space paper, eqs. 6-8)."""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.teleop.control.least_squares import bounded_minimum

_CUTOFF = 1e-9
"""Singular values below this fraction of the largest count as zero, as in any pseudo-inverse."""
_REGULAR = 1e-8
"""Regularisation of the squared singular values [m^2/rad^2] where joints are held at limits, which
makes the solution unique: it costs 1e-5 of the motion at a singular value of 0.03, which the
feedback of the pose error compensates."""
_FLIPPED = -0.999
"""Cosine of a rotation angle so close to 180 degrees that the skew part does not give the axis."""


def rotation_vector(R: FloatArray) -> FloatArray:
    """Return the rotation vector, axis times angle [rad], shape (3,).

    Args:
        R: Rotation, shape (3, 3).
    """
    skew = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    cosine = 0.5 * (R[0, 0] + R[1, 1] + R[2, 2] - 1.0)
    if cosine < _FLIPPED:
        vector: FloatArray = Rotation.from_matrix(R).as_rotvec()
        return vector
    sine = 0.5 * math.sqrt(skew @ skew)
    # Below that angle sin(a) / a equals 1 within rounding.
    factor = 0.5 if sine < 1e-8 else 0.5 * math.atan2(sine, cosine) / sine
    return factor * skew


def pose_error(
    R_target: FloatArray, p_target: FloatArray, R: FloatArray, p: FloatArray
) -> FloatArray:
    """Return the displacement from the tool to its target: Delta x of eq. (7).

    The paper subtracts quaternions. Their difference is not an angular velocity: it has four
    components for three angular rows of J, is half as large, and depends on which of the two
    quaternions of an orientation is used. The rotation vector corresponds to the angular rows: a
    rotation about it at 1 rad/s for its length in seconds takes the tool to its target along the
    shortest path.

    Args:
        R_target: Target orientation in the base, shape (3, 3).
        p_target: Target position in the base [m], shape (3,).
        R: Orientation of the tool in the base, shape (3, 3).
        p: Position of the tool in the base [m], shape (3,).

    Returns:
        Rotation vector [rad], then translation [m], in the base, shape (6,).
    """
    error = np.empty(6)
    error[:3] = rotation_vector(R_target @ R.T)
    error[3:] = p_target - p
    return error


def rotated(R: FloatArray, twist: FloatArray, time: float) -> FloatArray:
    """Return an orientation after rotation at a constant angular velocity.

    Args:
        R: Orientation, shape (3, 3).
        twist: Angular velocity in the frame in which R is expressed [rad/s], shape (3,).
        time: Duration [s].
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
    """Return the smallest singular value of the Jacobian of a task [m/rad].

    Args:
        jacobian: Shape (6, 7), angular rows first, or the three linear rows, (3, 7).
        length: Distance that has the weight of a rotation of 1 rad [m].
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
    """Return the smallest joint rates that move the tool as commanded: eq. (7).

    Without damping they are given by the pseudo-inverse of the Jacobian. With damping, close to a
    singularity, the squared singular values s^2 are increased by `damping^2 (1 - (s_min /
    singular)^2)`: rates remain bounded, and the tool lags in the singular direction (Nakamura and
    Hanafusa 1986; Maciejewski and Klein 1988).

    Args:
        jacobian: Shape (6, 7), rows angular then linear [rad/rad; m/rad], or its last three.
        twist: Velocity of the tool [rad/s; m/s], shape (6,) or (3,).
        length: Distance that has the weight of a rotation of 1 rad [m], for damping and singular
            value.
        damping: Greatest damping [m/rad]; 0 for none.
        singular: Smallest singular value below which damping begins [m/rad].

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
    """Return the joint rates within bounds that come closest to the required tool velocity.

    A joint that would exceed its limit stays at its bound, and the other joints compensate as far
    as they can: with six joints the tool still moves as commanded; with fewer, `length` divides the
    error between rotation and translation.

    Args:
        jacobian: Shape (6, 7), rows angular then linear [rad/rad; m/rad], or its last three.
        twist: Velocity of the tool [rad/s; m/s], shape (6,) or (3,).
        lower: Lowest rates [rad/s], shape (7,).
        upper: Highest rates [rad/s], shape (7,).
        length: Distance that has the weight of a rotation of 1 rad [m].
        damping: Damping [m/rad].

    Returns:
        Joint rates [rad/s], shape (7,), and which joints are held at a bound, shape (7,).
    """
    J = _weighted(jacobian, length)
    hessian = J.T @ J
    hessian.flat[:: len(hessian) + 1] += _REGULAR + damping * damping
    return bounded_minimum(hessian, _weighted(twist, length) @ J, lower, upper)


def _weighted(rows: FloatArray, length: float) -> FloatArray:
    """Return a Jacobian or twist with its angular rows times `length`; unchanged without any."""
    if len(rows) == 3 or length == 1.0:
        return rows
    weighed = rows.copy()
    weighed[:3] *= length
    return weighed

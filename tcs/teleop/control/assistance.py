"""Assisted control: the tool follows the command, the posture avoids limits and singularities."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from pydrake.multibody.inverse_kinematics import (
    DifferentialInverseKinematicsParameters,
    DifferentialInverseKinematicsStatus,
    DoDifferentialInverseKinematics,
)

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import JOINTS, Arm
from tcs.teleop.control.least_squares import bounded_minimum
from tcs.teleop.control.settings import Command
from tcs.teleop.control.state import (
    ControlState,
    RateCommand,
    commanded_twist,
    range_fraction,
    stop_reason,
)

_ORIENTATION = 0.02
"""Distance that has the weight of a rotation of 1 rad [m]: where both are not possible, the tool
follows the commanded position and loses as little orientation as possible."""
_POSTURE = 0.01
"""Velocity of the tool that has the weight of a joint rate of 1 rad/s [m/s]: in a trade-off, the
tool loses 1 % of its motion at a singular value of 0.1 m/rad, which the feedback compensates, and
half of its rotation at 0.5 rad/rad."""
_CORRECTION = 0.3
"""Greatest angular velocity that recovers a lost orientation [rad/s]: at its weight, it costs less
than 0.1 mm of position."""
_LIMITS = 0.05
"""Gain of the limit barrier [rad/s]: a joint at 90 % of the distance from the middle of a range of
5 rad to its limit gets 1 rad/s, more than `assist_rate`; at 50 %, 0.04 rad/s."""
_ISOTROPY = 0.2
"""Gain of the gradient of the logarithm of isotropy [rad^2/s]: a gradient of 1/rad gives this joint
rate."""
_URGENT = 3.0
"""Greatest joint rate of the assistance, relative to `assist_rate`, where it costs orientation."""
_CENTRING = 0.1
"""Gain of Drake's joint centring [1/s]: a joint 2 rad from its middle moves at 0.2 rad/s."""


def assisted(command: Command, state: ControlState) -> RateCommand:
    """Move the tool while the redundancy keeps the posture away from limits and singularities.

    Each step solves one bounded least squares problem: tool position first, orientation second
    (`_ORIENTATION`), then the posture (`posture_rates`); joint limits and velocities are hard
    bounds. A joint at its limit thus degrades posture first, then orientation, and position last.
    """
    settings = state.settings
    twist = commanded_twist(command)
    back = settings.gain * state.error
    rotation_rate = math.sqrt(back[:3] @ back[:3])
    if rotation_rate > _CORRECTION:
        back[:3] *= _CORRECTION / rotation_rate
    wanted = twist + back
    J = state.jacobian.copy()
    J[:3] *= _ORIENTATION
    wanted[:3] *= _ORIENTATION
    hessian = J.T @ J
    hessian.flat[:: JOINTS + 1] += _POSTURE**2
    slope = wanted @ J
    # Without a command the assistance does not move the arm.
    if twist.any() and settings.assist_rate > 0.0:
        slope += _POSTURE**2 * posture_rates(
            state.arm, state.joints, state.jacobian, settings.assist_rate
        )
    rates, held = bounded_minimum(hessian, slope, state.lower, state.upper)
    return RateCommand(rates, stop_reason(command, rates, held, state))


def posture_rates(arm: Arm, joints: FloatArray, jacobian: FloatArray, fastest: float) -> FloatArray:
    """Return joint rates that move the posture away from limits and singularities.

    They are the gradient of `_ISOTROPY * log(isotropy) - _LIMITS * sum 1 / (1 - x^2)`, where x in
    [-1, 1] is the position of a joint in its range: the limit barrier of Zghal, Dubey and Euler
    (1990), whose gradient is zero in the middle and infinite at the limits.

    Args:
        arm: The arm.
        joints: Joint positions [rad], shape (7,).
        jacobian: Jacobian of the tool, shape (6, 7).
        fastest: Greatest joint rate of the null-space part [rad/s]; all rates are scaled below
            `_URGENT` times that.

    Returns:
        Joint rates [rad/s], shape (7,).
    """
    x = 2.0 * range_fraction(arm, joints) - 1.0
    half = np.where(arm.bounded, 0.5 * (arm.upper - arm.lower), np.inf)
    # At a limit itself the barrier is infinite.
    margin = np.maximum(1.0 - x * x, 1e-6)
    inverse = _square_inverse(jacobian)
    pull = isotropy_gradient(jacobian, inverse)
    rates = _ISOTROPY * pull - (2.0 * _LIMITS) * x / (margin * margin * half)
    null_space_rate = float(np.abs(rates - (inverse @ (jacobian @ rates)) @ jacobian).max())
    largest = float(np.abs(rates).max())
    slower: FloatArray = rates * min(
        1.0, fastest / max(null_space_rate, 1e-300), _URGENT * fastest / max(largest, 1e-300)
    )
    return slower


def isotropy_gradient(jacobian: FloatArray, inverse: FloatArray | None = None) -> FloatArray:
    """Return the gradient of the logarithm of kinematic isotropy with respect to the joints.

    With isotropy det(J J^T)^(1/6) / (trace(J J^T) / 6) and D_i the derivative of J by joint i,
    entry i is tr(J^+ D_i) / 3 - 2 tr(J^T D_i) / tr(J J^T). Joint i rotates every link beyond it: if
    i < j, both halves of column j change by their cross products with axis_i; else only the linear
    half changes, by axis_j x linear_i.

    Args:
        jacobian: Jacobian of the tool, shape (6, 7).
        inverse: Inverse of J J^T, shape (6, 6); None to compute it.

    Returns:
        Gradient [1/rad], shape (7,); finite at a singularity, and directed away from it.
    """
    axes, linear = jacobian[:3], jacobian[3:]
    if inverse is None:
        inverse = _square_inverse(jacobian)
    flat = jacobian.ravel()
    weights = inverse @ jacobian / 3.0 - jacobian * (2.0 / float(flat @ flat))
    first, second = weights[:3], weights[3:]
    # axis_i . (column_j x weight_j) by the triple product, so that each cross product is used once.
    turned_axes, turned_linear = _cross(axes, first), _cross(linear, second)
    later = np.cumsum((turned_axes + turned_linear)[:, ::-1], axis=1)[:, ::-1]
    # For j < i: linear_i . (weight_j x axis_j).
    moved = _cross(second, axes)
    earlier = np.cumsum(moved, axis=1) - moved
    gradient: FloatArray = (axes * later).sum(axis=0) + (linear * earlier).sum(axis=0)
    return gradient


def _square_inverse(jacobian: FloatArray) -> FloatArray:
    """Return the inverse of J J^T, damped by a millionth so that it is finite at a singularity."""
    square = jacobian @ jacobian.T
    square.flat[::7] += 1e-6 * square.flat[::7].sum()
    return np.asarray(np.linalg.inv(square), dtype=np.float64)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross products of columns, shape (3, n)."""
    product = np.empty_like(a)
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]
    return product


def drake(command: Command, state: ControlState) -> RateCommand:
    """Move the tool by Drake's differential inverse kinematics: the baseline.

    Its quadratic program scales the tool's velocity down, keeping its direction, until position and
    velocity limits hold, and centres the joints in the null space.
    """
    settings = state.settings
    parameters = _drake_parameters(state.arm, settings.period)
    parameters.set_joint_velocity_limits((state.lower, state.upper))
    result = DoDifferentialInverseKinematics(
        state.joints,
        np.zeros(JOINTS),
        commanded_twist(command) + settings.gain * state.error,
        state.jacobian,
        parameters,
    )
    if result.status == DifferentialInverseKinematicsStatus.kNoSolutionFound:
        return RateCommand(np.zeros(JOINTS), "Drake finds no joint rates within the limits.")
    # The solver satisfies the bounds within its own tolerance.
    rates = np.clip(np.asarray(result.joint_velocities), state.lower, state.upper)
    stuck = result.status == DifferentialInverseKinematicsStatus.kStuck
    return RateCommand(
        rates, "Drake finds no motion: joint limits or a singularity." if stuck else ""
    )


@lru_cache(maxsize=16)
def _drake_parameters(arm: Arm, period: float) -> DifferentialInverseKinematicsParameters:
    """Return the parameters that are the same in every step."""
    parameters = DifferentialInverseKinematicsParameters(JOINTS, JOINTS)
    parameters.set_time_step(period)
    parameters.set_joint_position_limits((arm.lower, arm.upper))
    parameters.set_nominal_joint_position(np.where(arm.bounded, 0.5 * (arm.lower + arm.upper), 0.0))
    parameters.set_joint_centering_gain(np.diag(np.where(arm.bounded, _CENTRING, 0.0)))
    return parameters

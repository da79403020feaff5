"""The arm that looks after itself: the tool follows, the posture keeps away from what stops it."""

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
from tcs.teleop.control.state import ControlState, RateCommand, commanded_twist, stop_reason
from tcs.teleop.control.status import range_fraction

_ORIENTATION = 0.02
"""A turn of 1 rad weighs as much as this way [m]: where not both can be had, the tool goes where it
is asked to, and turns as little as that takes."""
_POSTURE = 0.01
"""A joint's rate of 1 rad/s weighs as much as this velocity [m/s]: where it comes to a choice, the
tool gives up 1 % of its motion at a singular value of 0.1 m/rad, which the feedback makes up for,
and half of its turning at 0.5 rad/rad."""
_CORRECTION = 0.3
"""Fastest turn with which a lost orientation comes back [rad/s]: at its weight, the position gives
way by less than 0.1 mm for it."""
_LIMITS = 0.05
"""How strongly limits push [rad/s]: a joint at 90 % of its way from the middle of a range of 5 rad
is sent back at 1 rad/s, more than `assist_rate`; at 50 %, at 0.04 rad/s."""
_ISOTROPY = 0.2
"""How strongly isotropy pulls [rad/s] where a radian would raise its logarithm by 1."""
_URGENT = 3.0
"""How much faster than `assist_rate` a limit may push where that costs orientation."""
_CENTRING = 0.1
"""Gain with which Drake's centring leads the joints to their middles [1/s]: one that is 2 rad off
moves at 0.2 rad/s."""


def assisted(asked: Command, now: ControlState) -> RateCommand:
    """Move the tool, and of all ways to do so take the one that keeps the posture sound.

    One least squares problem between bounds in each step: tool position first, orientation second
    (`_ORIENTATION`), then the posture's own wish (`posture_rates`); joint limits and velocities are
    bounds that no weight can outdo. So a joint that meets its limit first costs posture, then
    orientation, and only at last position.
    """
    settings = now.settings
    twist = commanded_twist(asked)
    back = settings.gain * now.error
    turn = math.sqrt(back[:3] @ back[:3])
    if turn > _CORRECTION:
        back[:3] *= _CORRECTION / turn
    wanted = twist + back
    J = now.jacobian.copy()
    J[:3] *= _ORIENTATION
    wanted[:3] *= _ORIENTATION
    hessian = J.T @ J
    hessian.flat[:: JOINTS + 1] += _POSTURE**2
    slope = wanted @ J
    # An arm that nobody drives does not move by itself.
    if twist.any():
        slope += _POSTURE**2 * posture_rates(
            now.arm, now.joints, now.jacobian, settings.assist_rate
        )
    rates, held = bounded_minimum(hessian, slope, now.lower, now.upper)
    return RateCommand(rates, stop_reason(asked, rates, held, now))


def posture_rates(arm: Arm, joints: FloatArray, jacobian: FloatArray, fastest: float) -> FloatArray:
    """Return the joint rates that would lead the posture away from limits and singularities.

    The gradient of `_ISOTROPY * log(isotropy) - _LIMITS * sum 1 / (1 - x^2)`, where x in [-1, 1]
    says how far a joint is from the middle of its range: the limit barrier of Zghal, Dubey and
    Euler (1990), zero in the middle and endless at the limits.

    Args:
        arm: The arm.
        joints: Joint positions [rad], shape (7,).
        jacobian: Of the tool, shape (6, 7).
        fastest: What the fastest joint is slowed down to in the part of the motion that no tool
            feels [rad/s]; the rest goes no faster than `_URGENT` times that.

    Returns:
        Shape (7,).
    """
    x = 2.0 * range_fraction(arm, joints) - 1.0
    half = np.where(arm.bounded, 0.5 * (arm.upper - arm.lower), np.inf)
    # At a limit itself the barrier is endless; a millionth inside, it is only far too strong.
    room = np.maximum(1.0 - x * x, 1e-6)
    inverse = _square_inverse(jacobian)
    pull = isotropy_gradient(jacobian, inverse)
    rates = _ISOTROPY * pull - (2.0 * _LIMITS) * x / (room * room * half)
    unfelt = float(np.abs(rates - (inverse @ (jacobian @ rates)) @ jacobian).max())
    largest = float(np.abs(rates).max())
    slower: FloatArray = rates * min(
        1.0, fastest / max(unfelt, 1e-300), _URGENT * fastest / max(largest, 1e-300)
    )
    return slower


def isotropy_gradient(jacobian: FloatArray, inverse: FloatArray | None = None) -> FloatArray:
    """Return the gradient of the logarithm of kinematic isotropy by the joints [1/rad].

    With isotropy det(J J^T)^(1/6) / (trace(J J^T) / 6) and D_i the change of J with joint i,
    entry i is tr(J^+ D_i) / 3 - 2 tr(J^T D_i) / tr(J J^T). Turning joint i turns all that lies
    beyond it: column j changes by axis_i x (both halves) if i comes before j; else only its
    linear half changes, by axis_j x linear_i.

    Args:
        jacobian: Shape (6, 7).
        inverse: That of J J^T, shape (6, 6); None works it out.

    Returns:
        Shape (7,); pulls out of a singularity, without growing endless at it.
    """
    axes, linear = jacobian[:3], jacobian[3:]
    if inverse is None:
        inverse = _square_inverse(jacobian)
    flat = jacobian.ravel()
    weights = inverse @ jacobian / 3.0 - jacobian * (2.0 / float(flat @ flat))
    first, second = weights[:3], weights[3:]
    # axis_i . (column_j x weight_j), as the triple product allows: the cross products come once.
    turned_axes, turned_linear = _cross(axes, first), _cross(linear, second)
    later = np.cumsum((turned_axes + turned_linear)[:, ::-1], axis=1)[:, ::-1]
    # For j < i: linear_i . (weight_j x axis_j).
    moved = _cross(second, axes)
    earlier = np.cumsum(moved, axis=1) - moved
    gradient: FloatArray = (axes * later).sum(axis=0) + (linear * earlier).sum(axis=0)
    return gradient


def _square_inverse(jacobian: FloatArray) -> FloatArray:
    """Return the inverse of J J^T, eased by a millionth so that it is finite at a singularity."""
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


def drake(asked: Command, now: ControlState) -> RateCommand:
    """Move the tool by Drake's own differential inverse kinematics: the baseline off the shelf.

    A quadratic program that scales the tool's velocity down, in its direction, to what position
    and velocity limits allow, and centres the joints in what is left.
    """
    settings = now.settings
    parameters = _drake_parameters(now.arm, settings.period)
    parameters.set_joint_velocity_limits((now.lower, now.upper))
    result = DoDifferentialInverseKinematics(
        now.joints,
        np.zeros(JOINTS),
        commanded_twist(asked) + settings.gain * now.error,
        now.jacobian,
        parameters,
    )
    if result.status == DifferentialInverseKinematicsStatus.kNoSolutionFound:
        return RateCommand(np.zeros(JOINTS), "Drake finds no joint rates within the limits.")
    # The solver keeps to the bounds within its own tolerance.
    rates = np.clip(np.asarray(result.joint_velocities), now.lower, now.upper)
    stuck = result.status == DifferentialInverseKinematicsStatus.kStuck
    return RateCommand(rates, "Drake finds no way on: limits or a singularity." if stuck else "")


@lru_cache(maxsize=16)
def _drake_parameters(arm: Arm, period: float) -> DifferentialInverseKinematicsParameters:
    """Return what stays the same from step to step."""
    parameters = DifferentialInverseKinematicsParameters(JOINTS, JOINTS)
    parameters.set_time_step(period)
    parameters.set_joint_position_limits((arm.lower, arm.upper))
    parameters.set_nominal_joint_position(np.where(arm.bounded, 0.5 * (arm.lower + arm.upper), 0.0))
    parameters.set_joint_centering_gain(np.diag(np.where(arm.bounded, _CENTRING, 0.0)))
    return parameters

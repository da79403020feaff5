"""Null-space control: motion of a joint group while the tool is held (paper, eqs. 10-14)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.teleop.arm import JOINTS
from tcs.teleop.control.least_squares import bounded_minimum

HELD = 1e-9
"""Greatest relative residual of the tool velocity with which a group alone holds the tool: a
thousand times the rounding of a Jacobian, and about the offset between axes of a URDF that should
intersect."""
_WEAK = 0.002
"""Singular value of the followers (the group's joints except the lead joint) [m/rad] below which
their rates are weighted: to hold a tool that the lead joint moves at 0.5 m/rad, they would have to
rotate 250 times as fast as the lead joint."""
_EASED = 0.3
"""Weight of a follower's rate relative to that of a joint outside the group, where the followers
cannot move the tool."""

_HOLDING = 1e6
"""Cost of a tool velocity of 1 m/s relative to a deviation of the lead joint's rate by 1 rad/s: a
lead joint that is blocked at a rate of 0.4 rad/s moves the tool by less than 0.01 mm/s."""
_RESTING = 1e-3
"""Cost of a rate of 1 rad/s outside the group relative to the same deviation: the lead joint slows
down by a thousandth where one such joint has to rotate as fast."""
_EASED_WITHIN = 1e-3
"""Cost of a follower's rate relative to that of a joint outside the group."""


@dataclass(frozen=True, slots=True, eq=False)
class GroupMotion:
    """Joint rates that move a joint group while the tool is held.

    Attributes:
        rates: Joint rates [rad/s], shape (7,).
        exact: Whether only joints of the group move.
        slip: Velocity error of the tool that no joint can compensate [m/s].
    """

    rates: FloatArray
    exact: bool
    slip: float


def group_motion(
    jacobian: FloatArray,
    group: tuple[int, ...],
    rate: float,
    velocity: FloatArray | None = None,
) -> GroupMotion:
    """Return the motion of a joint group in the null space: N_Jp xi of eq. (11).

    The paper solves 0 = J_p theta' (eq. 10) for a 7 x 4 basis whose columns move one joint group
    each (eq. 12), and does not specify how to compute it. Only the column of the commanded group is
    computed here, as xi has one entry that is not zero. The lead joint rotates at rate k, and of
    all motions that hold the tool we take the one in which the joints outside the group move least
    (least squares; of equal ones, the one with the smallest rates within the group). With L the
    lead joint, F the followers in its group, O the other joints, v the required tool velocity,

        w = v - J_L k,  N = 1 - J_F J_F^+,  r_O = (N J_O)^+ N w,  r_F = J_F^+ (w - J_O r_O).

    Where the group alone can hold the tool, N w = 0, and r_O is set to exactly zero. Where J_F
    loses rank, followers would need unbounded rates; there their rates are weighted as well, with a
    weight that increases continuously from 0 as their smallest singular value decreases.

    Args:
        jacobian: J_p, shape (3, 7) [m/rad].
        group: Joints of the group, counted from 0, its lead joint first.
        rate: Rate of the lead joint: k times the speed of the group [rad/s].
        velocity: Required velocity of the tool [m/s], shape (3,); None for zero.

    Returns:
        The motion; its `slip` is zero if the tool moves as required.
    """
    lead, own = group[0], list(group[1:])
    others = [joint for joint in range(JOINTS) if joint not in group]
    rates = np.zeros(JOINTS)
    rates[lead] = rate
    wanted = -(jacobian @ rates)
    if velocity is not None:
        wanted = wanted + velocity
    left: FloatArray = wanted
    weight = 0.0
    if own:
        U, s, Vt = np.linalg.svd(jacobian[:, own], full_matrices=False)
        weight = _weight(float(s[-1]))
        if weight == 0.0:
            left = wanted - U @ (wanted @ U)
    if weight == 0.0:
        scale = abs(rate) + float(np.linalg.norm(wanted))
        exact = float(np.linalg.norm(left)) <= HELD * scale
        if not exact and others:
            rest = jacobian[:, others]
            if own:
                rest = rest - U @ (U.T @ rest)
            rates[others] = _smallest(rest, left)
            wanted = wanted - jacobian[:, others] @ rates[others]
        if own:
            rates[own] = ((wanted @ U) / s) @ Vt
            wanted = wanted - jacobian[:, own] @ rates[own]
    else:
        both = own + others
        cost = np.where(np.arange(len(both)) < len(own), weight, 1.0)
        rates[both] = _smallest(jacobian[:, both] / cost, wanted) / cost
        wanted = wanted - jacobian[:, both] @ rates[both]
        exact = False
    return GroupMotion(rates, bool(exact), float(np.linalg.norm(wanted)))


def bounded_group_motion(
    jacobian: FloatArray,
    group: tuple[int, ...],
    rate: float,
    lower: FloatArray,
    upper: FloatArray,
) -> tuple[FloatArray, BoolArray]:
    """Return the motion of a joint group in the null space within bounds of the joint rates.

    The objectives are those of `group_motion`, with weights in place of strict priorities, so that
    bounds apply to a single minimisation: holding the tool (`_HOLDING`), the lead joint's rate (1),
    rest outside the group (`_RESTING`), and rest within it. Where the tool cannot be held at that
    rate, the lead joint slows down; the minimum is continuous in posture and bounds.

    Args:
        jacobian: J_p, shape (3, 7) [m/rad].
        group: Joints of the group, counted from 0, its lead joint first.
        rate: Rate of the lead joint [rad/s].
        lower: Lowest rates, at most 0 [rad/s], shape (7,).
        upper: Highest rates, at least 0 [rad/s], shape (7,).

    Returns:
        Joint rates [rad/s], shape (7,), and which joints are held at a bound, shape (7,).
    """
    weights = np.full(JOINTS, _RESTING)
    weights[list(group)] = _RESTING * _EASED_WITHIN
    weights[group[0]] = 1.0
    hessian = _HOLDING * (jacobian.T @ jacobian)
    hessian.flat[:: JOINTS + 1] += weights
    slope = np.zeros(JOINTS)
    slope[group[0]] = rate
    return bounded_minimum(hessian, slope, lower, upper)


def holding_rates(
    jacobian: FloatArray,
    rates: FloatArray,
    velocity: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
) -> FloatArray:
    """Return the rates closest to given ones that move the tool as required, within bounds.

    Args:
        jacobian: Rows of the Jacobian to hold, shape (3, 7) or (6, 7).
        rates: Joint rates to stay close to [rad/s], shape (7,).
        velocity: Required velocity of the tool, shape (3,) or (6,).
        lower: Lowest rates [rad/s], shape (7,).
        upper: Highest rates [rad/s], shape (7,).

    Returns:
        Joint rates [rad/s], shape (7,); if the bounds allow no exact solution, the least squares
        solution.
    """
    hessian = _HOLDING * (jacobian.T @ jacobian)
    hessian.flat[:: JOINTS + 1] += 1.0
    slope = _HOLDING * (velocity @ jacobian) + rates
    return bounded_minimum(hessian, slope, np.minimum(lower, upper), upper)[0]


def elbow_direction(jacobian: FloatArray) -> FloatArray:
    """Return the self-motion: the null-space direction of the tool's pose, fastest joint at rate 1.

    Up to a positive factor, component i is (-1)^i times the determinant of J without column i: it
    is continuous in the posture, unlike the last vector of a singular value decomposition, whose
    sign is arbitrary.

    Args:
        jacobian: Jacobian of the tool, shape (6, 7).

    Returns:
        Direction, shape (7,); zero at a singularity, where the self-motion is not unique.
    """
    *_, Vt = np.linalg.svd(jacobian)
    n = Vt[-1]
    oriented = np.linalg.det(np.vstack([jacobian, n]))
    largest = float(np.abs(n).max())
    return np.asarray(n * (np.sign(oriented) / largest), dtype=np.float64)


def _weight(singular_value: float) -> float:
    """Return the weight of the followers' rates for their smallest singular value [m/rad]."""
    if singular_value >= _WEAK:
        return 0.0
    return _EASED * float(np.sqrt(1.0 - (singular_value / _WEAK) ** 2))


def _smallest(rows: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return the least squares solution of least norm."""
    # Singular values this far below the largest are rounding of a projection.
    return np.asarray(np.linalg.lstsq(rows, wanted, rcond=1e-9)[0], dtype=np.float64)

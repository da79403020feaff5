"""Closed-form inverse kinematics of one goal, at one value of the free joint.

An arm of the spherical-shoulder class is solved as the reversed chain. This module converts goals
to that chain and joint angles back from it; `samples` only deals with the chain as solved.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.samples import LEAST_BEND, LEAST_FLEX, LEAST_TILT, TILTED
from tcs.kernel.analytic.solver import LAST, ArmSolver
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, jit


@jit
def wrist_goal(arm: ArmSolver, R_AG: FloatArray, p_AG: FloatArray, goal: FloatArray) -> None:
    """Express a goal in the frame about whose z axis joint 1 rotates.

    Args:
        arm: The arm.
        R_AG: Goal orientation in the arm base A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        goal: Filled, shape (4, 3): wrist centre [m], direction of axis 7, x axis of L7, and the
            vector from the wrist centre to the real tool, whose velocity the Jacobian describes
            [m].
    """
    for i in range(3):
        for k in range(3):
            goal[k, i] = 0.0
    # R_AL7 = R_AG R7^T, column by column; tool offset = R_AL7 p7.
    for i in range(3):
        a, b, c, w = R_AG[i, 0], R_AG[i, 1], R_AG[i, 2], p_AG[i]
        if arm.free == LAST:
            # Base and tool swap roles: the reversed chain must bring its tool A to X_GA.
            a, b, c = R_AG[0, i], R_AG[1, i], R_AG[2, i]
            w = -(a * p_AG[0] + b * p_AG[1] + c * p_AG[2])
        x = a * arm.R[7, 0, 0] + b * arm.R[7, 0, 1] + c * arm.R[7, 0, 2]
        y = a * arm.R[7, 1, 0] + b * arm.R[7, 1, 1] + c * arm.R[7, 1, 2]
        z = a * arm.R[7, 2, 0] + b * arm.R[7, 2, 1] + c * arm.R[7, 2, 2]
        offset = x * arm.p[7, 0] + y * arm.p[7, 1] + z * arm.p[7, 2]
        w = w - offset - arm.p[0, i]
        for j in range(3):
            goal[0, j] += arm.R[0, i, j] * w
            goal[1, j] += arm.R[0, i, j] * z
            goal[2, j] += arm.R[0, i, j] * x
        # The real tool is at the origin of the base of the reversed chain.
        goal[3, i] = -(w + arm.p[0, i]) if arm.free == LAST else offset
    a, b, c = goal[3, 0], goal[3, 1], goal[3, 2]
    for j in range(3):
        goal[3, j] = arm.R[0, 0, j] * a + arm.R[0, 1, j] * b + arm.R[0, 2, j] * c


@jit
def sample_joints(
    arm: ArmSolver, goal: FloatArray, branch: IntArray, q1: float, q: FloatArray
) -> None:
    """Fill the seven joint angles of one sample [rad], each shifted by full turns into its limits.

    Args:
        arm: The arm.
        goal: From `wrist_goal`, shape (4, 3).
        branch: Three signs, one row of `arm.branches`.
        q1: Angle of the free joint [rad].
        q: Filled in the real arm's order, shape (7,); a joint without limits is in (-pi, pi].
    """
    R = arm.R
    q[0] = q1
    c, s = np.cos(q1), np.sin(q1)
    vx, vy, vz = turned_back(c, s, goal[0, 0], goal[0, 1], goal[0, 2])
    zx, zy, zz = turned_back(c, s, goal[1, 0], goal[1, 1], goal[1, 2])
    xx, xy, xz = turned_back(c, s, goal[2, 0], goal[2, 1], goal[2, 2])
    vx, vy, vz = vx - arm.p[1, 0], vy - arm.p[1, 1], vz - arm.p[1, 2]
    square = vx * vx + vy * vy + vz * vz
    vx, vy, vz = rotated_back(R[1], vx, vy, vz)
    k = (square - arm.reach[0]) / arm.reach[1]
    k = min(max(k, LEAST_BEND - 1.0), 1.0 - LEAST_BEND)
    q[3] = arm.reach[2] + np.arctan2(branch[0] * np.sqrt(1.0 - k * k), k)
    c4, s4 = np.cos(q[3]), np.sin(q[3])
    ux = arm.u0[0] + arm.uc[0] * c4 + arm.us[0] * s4
    uy = arm.u0[1] + arm.uc[1] * c4 + arm.us[1] * s4
    uz = arm.u0[2] + arm.uc[2] * c4 + arm.us[2] * s4
    q[2] = _angle_to_height(R[2], ux, uy, uz, vz, branch[1], 0.0)
    c3, s3 = np.cos(q[2]), np.sin(q[2])
    rx, ry = c3 * ux - s3 * uy, s3 * ux + c3 * uy
    kx = R[2, 0, 0] * rx + R[2, 0, 1] * ry + R[2, 0, 2] * uz
    ky = R[2, 1, 0] * rx + R[2, 1, 1] * ry + R[2, 1, 2] * uz
    q[1] = np.arctan2(kx * vy - ky * vx, kx * vx + ky * vy)
    c2, s2 = np.cos(q[1]), np.sin(q[1])
    for j in range(1, 4):
        c, s = (c2, s2) if j == 1 else ((c3, s3) if j == 2 else (c4, s4))
        zx, zy, zz = rotated_back(R[j], zx, zy, zz)
        zx, zy, zz = turned_back(c, s, zx, zy, zz)
        xx, xy, xz = rotated_back(R[j], xx, xy, xz)
        xx, xy, xz = turned_back(c, s, xx, xy, xz)
    zx, zy, zz = rotated_back(R[4], zx, zy, zz)
    xx, xy, xz = rotated_back(R[4], xx, xy, xz)
    fx, fy, fz = R[6, 0, 2], R[6, 1, 2], R[6, 2, 2]
    q[5] = _angle_to_height(R[5], fx, fy, fz, zz, branch[2], LEAST_FLEX)
    c6, s6 = np.cos(q[5]), np.sin(q[5])
    rx, ry = c6 * fx - s6 * fy, s6 * fx + c6 * fy
    kx = R[5, 0, 0] * rx + R[5, 0, 1] * ry + R[5, 0, 2] * fz
    ky = R[5, 1, 0] * rx + R[5, 1, 1] * ry + R[5, 1, 2] * fz
    tilt = LEAST_TILT if zx * zx + zy * zy < TILTED else 0.0
    zx, zy = zx + tilt, zy + tilt
    q[4] = np.arctan2(kx * zy - ky * zx, kx * zx + ky * zy)
    xx, xy, xz = turned_back(np.cos(q[4]), np.sin(q[4]), xx, xy, xz)
    xx, xy, xz = rotated_back(R[5], xx, xy, xz)
    xx, xy, xz = turned_back(c6, s6, xx, xy, xz)
    xx, xy, xz = rotated_back(R[6], xx, xy, xz)
    q[6] = np.arctan2(xy, xx)
    if arm.free == LAST:
        for j in range(3):
            q[j], q[6 - j] = q[6 - j], q[j]
    for j in range(7):
        q[j] = within(q[j], arm.lower[j], arm.upper[j])


@jit
def within(angle: float, lower: float, upper: float) -> float:
    """Return `angle` [rad] shifted by full turns into [lower, upper], and clipped to it.

    The clip removes rounding only: callers have checked the limits by the slack. Without limits,
    the result is in (-pi, pi].
    """
    turn = 2.0 * np.pi
    if not np.isfinite(lower):
        return angle - turn * np.ceil((angle - np.pi) / turn)
    middle = 0.5 * (lower + upper)
    angle -= turn * np.ceil((angle - middle - np.pi) / turn)
    return min(max(angle, lower), upper)


@inner
def _angle_to_height(
    R: FloatArray, x: float, y: float, z: float, height: float, sign: int, least: float
) -> float:
    """Return the angle t [rad] for which R Rz(t) (x, y, z) has the z component `height`.

    Of the two such angles, `sign` selects one; the squared sine of half their difference is
    `least` or more.
    """
    P = R[2, 0] * x + R[2, 1] * y
    Q = R[2, 1] * x - R[2, 0] * y
    m = height - R[2, 2] * z
    N = P * P + Q * Q
    h = sign * np.sqrt(max(N - m * m, least * N))
    return np.arctan2(Q * m + P * h, P * m - Q * h)


@inner
def turned_back(c: float, s: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a vector rotated about z by minus the angle of cosine c and sine s."""
    return c * x + s * y, -s * x + c * y, z


@inner
def rotated_back(R: FloatArray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return R^T (x, y, z)."""
    return (
        R[0, 0] * x + R[1, 0] * y + R[2, 0] * z,
        R[0, 1] * x + R[1, 1] * y + R[2, 1] * z,
        R[0, 2] * x + R[1, 2] * y + R[2, 2] * z,
    )

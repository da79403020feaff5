"""All solutions of an arm of six joints of the spherical-wrist class, `tcs.kernel.analytic.solver`.

It is such an arm of seven joints with the first one at 0. Joint 4 of the chain follows from the
distance of the wrist from the shoulder, joints 2 and 3 aim at the wrist, and joints 5 to 7 turn the
tool: two solutions each.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.ik import wrist_goal
from tcs.kernel.analytic.samples import LEAST_BEND, LEAST_FLEX, LEAST_TILT, TILTED
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.six_joints.rotations import (
    Vector,
    greatest,
    less,
    mapped,
    matrix,
    transposed,
    turn_between,
    turned,
    vector,
)

BRANCHES = 1.0, -1.0
"""Signs of the two solutions of each kind, in their order."""


@inner
def solve_spherical_wrist(
    arm: ArmSolver,
    R_AG: FloatArray,
    p_AG: FloatArray,
    solutions: FloatArray,
    misses: FloatArray,
) -> int:
    """Fill the solutions for a goal.

    Args:
        arm: The closed form without joint limits.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        solutions: Filled with joint angles [rad], shape (8 or more, 7).
        misses: Filled with the error of each solution, in the position of the wrist [m] and the
            directions of the z and x axes of L7, seen from L1 or from the wrist.

    Returns:
        Number of solutions; those of a goal out of reach miss it.
    """
    goal = np.empty((4, 3))
    wrist_goal(arm, R_AG, p_AG, goal)
    R2, R5 = matrix(arm.R[2]), matrix(arm.R[5])
    to_L1, to_L2, to_L3 = transposed(matrix(arm.R[1])), transposed(R2), transposed(matrix(arm.R[3]))
    to_L4, to_L5 = transposed(matrix(arm.R[4])), transposed(R5)
    to_L6 = transposed(matrix(arm.R[6]))
    # Wrist and the z and x axes of L7, seen from L2 with joint 2 at 0.
    v = mapped(to_L1, less(vector(goal[0]), vector(arm.p[1])))
    z_goal, x_goal = mapped(to_L1, vector(goal[1])), mapped(to_L1, vector(goal[2]))
    bend = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - arm.reach[0]) / arm.reach[1]
    bend = min(max(bend, LEAST_BEND - 1.0), 1.0 - LEAST_BEND)
    off = np.arctan2(np.sqrt((1.0 - bend) * (1.0 + bend)), bend)
    # The axis of joint 7 in L6.
    f = to_L6[2]
    found = 0
    for elbow in BRANCHES:
        q4 = arm.reach[2] + elbow * off
        c, s = np.cos(q4), np.sin(q4)
        ux = arm.u0[0] + arm.uc[0] * c + arm.us[0] * s
        uy = arm.u0[1] + arm.uc[1] * c + arm.us[1] * s
        u = ux, uy, arm.u0[2] + arm.uc[2] * c + arm.us[2] * s
        for aim in BRANCHES:
            c3, s3 = _turn_to_height(R2[2], u, v[2], aim, 0.0)
            w = mapped(R2, turned(c3, s3, u))
            c2, s2 = turn_between(w[0], w[1], v[0], v[1])
            aside = greatest(less(turned(c2, s2, w), v))
            q2, q3 = np.arctan2(s2, c2), np.arctan2(s3, c3)
            z, x = z_goal, x_goal
            z, x = mapped(to_L2, turned(c2, -s2, z)), mapped(to_L2, turned(c2, -s2, x))
            z, x = mapped(to_L3, turned(c3, -s3, z)), mapped(to_L3, turned(c3, -s3, x))
            z, x = mapped(to_L4, turned(c, -s, z)), mapped(to_L4, turned(c, -s, x))
            tilt = LEAST_TILT if z[0] * z[0] + z[1] * z[1] < TILTED else 0.0
            for flex in BRANCHES:
                c6, s6 = _turn_to_height(R5[2], f, z[2], flex, LEAST_FLEX)
                w = mapped(R5, turned(c6, s6, f))
                c5, s5 = turn_between(w[0], w[1], z[0] + tilt, z[1] + tilt)
                miss = greatest(less(turned(c5, s5, w), z))
                ahead = turned(c6, -s6, mapped(to_L5, turned(c5, -s5, x)))
                ahead = mapped(to_L6, ahead)
                q = solutions[found]
                q[0], q[1], q[2], q[3] = 0.0, q2, q3, q4
                q[4], q[5] = np.arctan2(s5, c5), np.arctan2(s6, c6)
                q[6] = np.arctan2(ahead[1], ahead[0])
                # The x axis of L7 is in the plane about which joint 7 turns.
                misses[found] = max(aside, max(miss, abs(ahead[2])))
                found += 1
    return found


@inner
def _turn_to_height(
    row: Vector, u: Vector, height: float, sign: float, least: float
) -> tuple[float, float]:
    """Return cosine and sine of the rotation Rz that brings `row` Rz u to a value, by its sign.

    Of the two such rotations, the squared sine of half their difference is `least` or more. Where
    there is none, the closest one.
    """
    P, Q = row[0] * u[0] + row[1] * u[1], row[1] * u[0] - row[0] * u[1]
    m = height - row[2] * u[2]
    N = P * P + Q * Q
    h = sign * np.sqrt(max(N - m * m, least * N))
    square = N * (m * m + h * h)
    scale = 1.0 / np.sqrt(square) if square > 0.0 else 0.0
    return scale * (P * m - Q * h), scale * (Q * m + P * h)

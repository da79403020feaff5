"""All solutions of an arm whose axes 2, 3 and 4 are parallel, and whose axes 5 and 6 meet.

W is the point where axes 5 and 6 meet. Its distance along the parallel axes depends on joint 1
alone, and the tilt of axis 6 towards them on joints 1 and 5. Joint 6 follows from the azimuth, and
joints 2, 3 and 4 are a planar arm.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.six_joints.rotations import (
    added,
    apart,
    dot,
    either,
    greatest,
    less,
    mapped,
    matrix,
    product,
    then_turned,
    transposed,
    turn_between,
    turned,
    turned_matrix,
    turns_to,
    vector,
)


@inner
def solve_parallel_axes(
    R: FloatArray,
    p: FloatArray,
    R_AG: FloatArray,
    p_AG: FloatArray,
    solutions: FloatArray,
    misses: FloatArray,
) -> int:
    """Fill the solutions for a goal.

    Args:
        R: Rotations of the chain, shape (8, 3, 3).
        p: Its translations [m], shape (8, 3), L6 and L7 where axes 5 and 6 of the arm meet.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        solutions: Filled with joint angles [rad], shape (8 or more, 7).
        misses: Filled with the error of each solution, in entries of the rotation of L5 and of the
            position of W, both seen from L3 [m].

    Returns:
        Number of solutions.
    """
    R2, R3, R4, R5, R6 = matrix(R[2]), matrix(R[3]), matrix(R[4]), matrix(R[5]), matrix(R[6])
    p3, p4, p5 = vector(p[3]), vector(p[4]), vector(p[5])
    to_L3 = transposed(R2)
    # Orientation of L7 and position of W, seen from L2 with joint 1 at 0.
    base = product(matrix(R[0]), matrix(R[1]))
    R_A7 = product(matrix(R_AG), transposed(matrix(R[7])))
    origin = added(vector(p[0]), mapped(matrix(R[0]), vector(p[1])))
    W = less(less(vector(p_AG), mapped(R_A7, vector(p[7]))), origin)
    M, v = product(transposed(base), R_A7), mapped(transposed(base), W)
    # Signs of the directions of the fourth and the fifth axis of the chain along the third.
    fourth_up = 1.0 if R3[2][2] > 0.0 else -1.0
    fifth_up = fourth_up if R4[2][2] > 0.0 else -fourth_up
    # The third axis in L2, and the height of W along it.
    h = to_L3[2]
    height = p3[2] + fourth_up * p4[2] + fifth_up * p5[2] + dot(h, vector(p[2])) - h[2] * v[2]
    # The sixth axis in L6, and the axes parallel to the third one in L5.
    f, r = (R6[0][2], R6[1][2], R6[2][2]), R5[2]
    # Squared distance of the outer parallel axes: a constant, and multiples of cosine and sine.
    x, y = R3[0][0] * p3[0] + R3[1][0] * p3[1], R3[0][1] * p3[0] + R3[1][1] * p3[1]
    rest = p3[0] * p3[0] + p3[1] * p3[1] + p4[0] * p4[0] + p4[1] * p4[1]
    bend, twist = 2.0 * (x * p4[0] + y * p4[1]), 2.0 * (y * p4[0] - x * p4[1])
    found = 0
    firsts, middle_1, off_1 = turns_to(h[0] * v[0] + h[1] * v[1], h[0] * v[1] - h[1] * v[0], height)
    for i in range(firsts):
        c, s = either(middle_1, off_1, i)
        first = np.arctan2(s, c)
        # Orientation of L7 and position of W, seen from L3 with joint 2 at 0.
        N = product(to_L3, turned_matrix(c, -s, M))
        w = mapped(to_L3, less(turned(c, -s, v), vector(p[2])))
        fifths, middle_5, off_5 = turns_to(
            r[0] * f[0] + r[1] * f[1], r[1] * f[0] - r[0] * f[1], N[2][2] * fifth_up - r[2] * f[2]
        )
        for j in range(fifths):
            c, s = either(middle_5, off_5, j)
            fifth = np.arctan2(s, c)
            wrist = product(then_turned(R5, c, s), R6)
            c, s = turn_between(N[2][0], N[2][1], fifth_up * wrist[2][0], fifth_up * wrist[2][1])
            sixth = np.arctan2(s, c)
            R_35 = product(N, transposed(then_turned(wrist, c, s)))
            u = less(w, mapped(R_35, p5))
            thirds, middle_3, off_3 = turns_to(bend, twist, u[0] * u[0] + u[1] * u[1] - rest)
            for k in range(thirds):
                c, s = either(middle_3, off_3, k)
                third = np.arctan2(s, c)
                R_34 = then_turned(R3, c, s)
                m = added(p3, mapped(R_34, p4))
                c, s = turn_between(m[0], m[1], u[0], u[1])
                second = np.arctan2(s, c)
                before = product(turned_matrix(c, s, R_34), R4)
                aside = greatest(less(turned(c, s, m), u))
                K = mapped(transposed(before), (R_35[0][0], R_35[1][0], R_35[2][0]))
                q = solutions[found]
                q[0], q[1], q[2], q[3] = 0.0, first, second, third
                q[4], q[5], q[6] = np.arctan2(K[1], K[0]), fifth, sixth
                misses[found] = max(aside, apart(then_turned(before, K[0], K[1]), R_35))
                found += 1
    return found

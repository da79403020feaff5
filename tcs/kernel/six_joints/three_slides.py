"""All solutions of an arm of three prismatic and three revolute joints, in any order.

Prismatic joints leave the orientation alone, so it gives the three angles. Each prismatic joint
then has a known direction, and the position is linear in the three.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.kinematics import link_poses, place_tool
from tcs.kernel.six_joints.rotations import (
    either,
    fill,
    less,
    matrix,
    product,
    then_turned,
    transposed,
    triple,
    turn_between,
    turned_matrix,
    turns_to,
    vector,
)

COPLANAR = 1e-9
"""Triple product of three directions below which they lie in a plane."""


@inner
def solve_three_slides(
    R: FloatArray, p: FloatArray, R_AG: FloatArray, p_AG: FloatArray, solutions: FloatArray
) -> int:
    """Fill the solutions for a goal.

    Args:
        R: Rotations of the chain, shape (8, 3, 3).
        p: Its translations [m] and `Chain.slides`, shape (8, 4).
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        solutions: Filled with joint angles and positions [rad or m], shape (2 or more, 7).

    Returns:
        Number of solutions.
    """
    # Rotations before, between and after the revolute joints.
    between = np.empty((4, 3, 3))
    turning, sliding = np.empty(3, np.int64), np.empty(3, np.int64)
    turns = slides = 0
    total = product(matrix(R[0]), matrix(R[1]))
    for i in range(1, 7):
        if p[i, 3] > 0.0:
            sliding[slides] = i
            slides += 1
            total = product(total, matrix(R[i + 1]))
        else:
            fill(total, between[turns])
            turning[turns] = i
            turns += 1
            total = matrix(R[i + 1])
    first, second = matrix(between[1]), matrix(between[2])
    M = product(product(transposed(matrix(between[0])), matrix(R_AG)), transposed(total))
    row, f = first[2], transposed(second)[2]
    link_R, link_p = np.empty((8, 3, 3)), np.empty((8, 3))
    R_AT, p_AT = np.empty((3, 3)), np.empty(3)
    found = 0
    count, middle, off = turns_to(
        row[0] * f[0] + row[1] * f[1], row[1] * f[0] - row[0] * f[1], M[2][2] - row[2] * f[2]
    )
    for j in range(count):
        c, s = either(middle, off, j)
        inside = product(then_turned(first, c, s), second)
        c1, s1 = turn_between(inside[0][2], inside[1][2], M[0][2], M[1][2])
        N = product(transposed(turned_matrix(c1, s1, inside)), M)
        q = solutions[found]
        for k in range(7):
            q[k] = 0.0
        q[turning[0]], q[turning[1]] = np.arctan2(s1, c1), np.arctan2(s, c)
        q[turning[2]] = np.arctan2(N[1][0], N[0][0])
        link_poses(R, p, q, link_R, link_p)
        place_tool(R, p, link_R, link_p, R_AT, p_AT)
        along = vector(link_R[sliding[0] + 1][:, 2])
        across = vector(link_R[sliding[1] + 1][:, 2])
        up = vector(link_R[sliding[2] + 1][:, 2])
        v = less(vector(p_AG), vector(p_AT))
        volume = triple(along, across, up)
        if abs(volume) < COPLANAR:
            continue
        q[sliding[0]] = triple(v, across, up) / (volume * p[sliding[0], 3])
        q[sliding[1]] = triple(along, v, up) / (volume * p[sliding[1], 3])
        q[sliding[2]] = triple(along, across, v) / (volume * p[sliding[2], 3])
        found += 1
    return found

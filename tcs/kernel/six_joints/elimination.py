"""All solutions of any arm of six revolute joints, by elimination; `general` has its constants.

Of fourteen equations, eight remove the products of a and b. The other six, in nine products of the
half-angle tangents of d and e, and the same times the tangent of d, have a solution where the
determinant of their twelve columns vanishes. It is a trigonometric polynomial of degree 8 in c:
17 values give it, and its roots are the angles of c, at most sixteen. The columns' null vector
gives d and e, the line of joint f gives a and b, and Newton's method refines all six.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.kinematics import copy_joints, fill_jacobian, link_poses, place_tool, pose_error
from tcs.kernel.six_joints.equations import (
    eliminate,
    fill_first_transform,
    fill_right_side,
    swap_rows,
)
from tcs.kernel.six_joints.general import EQUATIONS, FORWARDS, GeneralArm
from tcs.kernel.six_joints.null_space import (
    MOST_VECTORS,
    OF_D,
    OF_E,
    half_angle,
    null_vectors,
)
from tcs.kernel.six_joints.roots import fill_eliminant, find_roots

MOST_ROOTS = 48
"""Greatest number of angles of c that are tried: 16 roots, and minima next to zero."""
ITERATIONS = 12
"""Most iterations of Newton's method from a root; three are usual."""
LONGEST_STEP = 0.5
"""Longest step of Newton's method [rad]."""
CONVERGED = 1e-12
"""Error at which it ends [rad and m]."""
ON_GOAL = 1e-7
"""Greatest error of a solution [rad and m]."""
SMALLEST_PIVOT = 1e-14
"""Pivot of the Jacobian below which an arm is singular."""
DEGENERATE = 1e-5
"""Ratio of the least to the greatest pivot of the first elimination below which goal and arm are in
a special position."""
ASIDE = 1e-2, -2e-2, 5e-2
"""Displacements of a goal while the roots are searched, in units of the arm's size and [rad]: the
others are tried if arm and goal are in a special position."""
STRAY = 1e-4
"""Greatest distance of a solution from its root [rad]: a root is exact to 1e-6, unless arm and goal
are in a special position."""
SAME = 1.4e-6
"""Difference of equal angles [rad]: next to a singularity, rounding is magnified so far."""
TURN = 2.0 * np.pi


@inner
def solve_general(
    arm: GeneralArm,
    R: FloatArray,
    p: FloatArray,
    R_AG: FloatArray,
    p_AG: FloatArray,
    solutions: FloatArray,
) -> int:
    """Fill all solutions for a goal.

    Args:
        arm: Constants of the elimination.
        R: Rotations of the chain, shape (8, 3, 3).
        p: Its translations [m], shape (8, 3).
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        solutions: Filled with joint angles [rad], shape (n, 7); further ones are left out.

    Returns:
        Number of rows filled.
    """
    found, is_special = _solve_beside(arm, R, p, R_AG, p_AG, 0.0, solutions, 0)
    if is_special:
        for aside in ASIDE:
            found, _ = _solve_beside(arm, R, p, R_AG, p_AG, aside, solutions, found)
    return found


@inner
def _solve_beside(
    arm: GeneralArm,
    R: FloatArray,
    p: FloatArray,
    R_AG: FloatArray,
    p_AG: FloatArray,
    aside: float,
    solutions: FloatArray,
    found: int,
) -> tuple[int, bool]:
    """Add the solutions for a goal whose roots are searched a little beside it.

    Returns:
        Number of solutions with those found before, and whether arm and goal are in a special
        position there, in which solutions may share the angle of c.
    """
    first, table = np.empty((3, 4)), np.empty((EQUATIONS, 35))
    values, products = np.empty((3, 3, EQUATIONS)), np.empty(8, np.int64)
    fill_first_transform(arm, R_AG, p_AG, aside, first)
    fill_right_side(arm, first, values)
    if eliminate(arm, values, table, products) < DEGENERATE:
        return found, True
    roots = np.empty((MOST_ROOTS, 2))
    matrix, order = np.empty((12, 12)), np.empty(12, np.int64)
    vectors, q = np.empty((MOST_VECTORS + 2, 12)), np.empty(7)
    count, begun, certain, is_special = find_roots(table, roots), found, 0, False
    for is_double in (False, True):
        for n in range(count):
            c = roots[n, 0]
            if (roots[n, 1] == 0.0) != is_double:
                continue
            certain += 0 if is_double else 1
            fill_eliminant(table, np.cos(c), np.sin(c), matrix)
            for k in range(null_vectors(matrix, is_double, order, vectors)):
                _joints(arm, table, products, c, vectors[k], q)
                is_solution = _refined(arm, R, p, R_AG, p_AG, q)
                if k == 0 and not is_double:
                    off = q[2] - c if arm.direction == FORWARDS else q[5] + c
                    is_special = is_special or abs(off - TURN * np.rint(off / TURN)) > STRAY
                if is_solution and found < len(solutions) and not is_known(solutions, found, q):
                    copy_joints(q, solutions[found])
                    found += 1
        if not is_double:
            # Each root has a solution, or two that lie close together give both at the first.
            is_special = is_special or found - begun < certain
    return found, is_special


@inner
def is_known(solutions: FloatArray, count: int, q: FloatArray) -> bool:
    """Return whether joints repeat one of the first solutions, but for full turns."""
    for m in range(count):
        is_same = True
        for k in range(1, 7):
            off = solutions[m, k] - q[k]
            if abs(off - TURN * np.rint(off / TURN)) > SAME:
                is_same = False
                break
        if is_same:
            return True
    return False


@inner
def _joints(
    arm: GeneralArm,
    table: FloatArray,
    products: IntArray,
    c: float,
    vector: FloatArray,
    q: FloatArray,
) -> None:
    """Fill the joints but f of a root, in the order of the chain; f is left at 0.

    Args:
        arm: The arm.
        table: From `eliminate`.
        products: From `eliminate`.
        c: The root [rad].
        vector: From `null_vectors`.
        q: Filled [rad], shape (7,).
    """
    d, e = half_angle(vector, OF_D), half_angle(vector, OF_E)
    with_c = (1.0, np.cos(c), np.sin(c))
    # 1, x and x^2 over 1 + x^2, with x the tangent of half the angle.
    with_d = (0.5 * (1.0 + np.cos(d)), 0.5 * np.sin(d), 0.5 * (1.0 - np.cos(d)))
    with_e = (0.5 * (1.0 + np.cos(e)), 0.5 * np.sin(e), 0.5 * (1.0 - np.cos(e)))
    found = np.empty(8)
    for n in range(7, -1, -1):
        total = 0.0
        for k in range(3):
            for i in range(3):
                for j in range(3):
                    factor = with_c[k] * with_d[i] * with_e[j]
                    total += factor * table[n, 8 + 9 * k + 3 * i + j]
        for j in range(n + 1, 8):
            total -= table[n, j] * found[products[j]]
        found[products[n]] = total / table[n, n]
    # Cosine and sine of b are products 0 and 1, those of a 2 and 5.
    b, a = np.arctan2(found[1], found[0]), np.arctan2(found[5], found[2])
    q[0] = 0.0
    if arm.direction == FORWARDS:
        q[6], q[1], q[2], q[3], q[4], q[5] = a, b, c, d, e, 0.0
    else:
        q[1], q[6], q[5], q[4], q[3], q[2] = -a, -b, -c, -d, -e, 0.0


@inner
def _refined(
    arm: GeneralArm,
    R: FloatArray,
    p: FloatArray,
    R_AG: FloatArray,
    p_AG: FloatArray,
    q: FloatArray,
) -> bool:
    """Set joint f, then refine all joints by Newton's method; return whether it converged."""
    link_R, link_p = np.empty((8, 3, 3)), np.empty((8, 3))
    R_AT, p_AT, error = np.empty((3, 3)), np.empty(3), np.empty(6)
    J, A = np.empty((6, 7)), np.empty((6, 7))
    link_poses(R, p, q, link_R, link_p)
    place_tool(R, p, link_R, link_p, R_AT, p_AT)
    last = 5 if arm.direction == FORWARDS else 2
    pose_error(R_AT, p_AT, R_AG, p_AG, error)
    axis = link_R[last + 1]
    q[last] = error[0] * axis[0, 2] + error[1] * axis[1, 2] + error[2] * axis[2, 2]
    worst = np.inf
    for _ in range(ITERATIONS):
        link_poses(R, p, q, link_R, link_p)
        place_tool(R, p, link_R, link_p, R_AT, p_AT)
        worst = pose_error(R_AT, p_AT, R_AG, p_AG, error)
        if worst < CONVERGED:
            break
        fill_jacobian(link_R, link_p, p_AT, J)
        for r in range(6):
            for k in range(6):
                A[r, k] = J[r, k + 1]
            A[r, 6] = error[r]
        if not _solved(A):
            break
        longest = 0.0
        for k in range(6):
            longest = max(longest, abs(A[k, 6]))
        scale = min(1.0, LONGEST_STEP / max(longest, 1e-300))
        for k in range(6):
            q[k + 1] += scale * A[k, 6]
    return worst < ON_GOAL


@inner
def _solved(A: FloatArray) -> bool:
    """Solve the six equations in A, shape (6, 7), in place; its last column becomes the answer."""
    for n in range(6):
        row = n
        for i in range(n + 1, 6):
            if abs(A[i, n]) > abs(A[row, n]):
                row = i
        if abs(A[row, n]) < SMALLEST_PIVOT:
            return False
        swap_rows(A, n, row)
        inverse = 1.0 / A[n, n]
        for i in range(n + 1, 6):
            factor = A[i, n] * inverse
            for j in range(n + 1, 7):
                A[i, j] -= factor * A[n, j]
    for i in range(5, -1, -1):
        total = A[i, 6]
        for j in range(i + 1, 6):
            total -= A[i, j] * A[j, 6]
        A[i, 6] = total / A[i, i]
    return True

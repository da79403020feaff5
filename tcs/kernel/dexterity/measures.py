"""Dexterity measures at given joint angles."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.dexterity import INVERSE_CONDITION, LIMIT_WEIGHTED, THESIS, UNLIMITED
from tcs.kernel.freedom.forms import FEWEST_JOINTS
from tcs.kernel.kinematics import jacobian, tool_pose
from tcs.kernel.problem import Problem

THESIS_SCALE = 1e6
"""k of the ITCM thesis, eq. (21), chosen there for seven limited joints."""
MIDDLE = 0.25
"""Greatest factor of a joint in eq. (21), attained in the middle of its limits."""
LEAST_WEIGHT, LIMIT_SCALE = 1e-3, 0.05
"""Least weight of a joint in JLWKI, and the fraction of half the range over which what the weight
lacks to 1 halves."""
JOINTS = 7
NEWTON_STEPS = 200
"""Greatest number of Newton steps to an eigenvalue. It takes 4 to 8; where all six eigenvalues
coincide, a step reduces the error to 5/6 only."""
CLOSE_ENOUGH = 1e-13
"""Relative step at which Newton's method has converged; the next would be far below rounding."""


@inner
def gram(J: FloatArray, G: FloatArray) -> float:
    """Fill the lower triangle of G = J J^T, shape (6, 6), and return its trace."""
    trace = 0.0
    for i in range(6):
        for j in range(i + 1):
            total = 0.0
            for k in range(7):
                total += J[i, k] * J[j, k]
            G[i, j] = total
        trace += G[i, i]
    return trace


@jit
def isotropy_at(
    chain_R: FloatArray, chain_p: FloatArray, q: FloatArray, joints: int = JOINTS
) -> float:
    """Return how evenly the arm can move its tool in every direction, at joint angles q.

    Args:
        chain_R: Rotations of the chain, shape (8, 3, 3).
        chain_p: Translations of the chain [m], shape (8, 3).
        q: Joint angles [rad], shape (7,).
        joints: Number of joints of the arm, as in `Chain`.

    Returns:
        Isotropy in [0, 1]; 0 at a singularity.

    Source:
        TCS eq. (2), det(J J^T)^(1/6) / (trace(J J^T)/6). The print shows a square root; only the
        sixth root keeps the measure below 1. Rows mix units: compare within one robot only.
    """
    J = np.empty((6, 7))
    jacobian(chain_R, chain_p, q, J)
    clear_fixed(J, joints)
    return isotropy(J)


@inner
def isotropy(J: FloatArray) -> float:
    """Return the kinematic isotropy of a Jacobian of shape (6, 7), see `isotropy_at`."""
    G = np.empty((6, 6))
    trace = gram(J, G)
    # The determinant of the Gram matrix by Cholesky factorisation, in place.
    det = 1.0
    for j in range(6):
        pivot = G[j, j]
        for k in range(j):
            pivot -= G[j, k] * G[j, k]
        if pivot <= 0.0:
            return 0.0
        det *= pivot
        root = np.sqrt(pivot)
        for i in range(j + 1, 6):
            total = G[i, j]
            for k in range(j):
                total -= G[i, k] * G[j, k]
            G[i, j] = total / root
    return det ** (1.0 / 6.0) / (trace / 6.0)


@jit
def inverse_condition(J: FloatArray) -> float:
    """Return the least over the greatest singular value of a Jacobian.

    Args:
        J: Shape (6, 7), rows [angular; linear] [rad/rad; m/rad].

    Returns:
        Inverse condition number in [0, 1]; below 1e-7, the root of rounding, at a singularity.

    Source:
        ITCM thesis eq. (20), sigma_min / sigma_max. Rows mix units: compare within one robot only.
    """
    G = np.empty((6, 6))
    gram(J, G)
    for i in range(6):
        for j in range(i):
            G[j, i] = G[i, j]
    diagonal, square = np.empty(6), np.empty(6)
    tridiagonalise(G, diagonal, square)
    total = diagonal[0] * diagonal[0]
    for i in range(1, 6):
        total += diagonal[i] * diagonal[i] + 2.0 * square[i]
    # No eigenvalue is below 0, as G is a Gram matrix, nor above its Frobenius norm.
    most = eigenvalue_from(diagonal, square, np.sqrt(total))
    least = eigenvalue_from(diagonal, square, 0.0)
    return np.sqrt(max(least, 0.0) / most)


@inner
def clear_fixed(J: FloatArray, joints: int) -> None:
    """Set the columns of a Jacobian to zero that belong to no joint of the arm, in place."""
    for k in range(JOINTS - joints):
        for i in range(6):
            J[i, k] = 0.0


@inner
def weigh(problem: Problem, q: FloatArray, J: FloatArray) -> None:
    """Weight the columns of J by the distance of the joints q [rad] to their limits, in place.

    Source:
        TOC, det(J W J^T)^(1/6) / (trace(J W J^T) / 6), W = diag of `limit_weight`.
    """
    for k in range(JOINTS):
        root = np.sqrt(limit_weight(q[k], problem.arm.lower[k], problem.arm.upper[k]))
        for i in range(6):
            J[i, k] *= root


@inner
def leave_turn_out(problem: Problem, q: FloatArray, J: FloatArray) -> None:
    """Replace the six rows of J by the five that the goals of an arm of five joints prescribe.

    The rotation about the axis that they leave free is taken out: two components of the angular
    velocity remain, perpendicular to it. The sixth row has a single entry, in a column without a
    joint: its square is the mean of the five eigenvalues of J J^T, so that the least and the
    greatest of the six are those of the five, and the isotropy of the six is that of the five to
    the power of 5/6.
    """
    link_R, link_p, R, p = np.empty((8, 3, 3)), np.empty((8, 3)), np.empty((3, 3)), np.empty(3)
    tool_pose(problem.chain.R, problem.chain.p, q, link_R, link_p, R, p)
    turn, a, across = problem.goals.turn, np.empty(3), np.zeros((2, 3))
    for r in range(3):
        a[r] = R[r, 0] * turn[0] + R[r, 1] * turn[1] + R[r, 2] * turn[2]
    # A unit vector across the axis, in the plane of its two largest components.
    i = 0
    for r in range(1, 3):
        if abs(a[r]) < abs(a[i]):
            i = r
    j, k = (i + 1) % 3, (i + 2) % 3
    length = np.sqrt(a[j] * a[j] + a[k] * a[k])
    across[0, j], across[0, k] = -a[k] / length, a[j] / length
    for r in range(3):
        s, t = (r + 1) % 3, (r + 2) % 3
        across[1, r] = a[s] * across[0, t] - a[t] * across[0, s]
    trace = 0.0
    for c in range(JOINTS):
        x, y, z = J[0, c], J[1, c], J[2, c]
        for r in range(2):
            J[r, c] = across[r, 0] * x + across[r, 1] * y + across[r, 2] * z
            J[2 + r, c] = J[3 + r, c]
        J[4, c], J[5, c] = J[5, c], 0.0
        for r in range(5):
            trace += J[r, c] * J[r, c]
    J[5, 0] = np.sqrt(trace / 5.0)


@jit
def tridiagonalise(G: FloatArray, diagonal: FloatArray, square: FloatArray) -> None:
    """Fill the diagonal and the squared off-diagonal of a tridiagonal matrix similar to G.

    Args:
        G: Symmetric, overwritten, shape (6, 6).
        diagonal: Filled, shape (6,).
        square: Filled, shape (6,): entry i belongs to rows i - 1 and i, entry 0 is 0.
    """
    v, w = np.empty(6), np.empty(6)
    square[0] = 0.0
    for k in range(4):
        # A Householder reflection I - 2 v v^T / (v^T v) leaves one entry below the diagonal.
        below = 0.0
        for i in range(k + 1, 6):
            v[i] = G[i, k]
            below += v[i] * v[i]
        square[k + 1] = below
        if below == 0.0:
            continue
        root = np.sqrt(below)
        v[k + 1] += root if v[k + 1] >= 0.0 else -root
        beta = 1.0 / (root * abs(v[k + 1]))
        half = 0.0
        for i in range(k + 1, 6):
            total = 0.0
            for j in range(k + 1, 6):
                total += G[i, j] * v[j]
            w[i] = beta * total
            half += w[i] * v[i]
        half *= 0.5 * beta
        for i in range(k + 1, 6):
            w[i] -= half * v[i]
        for i in range(k + 1, 6):
            for j in range(k + 1, 6):
                G[i, j] -= v[i] * w[j] + w[i] * v[j]
    square[5] = G[5, 4] * G[5, 4]
    for i in range(6):
        diagonal[i] = G[i, i]


@jit
def eigenvalue_from(diagonal: FloatArray, square: FloatArray, start: float) -> float:
    """Return the eigenvalue nearest to `start` of a symmetric, tridiagonal matrix T.

    Newton's method on the characteristic polynomial p converges monotonically from outside the
    spectrum. p'/p is summed over the pivots of T - x I.

    Args:
        diagonal: Diagonal of T, shape (6,).
        square: Squared off-diagonal as from `tridiagonalise`, shape (6,).
        start: A bound of the spectrum: 0 for the least eigenvalue, else an upper bound for the
            greatest.
    """
    x = start
    for _ in range(NEWTON_STEPS):
        pivot = diagonal[0] - x
        slope = -1.0
        ratio = slope / pivot
        for i in range(1, 6):
            share = square[i] / pivot
            slope = share * slope / pivot - 1.0
            pivot = diagonal[i] - x - share
            ratio += slope / pivot
        step = -1.0 / ratio
        # A step of the wrong sign, or nan, is due to rounding: x is the eigenvalue.
        if not (step > 0.0 if start == 0.0 else step < 0.0):
            return x
        x += step
        if abs(step) <= CLOSE_ENOUGH * x:
            return x
    return x


@jit
def limit_penalty(q: FloatArray, lower: FloatArray, upper: FloatArray, penalty: int) -> float:
    """Return the joint-limit penalty at joint angles q: 0 at a limit, 1 far from all limits.

    Args:
        q: Joint angles [rad], shape (7,).
        lower: Lower limits [rad], shape (7,); infinite where continuous.
        upper: Upper limits [rad], shape (7,).
        penalty: UNLIMITED (always 1), NORMALISED or THESIS.

    Returns:
        P in [0, 1].

    Source:
        ITCM thesis eq. (21), P = 1 - exp(-k prod (q - lower)(upper - q) / (upper - lower)^2), with
        k = 1e6. For a continuous joint the factor is undefined. THESIS omits it and leaves k
        unchanged; NORMALISED replaces it by 1/4, the factor in the middle of the limits and its
        limit for ever wider limits. With seven limited joints the two are equal.
    """
    if penalty == UNLIMITED:
        return 1.0
    product = THESIS_SCALE
    for i in range(JOINTS):
        if np.isfinite(lower[i]) and np.isfinite(upper[i]):
            width = upper[i] - lower[i]
            product *= (q[i] - lower[i]) * (upper[i] - q[i]) / (width * width)
        elif penalty != THESIS:
            product *= MIDDLE
    return -np.expm1(-product)


@inner
def limit_weight(q: float, lower: float, upper: float) -> float:
    """Return the weight of a joint by its distance to its limits: 1/2 at a limit, 1 far from both.

    Args:
        q: Joint angle [rad].
        lower: Lower limit [rad]; infinite where continuous, which weighs 1.
        upper: Upper limit [rad].

    Source:
        TOC (Kapusta and Kemp 2019), as published in its authors' later program, assistive_gym:
        w = max(0.001, 1 - 0.5^((R - |R - q + lower|) / (0.05 R) + 1)), R half the range.
    """
    if not (np.isfinite(lower) and np.isfinite(upper)):
        return 1.0
    half = 0.5 * (upper - lower)
    if half <= 0.0:
        return LEAST_WEIGHT
    margin = (half - abs(half - q + lower)) / (LIMIT_SCALE * half)
    return max(LEAST_WEIGHT, 1.0 - 0.5 ** (margin + 1.0))


@jit
def measure_at(problem: Problem, q: FloatArray) -> float:
    """Return the problem's dexterity measure at joint angles q [rad], shape (7,).

    Of an arm of five joints, it is that of the five directions which its goals prescribe.

    Source:
        TCS eq. (2) or ITCM thesis eq. (20), multiplied by the penalty as in thesis eq. (22); or
        JLWKI of TOC.
    """
    J = np.empty((6, 7))
    jacobian(problem.chain.R, problem.chain.p, q, J)
    clear_fixed(J, problem.chain.joints)
    if problem.measure.of == LIMIT_WEIGHTED:
        weigh(problem, q, J)
    if problem.chain.joints == FEWEST_JOINTS:
        leave_turn_out(problem, q, J)
    if problem.measure.of == INVERSE_CONDITION:
        value = inverse_condition(J)
    else:
        value = isotropy(J)
        if problem.chain.joints == FEWEST_JOINTS:
            value = value**1.2
    return value * limit_penalty(q, problem.arm.lower, problem.arm.upper, problem.measure.penalty)


@jit
def rounded_inward(q: FloatArray, lower: FloatArray, upper: FloatArray, out: FloatArray) -> None:
    """Fill `out` with q rounded to float32 values that do not exceed the limits.

    Args:
        q: Joint angles [rad], shape (7,).
        lower: Lower limits [rad], shape (7,).
        upper: Upper limits [rad], shape (7,).
        out: Filled with the float32 values, as float64 [rad], shape (7,).
    """
    for i in range(q.size):
        near = np.float32(q[i])
        if near > upper[i]:
            near = np.nextafter(near, np.float32(-np.inf))
        elif near < lower[i]:
            near = np.nextafter(near, np.float32(np.inf))
        out[i] = near

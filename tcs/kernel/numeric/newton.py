"""Newton's method for a tool pose: error, Jacobian, the shortest step to the goal, the way along.

The arm has one joint more than a pose has figures. Of all steps that take the error away to first
order, Newton's is the shortest one; the direction in which the tool stands still is what is left.
Both come from one factorisation of J J^T.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.numeric.arm import NumericArm

LEAST_PIVOT = 1e-14
"""Pivots of J J^T are kept above this: next to a singularity a step is long, but never infinite."""
LONGEST_STEP = 0.6
"""Greatest change of the joints in one step [rad, as a norm]: beyond, J is another one."""
DAMPING = 0.1
"""Of J J^T, whose entries are about 1, per square of the error."""
FAR_TURN = 0.9
"""Cosine of a turn below which its sine is no longer taken for the angle."""


class NewtonWorkspace(NamedTuple):
    """Scratch of one look at a posture."""

    z: FloatArray
    """Directions of the seven axes in A, shape (7, 3)."""
    o: FloatArray
    """Points on them [m], shape (7, 3)."""
    S: FloatArray
    """Orientations in hand, shape (2, 3, 3)."""
    J: FloatArray
    """Jacobian of the tool, shape (6, 7), rows [angular; linear]."""
    G: FloatArray
    """Factor of J J^T, its diagonal inverted, shape (6, 6)."""
    error: FloatArray
    """What is left to the goal: turn [rad] and way [m] in A, shape (6,)."""
    x: FloatArray
    """Right-hand side and solution, shape (6,)."""
    step: FloatArray
    """Change of the joints [rad], shape (7,)."""


@jit
def new_newton_workspace() -> NewtonWorkspace:
    """Return scratch memory."""
    return NewtonWorkspace(
        np.empty((7, 3)),
        np.empty((7, 3)),
        np.empty((2, 3, 3)),
        np.empty((6, 7)),
        np.zeros((6, 6)),
        np.empty(6),
        np.empty(6),
        np.empty(7),
    )


@jit
def evaluate(
    arm: NumericArm, R_AG: FloatArray, p_AG: FloatArray, q: FloatArray, newton: NewtonWorkspace
) -> float:
    """Fill error and Jacobian at joint angles q; return the greatest entry of the error."""
    S, T = newton.S[0], newton.S[1]
    z, o, J, error = newton.z, newton.o, newton.J, newton.error
    x0, x1, x2 = 0.0, 0.0, 0.0
    for r in range(3):
        for c in range(3):
            S[r, c] = 1.0 if r == c else 0.0
    for i in range(8):
        F, f = arm.R[i], arm.p[i]
        cosine, sine = 1.0, 0.0
        if i < 7:
            cosine, sine = np.cos(q[i]), np.sin(q[i])
        x0 += S[0, 0] * f[0] + S[0, 1] * f[1] + S[0, 2] * f[2]
        x1 += S[1, 0] * f[0] + S[1, 1] * f[1] + S[1, 2] * f[2]
        x2 += S[2, 0] * f[0] + S[2, 1] * f[1] + S[2, 2] * f[2]
        for r in range(3):
            x = S[r, 0] * F[0, 0] + S[r, 1] * F[1, 0] + S[r, 2] * F[2, 0]
            y = S[r, 0] * F[0, 1] + S[r, 1] * F[1, 1] + S[r, 2] * F[2, 1]
            T[r, 2] = S[r, 0] * F[0, 2] + S[r, 1] * F[1, 2] + S[r, 2] * F[2, 2]
            T[r, 0], T[r, 1] = cosine * x + sine * y, -sine * x + cosine * y
        if i < 7:
            z[i, 0], z[i, 1], z[i, 2] = T[0, 2], T[1, 2], T[2, 2]
            o[i, 0], o[i, 1], o[i, 2] = x0, x1, x2
        S, T = T, S
    for i in range(7):
        dx, dy, dz = x0 - o[i, 0], x1 - o[i, 1], x2 - o[i, 2]
        J[0, i], J[1, i], J[2, i] = z[i, 0], z[i, 1], z[i, 2]
        J[3, i] = z[i, 1] * dz - z[i, 2] * dy
        J[4, i] = z[i, 2] * dx - z[i, 0] * dz
        J[5, i] = z[i, 0] * dy - z[i, 1] * dx
    # Half the sum of the cross products of the tool's axes with the goal's: axis times sine.
    ex, ey, ez, trace = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        ex += S[1, k] * R_AG[2, k] - S[2, k] * R_AG[1, k]
        ey += S[2, k] * R_AG[0, k] - S[0, k] * R_AG[2, k]
        ez += S[0, k] * R_AG[1, k] - S[1, k] * R_AG[0, k]
        trace += S[0, k] * R_AG[0, k] + S[1, k] * R_AG[1, k] + S[2, k] * R_AG[2, k]
    scale, cosine = 0.5, 0.5 * (trace - 1.0)
    if cosine < FAR_TURN:
        sine = 0.5 * np.sqrt(ex * ex + ey * ey + ez * ez)
        # Half a turn off, the axis is lost: any does for a start.
        scale = 0.5 * np.arctan2(sine, cosine) / max(sine, 1e-9)
    error[0], error[1], error[2] = scale * ex, scale * ey, scale * ez
    error[3], error[4], error[5] = p_AG[0] - x0, p_AG[1] - x1, p_AG[2] - x2
    worst = 0.0
    for k in range(6):
        worst = max(worst, abs(error[k]))
    return worst


@jit
def factorise(newton: NewtonWorkspace, damping: float) -> float:
    """Fill the Cholesky factor of J J^T + damping; return its determinant."""
    J, G = newton.J, newton.G
    det = 1.0
    for i in range(6):
        for j in range(i + 1):
            total = 0.0
            for k in range(7):
                total += J[i, k] * J[j, k]
            for k in range(j):
                total -= G[i, k] * G[j, k]
            if i == j:
                total = max(total + damping, LEAST_PIVOT)
                det *= total
                # G[i, i] holds the inverse, so that nothing below divides.
                G[i, i] = 1.0 / np.sqrt(total)
            else:
                # A row's entry is complete once divided by the pivot of its column.
                G[i, j] = total * G[j, j]
    return det


@inner
def _solve(newton: NewtonWorkspace) -> None:
    """Replace x by the solution of (J J^T) y = x."""
    G, x = newton.G, newton.x
    for i in range(6):
        total = x[i]
        for k in range(i):
            total -= G[i, k] * x[k]
        x[i] = total * G[i, i]
    for i in range(5, -1, -1):
        total = x[i]
        for k in range(i + 1, 6):
            total -= G[k, i] * x[k]
        x[i] = total * G[i, i]


@jit
def step_to_goal(newton: NewtonWorkspace, q: FloatArray, longest: float) -> float:
    """Take the shortest step to the goal, cut to length `longest`; return its full length."""
    J, x, step = newton.J, newton.x, newton.step
    for i in range(6):
        x[i] = newton.error[i]
    _solve(newton)
    square = 0.0
    for k in range(7):
        total = 0.0
        for i in range(6):
            total += J[i, k] * x[i]
        step[k] = total
        square += total * total
    length = np.sqrt(square)
    fraction = 1.0 if length <= longest else longest / length
    for k in range(7):
        q[k] += fraction * step[k]
    return length


@jit
def null_space_direction(newton: NewtonWorkspace, before: FloatArray, tangent: FloatArray) -> float:
    """Fill the unit direction in which the tool stands still, on the side of `before`.

    Args:
        newton: Factorised.
        before: A unit vector, shape (7,).
        tangent: Filled, shape (7,).

    Returns:
        The cosine between the two; 0 where `before` has no part in that direction.
    """
    J, x = newton.J, newton.x
    for i in range(6):
        total = 0.0
        for k in range(7):
            total += J[i, k] * before[k]
        x[i] = total
    _solve(newton)
    square = 0.0
    for k in range(7):
        total = before[k]
        for i in range(6):
            total -= J[i, k] * x[i]
        tangent[k] = total
        square += total * total
    length = np.sqrt(square)
    if length > 0.0:
        for k in range(7):
            tangent[k] /= length
    return length


@jit
def converge(
    arm: NumericArm,
    R_AG: FloatArray,
    p_AG: FloatArray,
    q: FloatArray,
    newton: NewtonWorkspace,
    iterations: int,
    exact: float,
) -> bool:
    """Bring the tool to the goal from joint angles q, in place.

    Damping grows with the square of the error (Sugihara 2011): far from the goal steps are short
    and safe, close to it they are Newton's.

    Args:
        arm: The arm.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        q: Joint angles to start from [rad]; changed, shape (7,).
        newton: Workspace; holds the last evaluation.
        iterations: Greatest number of iterations.
        exact: Greatest error that will do [rad and m].

    Returns:
        Whether the tool is at the goal.
    """
    for _ in range(iterations):
        worst = evaluate(arm, R_AG, p_AG, q, newton)
        if worst < exact:
            return True
        factorise(newton, DAMPING * worst * worst)
        step_to_goal(newton, q, LONGEST_STEP)
    return False

"""Newton's method for a tool pose: error, Jacobian, the shortest step to the goal, the null space.

The arm has one joint more than a pose has coordinates. Of all steps that remove the error to first
order, the one taken is the shortest; the null-space direction moves the joints but not the tool.
One factorisation of J J^T gives both.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.kinematics import fill_jacobian, link_poses, place_tool, pose_error
from tcs.kernel.numeric.arm import NumericArm

LEAST_PIVOT = 1e-14
"""Lower bound of the pivots of J J^T: next to a singularity, steps are long but finite."""
LONGEST_STEP = 0.6
"""Greatest length of one step [rad, norm of the joints], within which J changes little."""
DAMPING = 0.1
"""Damping of J J^T, whose entries are about 1, per square of the error."""


class NewtonWorkspace(NamedTuple):
    """Kinematics and linear algebra at one posture, reused from posture to posture."""

    link_R: FloatArray
    """Orientations of the links in A, shape (8, 3, 3)."""
    link_p: FloatArray
    """Origins of the links in A [m], shape (8, 3)."""
    R_AT: FloatArray
    """Orientation of the tool in A, shape (3, 3)."""
    p_AT: FloatArray
    """Position of the tool in A [m], shape (3,)."""
    J: FloatArray
    """Jacobian of the tool, shape (6, 7), rows [angular; linear]."""
    G: FloatArray
    """Factor of J J^T, its diagonal inverted, shape (6, 6)."""
    error: FloatArray
    """Pose error: rotation vector [rad] and translation [m] in A, shape (6,)."""
    x: FloatArray
    """Right-hand side and solution, shape (6,)."""
    step: FloatArray
    """Change of the joints [rad], shape (7,)."""


@jit
def new_newton_workspace() -> NewtonWorkspace:
    """Return scratch memory for one worker."""
    return NewtonWorkspace(
        np.empty((8, 3, 3)),
        np.empty((8, 3)),
        np.empty((3, 3)),
        np.empty(3),
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
    """Fill pose error and Jacobian at joint angles q; return the error's largest absolute entry."""
    link_poses(arm.R, arm.p, q, newton.link_R, newton.link_p)
    place_tool(arm.R, arm.p, newton.link_R, newton.link_p, newton.R_AT, newton.p_AT)
    fill_jacobian(newton.link_R, newton.link_p, newton.p_AT, newton.J)
    return pose_error(newton.R_AT, newton.p_AT, R_AG, p_AG, newton.error)


@jit
def factorise(newton: NewtonWorkspace, damping: float) -> float:
    """Fill the Cholesky factor of J J^T + damping I; return the determinant of that matrix."""
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
                # The inverse of the diagonal avoids divisions below and in `_solve`.
                G[i, i] = 1.0 / np.sqrt(total)
            else:
                G[i, j] = total * G[j, j]
    return det


@inner
def _solve(newton: NewtonWorkspace) -> None:
    """Replace `newton.x` by (J J^T)^-1 x, with the factor in `newton.G`."""
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
    """Add the shortest step to the goal to q, limited to length `longest`.

    Returns:
        Length of the step before it was limited [rad, norm of the joints].
    """
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
    """Fill the normalised projection of `before` onto the null space.

    Args:
        newton: Workspace with the undamped factor of J J^T.
        before: Unit vector, shape (7,).
        tangent: Filled, shape (7,).

    Returns:
        Cosine of the angle between the two; 0 where `before` is orthogonal to the null space.
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

    Damping grows with the square of the error (Sugihara 2011): far from the goal steps are short,
    close to it they are Newton steps.

    Args:
        arm: The arm.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        q: Joint angles to start from [rad], shape (7,); updated.
        newton: Workspace; contains the last evaluation.
        iterations: Greatest number of iterations.
        exact: Error below which the iteration has converged [rad and m].

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

"""Poses of environment and goal in base and arm base at one initial configuration."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, move
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.workspace import Workspace


@jit
def place_base(problem: Problem, work: Workspace, rows: Rows, n: int) -> None:
    """Place the base at the pose of a row and express the environment in its frame.

    Args:
        problem: The scene.
        work: `R_BW`, `p_BW` and `environment_B` are filled.
        rows: The configurations.
        n: The row.
    """
    x, y, yaw = rows.x[n], rows.y[n], rows.yaw[n]
    c, s = np.cos(yaw), np.sin(yaw)
    R, p = work.R_BW, work.p_BW
    R[0, 0], R[0, 1], R[1, 0], R[1, 1] = c, s, -s, c
    p[0], p[1] = -(c * x + s * y), s * x - c * y
    environment = problem.environment.shapes[rows.state[n]]
    for j in range(len(environment)):
        move(R, p, environment, j, work.environment_B, j)


@inner
def shares_base(rows: Rows, n: int, other: int) -> bool:
    """Return whether two rows have the same environment state and base pose."""
    return (
        rows.state[n] == rows.state[other]
        and rows.x[n] == rows.x[other]
        and rows.y[n] == rows.y[other]
        and rows.yaw[n] == rows.yaw[other]
    )


@inner
def goal_in_arm_base(problem: Problem, work: Workspace, state: int, torso: int, g: int) -> None:
    """Fill the nominal pose of a goal in the arm base A, `work.R_AG` and `work.p_AG`."""
    pose_in_arm_base(problem, work, torso, problem.goals.R[state, g], problem.goals.p[state, g])


@inner
def pose_in_arm_base(
    problem: Problem, work: Workspace, torso: int, R_WG: FloatArray, p_WG: FloatArray
) -> None:
    """Fill the pose in the arm base A of a pose in W, `work.R_AG` and `work.p_AG`."""
    A, a = problem.arm_base.R[torso], problem.arm_base.p[torso]
    R_BW, p_BW, R_AG, p_AG = work.R_BW, work.p_BW, work.R_AG, work.p_AG
    for r in range(3):
        p_AG[r] = 0.0
        for c in range(3):
            R_AG[r, c] = 0.0
    for m in range(3):
        for c in range(3):
            total = 0.0
            for n in range(3):
                total += R_BW[m, n] * R_WG[n, c]
            for r in range(3):
                R_AG[r, c] += A[m, r] * total
        along = p_BW[m] - a[m]
        for n in range(3):
            along += R_BW[m, n] * p_WG[n]
        for r in range(3):
            p_AG[r] += A[m, r] * along


@inner
def environment_in_arm_base(problem: Problem, work: Workspace, torso: int) -> None:
    """Transform the environment from B to A and list the shapes within the arm's reach."""
    A, a = problem.arm_base.R[torso], problem.arm_base.p[torso]
    environment_B, environment_A = work.environment_B, work.environment_A
    count = 0
    for j in range(len(environment_B)):
        square = 0.0
        for r in range(3):
            along = 0.0
            for m in range(3):
                along += A[m, r] * (environment_B[j, CENTRE + m] - a[m])
            environment_A[j, CENTRE + r] = along
            square += along * along
        reach = problem.clearances.arm_radius + environment_B[j, BOUND]
        if square > reach * reach:
            continue
        work.near[count] = j
        count += 1
        for c in range(CENTRE):
            environment_A[j, c] = environment_B[j, c]
        for r in range(3):
            for c in range(3):
                total = 0.0
                for m in range(3):
                    total += A[m, r] * environment_B[j, ROTATION + 3 * m + c]
                environment_A[j, ROTATION + 3 * r + c] = total
    work.near_count[0] = count

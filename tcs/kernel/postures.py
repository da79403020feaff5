"""Tool poses, dexterity and contacts of given postures."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.base_pose import environment_in_arm_base, place_base
from tcs.kernel.cache import int_constant, jit
from tcs.kernel.contacts import (
    NO_CONTACT,
    arm_contact,
    gripper_body_contact,
    gripper_environment_contact,
)
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.kinematics import tool_pose
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace

HERE = int_constant(0)
"""Index of the first base pose and the first environment state."""


@jit
def tool_poses(
    chain_R: FloatArray, chain_p: FloatArray, q: FloatArray, R_AT: FloatArray, p_AT: FloatArray
) -> None:
    """Fill the tool poses in the arm base A of many postures.

    Args:
        chain_R: Rotations of the chain, shape (8, 3, 3).
        chain_p: Translations of the chain [m], shape (8, 3).
        q: Joint angles [rad], shape (n, 7).
        R_AT: Filled, shape (n, 3, 3).
        p_AT: Filled [m], shape (n, 3).
    """
    link_R, link_p = np.empty((8, 3, 3)), np.empty((8, 3))
    for i in range(len(q)):
        tool_pose(chain_R, chain_p, q[i], link_R, link_p, R_AT[i], p_AT[i])


@jit
def measures(owned_problem: Problem, q: FloatArray, value: FloatArray) -> None:
    """Fill `value`, shape (n,), with the problem's measure at joint angles q, shape (n, 7)."""
    problem = unowned(owned_problem)
    for i in range(len(q)):
        value[i] = measure_at(problem, q[i])


@jit
def free_postures(
    owned_problem: Problem, owned_work: Workspace, owned_row: Rows, q: FloatArray, free: BoolArray
) -> None:
    """Fill whether the arm touches neither the environment nor the robot itself at given postures.

    Goal i must be the tool pose of posture i. Base and torso are not checked against the
    environment.

    Args:
        owned_problem: The scene and its goals.
        owned_work: Scratch.
        owned_row: The initial configuration.
        q: Joint angles [rad], shape (n, 7).
        free: Filled, shape (n,).
    """
    problem, work, row = unowned(owned_problem), unowned(owned_work), unowned(owned_row)
    state, torso = row.state[0], row.torso[0]
    place_base(problem, work, row, 0)
    environment_in_arm_base(problem, work, torso)
    body_A = problem.body.shapes_A[torso]
    work.last[0] = -1
    for i in range(len(q)):
        free[i] = False
        if gripper_environment_contact(problem, work, state, i) != NO_CONTACT:
            continue
        tool_pose(
            problem.chain.R, problem.chain.p, q[i], work.link_R, work.link_p, work.R_AG, work.p_AG
        )
        if gripper_body_contact(problem, work, body_A) != NO_CONTACT:
            continue
        free[i] = arm_contact(problem, work, body_A, q[i]) == NO_CONTACT

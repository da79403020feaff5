"""Solutions of arms of six joints by Newton's method, checked for contacts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import Chain, FloatArray, IntArray
from tcs.kernel.base_pose import environment_in_arm_base, goal_in_arm_base, place_base
from tcs.kernel.cache import jit
from tcs.kernel.contacts import NO_CONTACT, arm_contact, at_goal, gripper_body_contact
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.verification.newton_solutions import newton_solutions, within
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace, new_workspace


def six_joint_scans(
    problem: Problem, rows: Rows, pairs: IntArray, joints: FloatArray
) -> NDArray[np.float64]:
    """Return the dexterity of the best collision-free solution of each pair, -1 where none is free.

    The solutions are those of `newton_solutions`. Contacts of base and gripper with the environment
    are not checked.

    Args:
        problem: The scene and its goals, with an arm of six joints.
        rows: Initial configurations.
        pairs: Rows whose base is free of contact, and goals at which the gripper is free of contact
            with the environment, shape (n, 2).
        joints: Filled with the joint angles of each solution [rad], shape (n, 7).
    """
    arm, work = problem.arm, new_workspace(problem)
    p = problem.chain_p
    slides = p[:7, 3].copy() if p.shape[1] > 3 else np.zeros(7)
    chain = Chain(problem.chain_R, p[:, :3].copy(), arm.lower, arm.upper, problem.joints, slides)
    values = np.full(len(pairs), -1.0)
    for i, (row, goal) in enumerate(pairs):
        if not _place(problem, work, rows, row, goal):
            continue
        postures = within(chain, newton_solutions(chain, work.R_AG.copy(), work.p_AG.copy()))
        torso = int(rows.torso[row])
        values[i] = _best(problem, work, torso, np.ascontiguousarray(postures), joints[i])
    return values


@jit
def _place(
    owned_problem: Problem, owned_work: Workspace, owned_rows: Rows, row: int, goal: int
) -> bool:
    """Place base, goal and environment; return whether the gripper is free of the body."""
    problem, work, rows = unowned(owned_problem), unowned(owned_work), unowned(owned_rows)
    state, torso = rows.state[row], rows.torso[row]
    place_base(problem, work, rows, row)
    goal_in_arm_base(problem, work, state, torso, goal)
    if gripper_body_contact(problem, work, problem.body_A[torso]) != NO_CONTACT:
        return False
    environment_in_arm_base(problem, work, torso)
    return True


@jit
def _best(
    owned_problem: Problem,
    owned_work: Workspace,
    torso: int,
    postures: FloatArray,
    joints: FloatArray,
) -> float:
    """Return the greatest dexterity of the collision-free postures, -1 if none is free."""
    problem, work = unowned(owned_problem), unowned(owned_work)
    best = -1.0
    for n in range(len(postures)):
        value = measure_at(problem, postures[n])
        contact = arm_contact(problem, work, problem.body_A[torso], postures[n])
        if value > best and contact == NO_CONTACT and at_goal(problem, work):
            best = value
            joints[:] = postures[n]
    return best

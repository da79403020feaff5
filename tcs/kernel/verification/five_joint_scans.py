"""Solutions of arms of five joints by Newton's method, checked for contacts."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import Chain, FloatArray
from tcs.kernel.base_pose import goal_in_arm_base, place_base
from tcs.kernel.cache import jit
from tcs.kernel.five_joints.turned import turned_chain
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.together.arms import keep_free, measures_of, place_gripper_pose
from tcs.kernel.verification.newton_solutions import newton_solutions, within
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace, new_workspace


def five_joint_scan(problem: Problem, row: Rows, goal: int, joints: FloatArray) -> float:
    """Return the dexterity of the best collision-free posture at a goal, -1 if none is free.

    The angle about the axis that the goal leaves free is found with the joints, by Newton's method
    from many starts. Contacts of the base with the environment are not checked.

    Args:
        problem: The scene and its goals, with an arm of five joints.
        row: An initial configuration.
        goal: A goal that leaves the rotation about `Problem.turn` free, and nothing else.
        joints: Filled with the joint angles of the posture [rad], shape (7,).
    """
    arm, work, p = problem.arm, new_workspace(problem), problem.chain_p
    slides = p[:7, 3].copy() if p.shape[1] > 3 else np.zeros(7)
    chain = Chain(problem.chain_R, p[:, :3].copy(), arm.lower, arm.upper, problem.joints, slides)
    turned = turned_chain(chain, problem.turn)
    state, torso = int(row.state[0]), int(row.torso[0])
    _place(problem, work, row, goal)
    best, R_WG, p_WG = -1.0, problem.goal_R[state, goal], problem.goal_p[state, goal]
    for solution in within(turned, newton_solutions(turned, work.R_AG.copy(), work.p_AG.copy())):
        u = np.array([-solution[6], 0.0, 0.0, 0.0, 0.0, 0.0])
        form = problem.freedom.form[goal]
        if not place_gripper_pose(problem, work, row, form, u, R_WG, p_WG):
            continue
        posture = np.concatenate([np.zeros(2), solution[1:6]])[None]
        if not keep_free(problem, work, torso, posture):
            continue
        value = float(measures_of(problem, posture)[0])
        if value > best:
            best, joints[:] = value, posture[0]
    return best


@jit
def _place(owned_problem: Problem, owned_work: Workspace, owned_row: Rows, goal: int) -> None:
    """Place base and goal in the arm base."""
    problem, work, row = unowned(owned_problem), unowned(owned_work), unowned(owned_row)
    place_base(problem, work, row, 0)
    goal_in_arm_base(problem, work, row.state[0], row.torso[0], goal)

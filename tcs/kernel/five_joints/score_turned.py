"""Score of one initial configuration at one goal, for an arm of five joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.errors import ArmClassError
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import pose_in_arm_base
from tcs.kernel.cache import inner, jit
from tcs.kernel.contacts import (
    NO_CONTACT,
    arm_contact,
    at_goal,
    gripper_body_contact,
    gripper_contact_at,
)
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.five_joints.turned import turned_arm
from tcs.kernel.freedom.forms import turned_about
from tcs.kernel.kinematics import copy_joints
from tcs.kernel.problem import Problem, chain_of
from tcs.kernel.scores import (
    ARM_BLOCKED,
    GRIPPER_BLOCKED_BY_ENVIRONMENT,
    GRIPPER_BLOCKED_BY_ROBOT,
    JOINT_LIMITS,
    REACHED,
    TOO_FAR,
)
from tcs.kernel.six_joints.arm import SixJointArm
from tcs.kernel.six_joints.solutions import MOST_SOLUTIONS, solve_six_joints, within_limits
from tcs.kernel.workspace import Workspace

TRIED = -1.0
"""Measure of a solution that is in contact."""
NOT_TURNED = 1e-7
"""Greatest rotation about the axis of a solution for a single pose [rad]."""


class FiveJointSolver(NamedTuple):
    """Constants of an arm whose goals are free about one axis, and scratch memory of one worker."""

    arm: SixJointArm
    """The arm with the rotation about the axis as its sixth joint, `turned_chain`."""
    solutions: FloatArray
    """Solutions within the joint limits [rad], shape (MOST_SOLUTIONS, 7)."""
    angle: FloatArray
    """Angle of the tool about the axis at each, from the goal on [rad], shape (MOST_SOLUTIONS,)."""
    kept: IntArray
    """Their number, shape (1,)."""
    measure: FloatArray
    """Their measures, shape (MOST_SOLUTIONS,)."""
    best: FloatArray
    """Joint angles of the best solution [rad], shape (7,)."""


def new_five_joint_solver(problem: Problem) -> FiveJointSolver:
    """Return the solver of a problem's arm, with scratch memory for one worker.

    Raises:
        ArmClassError: If the goals leave no rotation of the tool free, or one that the arm cannot
            make up for.
    """
    if not np.any(problem.goals.turn):
        raise ArmClassError(
            "an arm of five joints cannot take every tool pose: its goals must leave a rotation of "
            "the tool free."
        )
    return FiveJointSolver(
        turned_arm(chain_of(problem), problem.goals.turn),
        np.empty((MOST_SOLUTIONS, 7)),
        np.empty(MOST_SOLUTIONS),
        np.zeros(1, np.int64),
        np.empty(MOST_SOLUTIONS),
        np.empty(7),
    )


@jit
def solve_turned(solver: FiveJointSolver, R_AG: FloatArray, p_AG: FloatArray) -> int:
    """Fill the solutions and angles for a tool pose that is free to rotate about the axis.

    Args:
        solver: Its solutions, angles and their number within the joint limits are filled.
        R_AG: Tool orientation in A at angle 0, shape (3, 3).
        p_AG: Tool position in A [m], shape (3,).

    Returns:
        Number of solutions, joint limits left aside.
    """
    found = solve_six_joints(solver.arm, R_AG, p_AG, solver.solutions)
    kept = within_limits(solver.arm, solver.solutions, found)
    for n in range(kept):
        q = solver.solutions[n]
        solver.angle[n] = -q[6]
        for k in range(6, 1, -1):
            q[k] = q[k - 1]
        q[0] = q[1] = 0.0
    solver.kept[0] = kept
    return found


@inner
def out_of_reach(problem: Problem, work: Workspace, solver: FiveJointSolver) -> int:
    """Return TOO_FAR without a solution, JOINT_LIMITS if all exceed the limits, else REACHED.

    This is for a single tool pose, which an arm of five joints meets only if it was made for it.

    Args:
        problem: The scene.
        work: Workspace with the goal in A.
        solver: The arm's solver; its solutions are filled.
    """
    found = solve_turned(solver, work.R_AG, work.p_AG)
    kept = 0
    for n in range(solver.kept[0]):
        if abs(solver.angle[n]) < NOT_TURNED:
            copy_joints(solver.solutions[n], solver.solutions[kept])
            solver.angle[kept] = 0.0
            kept += 1
    is_outside = found > 0 and solver.kept[0] == 0
    solver.kept[0] = kept
    if kept:
        return REACHED
    return JOINT_LIMITS if is_outside else TOO_FAR


@inner
def score_pair(
    problem: Problem, work: Workspace, body_A: FloatArray, solver: FiveJointSolver
) -> tuple[int, int]:
    """Score one goal of a single pose, base and gripper being free of contact.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        solver: From `out_of_reach`; `best` is filled with the joint angles [rad] of the solution if
            the goal is reached.

    Returns:
        Reason and contact code, that of the last solution tried if none is free.
    """
    contact = NO_CONTACT
    for n in range(solver.kept[0]):
        contact = arm_contact(problem, work, body_A, solver.solutions[n])
        if contact == NO_CONTACT and at_goal(problem, work):
            copy_joints(solver.solutions[n], solver.best)
            return REACHED, NO_CONTACT
    return ARM_BLOCKED, contact


@inner
def score_turned(
    problem: Problem,
    work: Workspace,
    body_A: FloatArray,
    state: int,
    torso: int,
    R: FloatArray,
    p: FloatArray,
    least: float,
    near: bool,
    solver: FiveJointSolver,
) -> tuple[int, int]:
    """Score a tool pose that is free to rotate about the axis; nothing is checked before.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        body_A: The robot's other shapes in A at the current torso level.
        state: The environment state.
        torso: The torso level.
        R: Tool orientation in W at angle 0, shape (3, 3).
        p: Tool position in W [m], shape (3,).
        least: Without use here: all solutions are as quick to find as some.
        near: Without use as well.
        solver: `best` is filled with the joint angles [rad] of the best solution if there is one.

    Returns:
        Reason and contact code, those of the solution with the highest measure if none is free.
    """
    pose_in_arm_base(problem, work, torso, R, p)
    found = solve_turned(solver, work.R_AG, work.p_AG)
    count = solver.kept[0]
    if count == 0:
        return JOINT_LIMITS if found else TOO_FAR, NO_CONTACT
    for n in range(count):
        solver.measure[n] = measure_at(problem, solver.solutions[n])
    R_WT = np.empty((3, 3))
    first_why, first_contact = ARM_BLOCKED, NO_CONTACT
    for tries in range(count):
        top = np.argmax(solver.measure[:count])
        turned_about(R, problem.goals.turn, solver.angle[top], R_WT)
        why = GRIPPER_BLOCKED_BY_ENVIRONMENT
        contact = gripper_contact_at(problem, work, state, R_WT, p)
        if contact == NO_CONTACT:
            pose_in_arm_base(problem, work, torso, R_WT, p)
            why = GRIPPER_BLOCKED_BY_ROBOT
            contact = gripper_body_contact(problem, work, body_A)
        if contact == NO_CONTACT:
            why = ARM_BLOCKED
            contact = arm_contact(problem, work, body_A, solver.solutions[top])
            if contact == NO_CONTACT and at_goal(problem, work):
                copy_joints(solver.solutions[top], solver.best)
                return REACHED, NO_CONTACT
        if tries == 0:
            first_why, first_contact = why, contact
        solver.measure[top] = TRIED
    return first_why, first_contact

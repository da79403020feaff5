"""Score of one initial configuration at one goal, for an arm of six joints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.contacts import NO_CONTACT, arm_contact, at_goal
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.kinematics import copy_joints
from tcs.kernel.problem import Problem, chain_of
from tcs.kernel.scores import ARM_BLOCKED, JOINT_LIMITS, REACHED, TOO_FAR
from tcs.kernel.six_joints.arm import SixJointArm, six_joint_arm
from tcs.kernel.six_joints.solutions import MOST_SOLUTIONS, solve_six_joints, within_limits
from tcs.kernel.workspace import Workspace

TRIED = -1.0
"""Measure of a solution that is in contact."""


class SixJointSolver(NamedTuple):
    """Constants of an arm, and scratch memory of one worker."""

    arm: SixJointArm
    solutions: FloatArray
    """Solutions within the joint limits [rad], shape (MOST_SOLUTIONS, 7)."""
    kept: IntArray
    """Their number, shape (1,)."""
    measure: FloatArray
    """Their measures, shape (MOST_SOLUTIONS,)."""
    best: FloatArray
    """Joint angles of the best solution [rad], shape (7,)."""


def new_six_joint_solver(problem: Problem) -> SixJointSolver:
    """Return the solver of a problem's arm, with scratch memory for one worker."""
    return SixJointSolver(
        six_joint_arm(chain_of(problem)),
        np.empty((MOST_SOLUTIONS, 7)),
        np.zeros(1, np.int64),
        np.empty(MOST_SOLUTIONS),
        np.empty(7),
    )


@inner
def out_of_reach(problem: Problem, work: Workspace, solver: SixJointSolver) -> int:
    """Return TOO_FAR without a solution, JOINT_LIMITS if all exceed the limits, else REACHED.

    Args:
        problem: The scene.
        work: Workspace with the goal in A.
        solver: The arm's solver; its solutions are filled.
    """
    found = solve_six_joints(solver.arm, work.R_AG, work.p_AG, solver.solutions)
    solver.kept[0] = within_limits(solver.arm, solver.solutions, found)
    if found == 0:
        return TOO_FAR
    return REACHED if solver.kept[0] else JOINT_LIMITS


@inner
def score_pair(
    problem: Problem, work: Workspace, body_A: FloatArray, solver: SixJointSolver
) -> tuple[int, int]:
    """Score one goal within reach, base and gripper being free of contact.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        solver: From `out_of_reach`; `best` is filled with the joint angles [rad] of the solution if
            the goal is reached.

    Returns:
        Reason and contact code, that of the solution with the highest measure.
    """
    return quick_look(problem, work, body_A, TRIED, solver)


@inner
def quick_look(
    problem: Problem, work: Workspace, body_A: FloatArray, least: float, solver: SixJointSolver
) -> tuple[int, int]:
    """Score one goal as `score_pair`, leaving out solutions whose measure is not above a bound.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        least: The bound; negative for none.
        solver: As for `score_pair`.
    """
    count, first_contact = solver.kept[0], NO_CONTACT
    for n in range(count):
        solver.measure[n] = measure_at(problem, solver.solutions[n])
    for tries in range(count):
        top = np.argmax(solver.measure[:count])
        if solver.measure[top] <= least:
            break
        q = solver.solutions[top]
        contact = arm_contact(problem, work, body_A, q)
        if contact == NO_CONTACT and at_goal(problem, work):
            copy_joints(q, solver.best)
            return REACHED, NO_CONTACT
        if tries == 0:
            first_contact = contact
        solver.measure[top] = TRIED
    return ARM_BLOCKED, first_contact

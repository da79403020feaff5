"""Score of one initial configuration at one goal, over the freedom of the goal."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import pose_in_arm_base
from tcs.kernel.cache import inner
from tcs.kernel.contacts import (
    NO_CONTACT,
    Workspace,
    gripper_body_contact,
    gripper_contact_at,
)
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.freedom.forms import HALF, PARAMETERS, TILT, pose_of
from tcs.kernel.kinematics import copy_joints
from tcs.kernel.problem import Problem
from tcs.kernel.scores import (
    ARM_BLOCKED,
    GRIPPER_BLOCKED_BY_ENVIRONMENT,
    GRIPPER_BLOCKED_BY_ROBOT,
    JOINT_LIMITS,
    REACHED,
    TOO_FAR,
)
from tcs.kernel.solvers import Solver, out_of_reach, score_pair

ROUNDS = 5
"""Number of refinement rounds; each halves the distance of the poses tried from the best one."""
PROMISING = 2
"""Progress of a pose from which further poses next to it are tried."""


@inner
def score_pose(
    problem: Problem, work: Workspace, body_A: FloatArray, solver: Solver
) -> tuple[int, int]:
    """Score the tool pose in `work.R_AG` and `work.p_AG`; the gripper is free of the environment.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        body_A: The robot's other shapes in A at the current torso level.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.

    Returns:
        Reason and contact code.
    """
    reason = out_of_reach(problem, work, solver)
    if reason == TOO_FAR:
        return reason, NO_CONTACT
    code = gripper_body_contact(problem, work, body_A)
    if code != NO_CONTACT:
        return GRIPPER_BLOCKED_BY_ROBOT, code
    if reason != REACHED:
        return reason, NO_CONTACT
    return score_pair(problem, work, body_A, solver)


@inner
def score_free(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    state: int,
    torso: int,
    g: int,
) -> tuple[int, int]:
    """Score a goal over its freedom: the best of its poses, refined.

    The samples are tried first. Where none reaches the goal, those between samples that come close
    follow. About the best pose, each free parameter is then varied by half the spacing, a quarter,
    and so on.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.
        grippers: Contact codes of the gripper with the environment at each pose, shape (states,
            poses).
        state: The environment state.
        torso: The torso level.
        g: The goal.

    Returns:
        Reason and contact code, those of the first pose that comes farthest.
    """
    free, body_A = problem.freedom, problem.body_A[torso]
    R_WG, p_WG, form = problem.goal_R[state, g], problem.goal_p[state, g], free.form[g]
    R, p = np.empty((3, 3)), np.empty(3)
    first, samples = free.first[g], free.samples[g]
    reason, contact, farthest = TOO_FAR, NO_CONTACT, -1
    if _is_out_of_span(problem, work, state, torso, g):
        return TOO_FAR, NO_CONTACT
    progress = np.zeros(samples, np.int64)
    best, value, top = np.empty(7), -1.0, -1
    for n in range(free.first[g + 1] - first):
        if n >= samples:
            if top >= 0:
                break
            near = free.parents[first + n]
            if progress[near[0]] < PROMISING and progress[near[1]] < PROMISING:
                continue
        why, code = GRIPPER_BLOCKED_BY_ENVIRONMENT, grippers[state, first + n]
        if code == NO_CONTACT:
            pose_of(form, free.u[first + n], R_WG, p_WG, R, p)
            pose_in_arm_base(problem, work, torso, R, p)
            why, code = score_pose(problem, work, body_A, solver)
        if why == REACHED:
            measure = measure_at(problem, solver.best)
            if measure > value:
                value, top = measure, n
                copy_joints(solver.best, best)
        came = progress_of(why)
        if n < samples:
            progress[n] = came
        if came > farthest:
            farthest, reason, contact = came, why, code
    if top < 0:
        return reason, contact
    _refine(problem, work, solver, state, torso, g, free.u[first + top], best, value)
    copy_joints(best, solver.best)
    return REACHED, NO_CONTACT


@inner
def _refine(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    state: int,
    torso: int,
    g: int,
    start: FloatArray,
    best: FloatArray,
    value: float,
) -> None:
    """Climb from the pose with parameters `start` to a better one; `best` gets its joints."""
    free, body_A = problem.freedom, problem.body_A[torso]
    R_WG, p_WG, form = problem.goal_R[state, g], problem.goal_p[state, g], free.form[g]
    R, p, u, trial = np.empty((3, 3)), np.empty(3), start.copy(), np.empty(PARAMETERS)
    scale = 1.0
    for _ in range(ROUNDS):
        scale *= 0.5
        for parameter in range(PARAMETERS):
            step = scale * free.step[g, parameter]
            if step == 0.0:
                continue
            for side in range(2):
                for k in range(PARAMETERS):
                    trial[k] = u[k]
                trial[parameter] += step if side == 0 else -step
                clip(form, trial)
                pose_of(form, trial, R_WG, p_WG, R, p)
                if gripper_contact_at(problem, work, state, R, p) != NO_CONTACT:
                    continue
                pose_in_arm_base(problem, work, torso, R, p)
                why, _ = score_pose(problem, work, body_A, solver)
                if why != REACHED:
                    continue
                measure = measure_at(problem, solver.best)
                if measure > value:
                    value = measure
                    copy_joints(solver.best, best)
                    for k in range(PARAMETERS):
                        u[k] = trial[k]
                    break


@inner
def clip(form: FloatArray, u: FloatArray) -> None:
    """Move the parameters u of a freedom into its bounds, in place."""
    tilt = np.hypot(u[1], u[2])
    if tilt > form[TILT]:
        u[1] *= form[TILT] / tilt
        u[2] *= form[TILT] / tilt
    for k in range(3):
        half = form[HALF + k]
        u[3 + k] = min(max(u[3 + k], -half), half)


@inner
def progress_of(reason: int) -> int:
    """Return how far a pose came: 0 out of reach, up to 4 for a contact of the arm."""
    if reason == ARM_BLOCKED or reason == REACHED:
        return 4
    if reason == JOINT_LIMITS:
        return 3
    if reason == GRIPPER_BLOCKED_BY_ROBOT:
        return 2
    return 1 if reason == GRIPPER_BLOCKED_BY_ENVIRONMENT else 0


@inner
def _is_out_of_span(problem: Problem, work: Workspace, state: int, torso: int, g: int) -> bool:
    """Return whether the goal is farther from the arm base than the arm is long."""
    free = problem.freedom
    pose_in_arm_base(problem, work, torso, problem.goal_R[state, g], problem.goal_p[state, g])
    away = 0.0
    for r in range(3):
        away += work.p_AG[r] * work.p_AG[r]
    half = free.form[g, HALF : HALF + 3]
    slack = np.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
    return away > (free.reach + slack) ** 2

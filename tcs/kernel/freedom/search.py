"""Score of one initial configuration at one goal, over the freedom of the goal."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import pose_in_arm_base
from tcs.kernel.cache import inner
from tcs.kernel.contacts import NO_CONTACT, Workspace, gripper_contact_at
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.freedom.forms import FEWEST_JOINTS, HALF, PARAMETERS, TILT, pose_of
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
from tcs.kernel.solvers import THOROUGH, Solver, is_seen_in_reach, score_pose

ROUNDS = 5
"""Number of refinement rounds; each halves the distance of the poses tried from the best one."""
PROMISING = 2
"""Progress of a sample from which further poses next to it are tried."""
CLOSE, PART = 4, 3
"""Progress from which all of the poses next to a sample of any orientation are tried; next to
others, one in PART is."""
NEAR = 0.96
"""Fraction of the best measure so far that a quick look at another sample has to show: the measures
at samples of the free joint are this close to the best between them."""
ANY = -1.0
"""Bound of a measure that every solution exceeds."""


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

    The samples are tried first. Where none reaches the goal, further poses follow next to those
    that come close, until one reaches it. About the best pose, each free parameter is then varied
    by half the spacing, a quarter, and so on.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.
        grippers: Contact codes of the gripper with the environment at each sample, shape (states,
            samples).
        state: The environment state.
        torso: The torso level.
        g: The goal.

    Returns:
        Reason and contact code, those of the first pose that comes farthest.
    """
    free, body_A = problem.freedom, problem.body_A[torso]
    R_WG, p_WG, form = problem.goal_R[state, g], problem.goal_p[state, g], free.form[g]
    R, p = np.empty((3, 3)), np.empty(3)
    reason, contact, farthest = TOO_FAR, NO_CONTACT, -1
    if _is_out_of_span(problem, work, state, torso, g):
        return TOO_FAR, NO_CONTACT
    start, samples = free.start[g], free.first[g + 1] - free.first[g]
    progress = np.zeros(samples, np.int64)
    # Poses of any orientation are many: what one of them leaves out, another one finds.
    usual = ANY if form[TILT] >= np.pi else THOROUGH
    best, value, top, least = np.empty(7), -1.0, -1, usual
    for n in range(samples):
        pose_of(form, free.u[start + n], R_WG, p_WG, R, p)
        why, code = GRIPPER_BLOCKED_BY_ENVIRONMENT, grippers[state, free.first[g] + n]
        if code == NO_CONTACT:
            why, code = score_pose(problem, work, body_A, state, torso, R, p, least, solver)
        if why == REACHED:
            measure = measure_at(problem, solver.best)
            if measure > value:
                value, top, least = measure, n, NEAR * measure
                copy_joints(solver.best, best)
        came = progress_of(why)
        progress[n] = came
        if why == GRIPPER_BLOCKED_BY_ENVIRONMENT and top < 0:
            # A pose nearby, at which the gripper is free, may be reached. An arm of five joints
            # looks at its gripper only where it reaches the pose.
            pose_in_arm_base(problem, work, torso, R, p)
            if problem.joints == FEWEST_JOINTS or is_seen_in_reach(problem, work, solver):
                progress[n] = CLOSE
        if came > farthest:
            farthest, reason, contact = came, why, code
    n = 0
    while top < 0 and n < samples:
        first, last = free.child_first[start + n], free.child_first[start + n + 1]
        if progress[n] < PROMISING:
            last = first
        elif form[TILT] >= np.pi and progress[n] < CLOSE:
            last = first + (last - first) // PART
        for child in range(first, last):
            k = free.children[child]
            nearest = free.parents[start + k, 0]
            if nearest != n and progress[nearest] >= progress[n]:
                # Tried as a pose next to the other sample.
                continue
            pose_of(form, free.u[start + k], R_WG, p_WG, R, p)
            why, code = GRIPPER_BLOCKED_BY_ENVIRONMENT, NO_CONTACT
            if problem.joints > FEWEST_JOINTS:
                code = gripper_contact_at(problem, work, state, R, p)
            if code == NO_CONTACT:
                why, code = score_pose(problem, work, body_A, state, torso, R, p, usual, solver)
            came = progress_of(why)
            if came > farthest:
                farthest, reason, contact = came, why, code
            if why == REACHED:
                value, top = measure_at(problem, solver.best), k
                copy_joints(solver.best, best)
                break
        n += 1
    if top < 0:
        return reason, contact
    _refine(problem, work, solver, state, torso, g, free.u[start + top], best, value)
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
                if problem.joints > FEWEST_JOINTS and (
                    gripper_contact_at(problem, work, state, R, p) != NO_CONTACT
                ):
                    continue
                least = NEAR * value
                why, _ = score_pose(problem, work, body_A, state, torso, R, p, least, solver)
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

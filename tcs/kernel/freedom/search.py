"""Score of one initial configuration at one goal, over the freedom of the goal."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import pose_in_arm_base
from tcs.kernel.cache import inner
from tcs.kernel.contacts import NO_CONTACT, gripper_contact_at
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.freedom.cap import cap_cosine, cap_pose, norm
from tcs.kernel.freedom.forms import FEWEST_JOINTS, HALF, PARAMETERS, TILT, pose_of
from tcs.kernel.freedom.goals import FreeGoals
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
from tcs.kernel.solvers import THOROUGH, Solver, score_pose
from tcs.kernel.workspace import Workspace

ROUNDS = 5
"""Number of refinement rounds; each halves the distance of the poses tried from the best one."""
PROMISING = 2
"""Progress of a sample from which further poses next to it are tried."""
CLOSE, PART = 4, 3
"""Progress from which all of the poses next to a sample of any orientation are tried; next to
others, one in PART is."""
NONE, SOME, ALL = 0, 1, 2
"""How many of the poses next to a sample are tried."""
WIDEST_CAP = 0.5
"""Least cosine of the half-angle of a cap in which poses are made: a quarter of all directions."""
IN_CAP, TRIES_IN_CAP = 1000, 100
"""Number of poses made in a cap, and of those that are scored: at which the gripper is free."""
NEAR = 0.96
"""Fraction of the best measure so far that a quick look at another sample has to show: the measures
at samples of the free joint are this close to the best between them."""
ANY = -1.0
"""Bound of a measure that every solution exceeds."""


class PlacedGoal(NamedTuple):
    """A goal at an initial configuration, whose base is in place."""

    state: int
    """The environment state."""
    torso: int
    """The torso level."""
    goal: int
    """The goal."""


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

    The samples are tried first. Where none reaches the goal, further poses follow, until one
    reaches it: those next to samples that come close, then, where any orientation serves, poses
    made within reach. About the best pose, each free parameter is then varied by half the spacing,
    a quarter, and so on.

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
    free, form = problem.freedom, problem.freedom.form[g]
    goal = PlacedGoal(state, torso, g)
    pivot, best, u = np.empty(3), np.empty(7), np.empty(PARAMETERS)
    _pivot_in_goal(problem, work, goal, pivot)
    if _is_out_of_span(problem, pivot, g):
        return TOO_FAR, NO_CONTACT
    worth = np.empty(free.first[g + 1] - free.first[g], np.int64)
    top, reason, contact = _try_samples(problem, work, solver, grippers, goal, pivot, worth, best)
    if top < 0:
        top, reason, contact = _try_next_to(
            problem, work, solver, goal, pivot, worth, reason, contact
        )
        if top >= 0:
            copy_joints(solver.best, best)
    if top >= 0:
        for k in range(PARAMETERS):
            u[k] = free.u[free.start[g] + top, k]
    elif form[TILT] < np.pi or not _try_cap(problem, work, solver, goal, pivot, u):
        return reason, contact
    else:
        copy_joints(solver.best, best)
    _refine(problem, work, solver, goal, u, best, measure_at(problem, best))
    copy_joints(best, solver.best)
    return REACHED, NO_CONTACT


@inner
def _try_samples(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    goal: PlacedGoal,
    pivot: FloatArray,
    worth: IntArray,
    best: FloatArray,
) -> tuple[int, int, int]:
    """Try all samples of a goal.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: The arm's solver.
        grippers: As for `score_free`.
        goal: The goal.
        pivot: The pivot in the frame of the goal [m], shape (3,).
        worth: Filled with how many of the poses next to each sample are worth a try: ALL, SOME or
            NONE; shape (samples,).
        best: Filled with the joint angles [rad] at the best sample.

    Returns:
        The best sample, or -1; reason and contact code of the first one that comes farthest.
    """
    free, state, g = problem.freedom, goal.state, goal.goal
    form, start = free.form[g], free.start[g]
    any_orientation = form[TILT] >= np.pi
    reason, contact, farthest = TOO_FAR, NO_CONTACT, -1
    # Poses of any orientation are many: what one of them leaves out, another one finds.
    value, top, least = -1.0, -1, ANY if any_orientation else THOROUGH
    for n in range(len(worth)):
        worth[n] = ALL
        if not _is_within_reach(free, start + n, pivot):
            # The edge of what is within reach may be next to it.
            continue
        why, code = GRIPPER_BLOCKED_BY_ENVIRONMENT, grippers[state, free.first[g] + n]
        if code == NO_CONTACT:
            why, code = _score_at(problem, work, solver, goal, free.u[start + n], least)
            if why == REACHED:
                measure = measure_at(problem, solver.best)
                if measure > value:
                    value, top, least = measure, n, NEAR * measure
                    copy_joints(solver.best, best)
            came = progress_of(why)
            if came < PROMISING:
                worth[n] = NONE
            elif any_orientation and came < CLOSE:
                worth[n] = SOME
        came = progress_of(why)
        if came > farthest:
            farthest, reason, contact = came, why, code
    return top, reason, contact


@inner
def _try_next_to(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    goal: PlacedGoal,
    pivot: FloatArray,
    worth: IntArray,
    reason: int,
    contact: int,
) -> tuple[int, int, int]:
    """Try further poses next to the samples, until one reaches the goal.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.
        goal: The goal.
        pivot: The pivot in the frame of the goal [m], shape (3,).
        worth: From `_try_samples`.
        reason: Reason of the sample that came farthest.
        contact: Contact code of that sample.

    Returns:
        The pose that reaches the goal, or -1; reason and contact code as `_try_samples`.
    """
    free, g, R, p = problem.freedom, goal.goal, np.empty((3, 3)), np.empty(3)
    form, start = free.form[g], free.start[g]
    R_WG, p_WG = problem.goal_R[goal.state, g], problem.goal_p[goal.state, g]
    usual = ANY if form[TILT] >= np.pi else THOROUGH
    farthest = progress_of(reason)
    for n in range(len(worth)):
        first, last = free.child_first[start + n], free.child_first[start + n + 1]
        if worth[n] == NONE:
            continue
        if worth[n] == SOME:
            last = first + (last - first) // PART
        for child in range(first, last):
            k = free.children[child]
            if not _is_within_reach(free, start + k, pivot):
                continue
            nearest = free.parents[start + k, 0]
            if nearest != n and worth[nearest] >= worth[n]:
                # Tried as a pose next to the other sample.
                continue
            why, code = GRIPPER_BLOCKED_BY_ENVIRONMENT, NO_CONTACT
            if problem.joints > FEWEST_JOINTS:
                pose_of(form, free.u[start + k], R_WG, p_WG, R, p)
                code = gripper_contact_at(problem, work, goal.state, R, p)
            if code == NO_CONTACT:
                why, code = _score_at(problem, work, solver, goal, free.u[start + k], usual)
            if why == REACHED:
                return k, why, code
            came = progress_of(why)
            if came > farthest:
                farthest, reason, contact = came, why, code
    return -1, reason, contact


@inner
def _try_cap(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    goal: PlacedGoal,
    pivot: FloatArray,
    u: FloatArray,
) -> bool:
    """Try poses made within reach of a goal that any orientation serves, until one reaches it.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.
        goal: The goal.
        pivot: The pivot in the frame of the goal [m], shape (3,).
        u: Filled with the parameters of the pose that reaches the goal.
    """
    free, g, R, p = problem.freedom, goal.goal, np.empty((3, 3)), np.empty(3)
    form, reach = free.form[g], free.reach
    R_WG, p_WG = problem.goal_R[goal.state, g], problem.goal_p[goal.state, g]
    cosine = cap_cosine(reach.wrist, pivot, reach.span)
    if cosine < WIDEST_CAP or cosine > 1.0:
        return False
    tries = 0
    for n in range(IN_CAP):
        if tries == TRIES_IN_CAP:
            break
        cap_pose(form, reach.wrist, pivot, cosine, n, u)
        pose_of(form, u, R_WG, p_WG, R, p)
        if gripper_contact_at(problem, work, goal.state, R, p) != NO_CONTACT:
            continue
        if _score_at(problem, work, solver, goal, u, ANY)[0] == REACHED:
            return True
        tries += 1
    return False


@inner
def _score_at(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    goal: PlacedGoal,
    u: FloatArray,
    least: float,
) -> tuple[int, int]:
    """Score the pose with parameters u, the gripper being free of the environment."""
    state, torso, g, R, p = goal.state, goal.torso, goal.goal, np.empty((3, 3)), np.empty(3)
    R_WG, p_WG, body_A = problem.goal_R[state, g], problem.goal_p[state, g], problem.body_A[torso]
    pose_of(problem.freedom.form[g], u, R_WG, p_WG, R, p)
    return score_pose(problem, work, body_A, state, torso, R, p, least, solver)


@inner
def _refine(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    goal: PlacedGoal,
    u: FloatArray,
    best: FloatArray,
    value: float,
) -> None:
    """Climb from the pose with parameters u to a better one; u and `best` follow."""
    free, state, torso, g = problem.freedom, goal.state, goal.torso, goal.goal
    body_A, form = problem.body_A[torso], free.form[g]
    R_WG, p_WG = problem.goal_R[state, g], problem.goal_p[state, g]
    R, p, trial = np.empty((3, 3)), np.empty(3), np.empty(PARAMETERS)
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
def _pivot_in_goal(problem: Problem, work: Workspace, goal: PlacedGoal, pivot: FloatArray) -> None:
    """Fill the position of the pivot in the frame of the goal [m], shape (3,)."""
    R_WG, p_WG = problem.goal_R[goal.state, goal.goal], problem.goal_p[goal.state, goal.goal]
    pose_in_arm_base(problem, work, goal.torso, R_WG, p_WG)
    R, p, at = work.R_AG, work.p_AG, problem.freedom.reach.pivot
    for k in range(3):
        pivot[k] = 0.0
        for r in range(3):
            pivot[k] += R[r, k] * (at[r] - p[r])


@inner
def _is_out_of_span(problem: Problem, pivot: FloatArray, g: int) -> bool:
    """Return whether the wrist is out of reach at every pose of a goal."""
    free = problem.freedom
    half = free.form[g, HALF : HALF + 3]
    return norm(pivot) > free.reach.span + norm(half) + norm(free.reach.wrist)


@inner
def _is_within_reach(free: FreeGoals, pose: int, pivot: FloatArray) -> bool:
    """Return whether the wrist is within reach of the pivot at a pose, by its row."""
    x = free.wrist[pose, 0] - pivot[0]
    y = free.wrist[pose, 1] - pivot[1]
    z = free.wrist[pose, 2] - pivot[2]
    return x * x + y * y + z * z <= free.reach.span * free.reach.span

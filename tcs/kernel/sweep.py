"""Score initial configurations at every goal."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.base_pose import (
    environment_in_arm_base,
    goal_in_arm_base,
    place_base,
    shares_base,
)
from tcs.kernel.cache import inner, jit
from tcs.kernel.contacts import (
    BASE_FIXED,
    NO_CONTACT,
    base_contact,
    gripper_body_contact,
    gripper_contact_at,
    gripper_environment_contact,
    upper_contact,
)
from tcs.kernel.dexterity import ANY
from tcs.kernel.dexterity.measures import measure_at, rounded_inward
from tcs.kernel.freedom.forms import ANGLES, FEWEST_JOINTS, PARAMETERS, pose_of
from tcs.kernel.freedom.goals import FreeGoals
from tcs.kernel.freedom.search import UNKNOWN, angles_of, score_free, turned_parameters
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.scores import (
    BODY_BLOCKED,
    GRIPPER_BLOCKED_BY_ENVIRONMENT,
    GRIPPER_BLOCKED_BY_ROBOT,
    NEARNESS,
    REACHED,
    TOO_FAR,
    Scores,
    new_scores,
)
from tcs.kernel.solvers import Solver, new_solver, out_of_reach, score_pair
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace, new_workspace


def gripper_contacts(problem: Problem) -> IntArray:
    """Return the contact codes of the gripper with the environment, shape (states, poses).

    With the tool at a pose they are independent of the base pose. If something is free, there is
    one code for each sample, in the order of `FreeGoals.codes`: shape (states, codes). Of poses
    that an arm of five joints turns, they are NO_CONTACT: the gripper is checked when the arm is
    solved.
    """
    states, first = len(problem.goals.p), problem.goals.freedom.codes
    poses = int(first[-1]) if first.size else problem.goals.p.shape[1]
    if problem.chain.joints == FEWEST_JOINTS:
        return np.full((states, poses), NO_CONTACT, np.int64)
    codes = np.empty((states, poses), np.int64)
    _gripper_contacts(problem, freedom_if_any(problem), new_workspace(problem), codes)
    return codes


def freedom_if_any(problem: Problem) -> FreeGoals | None:
    """Return the freedom of the goals; None leaves what is for it out of the compiled code."""
    return problem.goals.freedom if problem.goals.freedom.first.size else None


@jit
def _gripper_contacts(
    owned_problem: Problem, free: FreeGoals | None, owned_work: Workspace, codes: IntArray
) -> None:
    problem, work = unowned(owned_problem), unowned(owned_work)
    for s in range(codes.shape[0]):
        for g in range(problem.goals.p.shape[1]):
            if free is None:
                codes[s, g] = gripper_environment_contact(problem, work, s, g)
            else:
                _sampled_contacts(problem, free, work, s, g, codes)


@inner
def _sampled_contacts(
    problem: Problem, free: FreeGoals, work: Workspace, s: int, g: int, codes: IntArray
) -> None:
    """Fill the contact codes of the gripper at the samples of a pose.

    Where the last joint turns the tool, each sample has codes of several angles. The fine ones of
    the nominal pose are left UNKNOWN unless all others are blocked.
    """
    R, p, u = np.empty((3, 3)), np.empty(3), np.empty(PARAMETERS)
    code, unknown = free.codes[g], False
    for n in range(free.first[g + 1] - free.first[g]):
        for angle in range(angles_of(free, g, n)):
            if angle == ANGLES:
                for k in range(ANGLES):
                    unknown = unknown or codes[s, free.codes[g] + k] == NO_CONTACT
            if angle >= ANGLES and unknown:
                codes[s, code] = UNKNOWN
            else:
                turned_parameters(free.u[free.start[g] + n], angle, u)
                pose_of(free.form[g], u, problem.goals.R[s, g], problem.goals.p[s, g], R, p)
                codes[s, code] = gripper_contact_at(problem, work, s, R, p)
            code += 1


def blocked_grippers(problem: Problem) -> BoolArray:
    """Return whether the gripper is in contact at every pose of a goal, shape (states, goals)."""
    found, free = gripper_contacts(problem) != NO_CONTACT, problem.goals.freedom
    if free.first.size:
        found = np.logical_and.reduceat(found, free.codes[: len(free.form)], axis=1)
        _look_further(problem, new_workspace(problem), found)
    if not problem.goals.first_pose.size:
        return found
    return np.logical_and.reduceat(found, problem.goals.first_pose[:-1], axis=1)


@jit
def _look_further(owned_problem: Problem, owned_work: Workspace, blocked: BoolArray) -> None:
    """Keep what is blocked at all samples only where it is at all further poses too, in place."""
    problem, work = unowned(owned_problem), unowned(owned_work)
    free, R, p, u = problem.goals.freedom, np.empty((3, 3)), np.empty(3), np.empty(PARAMETERS)
    for s in range(blocked.shape[0]):
        for g in range(blocked.shape[1]):
            start, form = free.start[g], free.form[g]
            samples = free.first[g + 1] - free.first[g]
            for child in range(free.child_first[start], free.child_first[start + samples]):
                for angle in range(angles_of(free, g, -1)):
                    if not blocked[s, g]:
                        break
                    turned_parameters(free.u[start + free.children[child]], angle, u)
                    pose_of(form, u, problem.goals.R[s, g], problem.goals.p[s, g], R, p)
                    blocked[s, g] = gripper_contact_at(problem, work, s, R, p) != NO_CONTACT


def score(problem: Problem, rows: Rows, grippers: IntArray | None = None) -> Scores:
    """Return the scores of configurations at all goals.

    Args:
        problem: The scene and its goals.
        rows: The configurations.
        grippers: From `gripper_contacts`; None to find them here.
    """
    if grippers is None:
        grippers = gripper_contacts(problem)
    scores = new_scores(rows.number, problem.goals.number)
    # Allocated here to outlive the call: the compiled code takes unowned views of these arrays.
    work, solver, free = new_workspace(problem), new_solver(problem), freedom_if_any(problem)
    _score_rows(problem, free, work, solver, grippers, rows, scores)
    return scores


@jit
def _score_rows(
    owned_problem: Problem,
    free: FreeGoals | None,
    owned_work: Workspace,
    owned_solver: Solver,
    grippers: IntArray,
    owned_rows: Rows,
    owned_scores: Scores,
) -> None:
    problem, scores = unowned(owned_problem), unowned(owned_scores)
    work, solver, rows = unowned(owned_work), unowned(owned_solver), unowned(owned_rows)
    rounded, is_placed = np.empty(7), np.zeros(1, np.bool_)
    base_code = NO_CONTACT
    goals = len(problem.goals.first_pose) - 1
    are_poses = goals < 0
    if are_poses:
        goals = problem.goals.p.shape[1]
    for row in range(len(rows.state)):
        state, torso = rows.state[row], rows.torso[row]
        if row == 0 or not shares_base(rows, row, row - 1):
            place_base(problem, work, rows, row)
            base_code = base_contact(problem, work, BASE_FIXED, BASE_FIXED)
        code = base_code
        if code == NO_CONTACT:
            code = upper_contact(problem, work, torso)
        if code != NO_CONTACT:
            scores.reason[row] = BODY_BLOCKED
            scores.contact[row] = code
            continue
        # The reported contact must not depend on the configurations scored before.
        work.last[0] = -1
        is_placed[0] = False
        for g in range(goals):
            first = g if are_poses else problem.goals.first_pose[g]
            last = g + 1 if are_poses else problem.goals.first_pose[g + 1]
            farthest = -1
            for pose in range(first, last):
                reason, code = _score_at_pose(
                    problem, free, work, solver, grippers, state, torso, pose, is_placed
                )
                came = NEARNESS[reason]
                if came > farthest:
                    scores.reason[row, g], scores.contact[row, g] = reason, code
                if reason == REACHED:
                    better = came > farthest
                    write_winner(problem, solver.best, rounded, scores, row, g, better)
                    if problem.measure.of == ANY:
                        break
                farthest = max(farthest, came)


@inner
def _score_at_pose(
    problem: Problem,
    free: FreeGoals | None,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    state: int,
    torso: int,
    pose: int,
    is_placed: BoolArray,
) -> tuple[int, int]:
    """Score a pose of a goal, with what is free about it.

    Args:
        problem: The scene.
        free: From `freedom_if_any`.
        work: Workspace with the base in place.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.
        grippers: From `gripper_contacts`.
        state: The environment state.
        torso: The torso level.
        pose: The pose.
        is_placed: Whether the environment is placed in the arm base A, shape (1,); updated.

    Returns:
        Reason and contact code.
    """
    if free is not None:
        if not is_placed[0]:
            environment_in_arm_base(problem, work, torso)
            is_placed[0] = True
        return score_free(problem, work, solver, grippers, state, torso, pose)
    code = grippers[state, pose]
    if code != NO_CONTACT:
        return GRIPPER_BLOCKED_BY_ENVIRONMENT, code
    goal_in_arm_base(problem, work, state, torso, pose)
    reason = out_of_reach(problem, work, solver)
    if reason == TOO_FAR:
        return reason, NO_CONTACT
    body_A = problem.body.shapes_A[torso]
    code = gripper_body_contact(problem, work, body_A)
    if code != NO_CONTACT:
        return GRIPPER_BLOCKED_BY_ROBOT, code
    if reason != REACHED:
        return reason, NO_CONTACT
    if not is_placed[0]:
        environment_in_arm_base(problem, work, torso)
        is_placed[0] = True
    return score_pair(problem, work, body_A, solver)


@inner
def write_winner(
    problem: Problem,
    best: FloatArray,
    rounded: FloatArray,
    scores: Scores,
    row: int,
    g: int,
    better: bool,
) -> None:
    """Store the joint angles of a solution, rounded to float32, and the measure at these.

    Args:
        problem: The scene.
        best: Joint angles of the solution [rad], shape (7,).
        rounded: Filled, shape (7,).
        scores: Filled.
        row: The configuration.
        g: The goal.
        better: Whether it is stored in any case; else only if the measure is above the stored one.
    """
    rounded_inward(best, problem.arm.lower, problem.arm.upper, rounded)
    measure = measure_at(problem, rounded)
    if better or measure > scores.dexterity[row, g]:
        for i in range(7):
            scores.joints[row, g, i] = rounded[i]
        scores.dexterity[row, g] = measure

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
from tcs.kernel.dexterity.measures import measure_at, rounded_inward
from tcs.kernel.freedom.forms import FEWEST_JOINTS, pose_of
from tcs.kernel.freedom.goals import FreeGoals
from tcs.kernel.freedom.search import score_free
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.scores import (
    BODY_BLOCKED,
    GRIPPER_BLOCKED_BY_ENVIRONMENT,
    GRIPPER_BLOCKED_BY_ROBOT,
    REACHED,
    TOO_FAR,
    Scores,
)
from tcs.kernel.solvers import Solver, new_solver, out_of_reach, score_pair
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace, new_workspace


def gripper_contacts(problem: Problem) -> IntArray:
    """Return the contact codes of the gripper with the environment, shape (states, goals).

    With the tool at a goal they are independent of the base pose. If goals are free, there is one
    code for each of their samples, in the order of `Problem.freedom`: shape (states, samples). Of
    poses that the arm turns, they are NO_CONTACT: the gripper is checked when the arm is solved.
    """
    states, first = len(problem.goal_p), problem.freedom.first
    poses = int(first[-1]) if first.size else problem.goal_p.shape[1]
    if problem.joints == FEWEST_JOINTS:
        return np.full((states, poses), NO_CONTACT, np.int64)
    codes = np.empty((states, poses), np.int64)
    _gripper_contacts(problem, freedom_if_any(problem), new_workspace(problem), codes)
    return codes


def freedom_if_any(problem: Problem) -> FreeGoals | None:
    """Return the freedom of the goals; None leaves what is for it out of the compiled code."""
    return problem.freedom if problem.freedom.first.size else None


@jit
def _gripper_contacts(
    owned_problem: Problem, free: FreeGoals | None, owned_work: Workspace, codes: IntArray
) -> None:
    problem, work = unowned(owned_problem), unowned(owned_work)
    for s in range(codes.shape[0]):
        for g in range(problem.goal_p.shape[1]):
            if free is None:
                codes[s, g] = gripper_environment_contact(problem, work, s, g)
            else:
                _sampled_contacts(problem, free, work, s, g, codes)


@inner
def _sampled_contacts(
    problem: Problem, free: FreeGoals, work: Workspace, s: int, g: int, codes: IntArray
) -> None:
    """Fill the contact codes of the gripper at the samples of a goal."""
    R, p = np.empty((3, 3)), np.empty(3)
    for n in range(free.first[g + 1] - free.first[g]):
        u = free.u[free.start[g] + n]
        pose_of(free.form[g], u, problem.goal_R[s, g], problem.goal_p[s, g], R, p)
        codes[s, free.first[g] + n] = gripper_contact_at(problem, work, s, R, p)


def blocked_grippers(problem: Problem) -> BoolArray:
    """Return whether the gripper is in contact at every pose of a goal, shape (states, goals)."""
    blocked, first = gripper_contacts(problem) != NO_CONTACT, problem.freedom.first
    if not first.size:
        return blocked
    found = np.logical_and.reduceat(blocked, first[:-1], axis=1)
    _look_further(problem, new_workspace(problem), found)
    return found


@jit
def _look_further(owned_problem: Problem, owned_work: Workspace, blocked: BoolArray) -> None:
    """Keep what is blocked at all samples only where it is at all further poses too, in place."""
    problem, work = unowned(owned_problem), unowned(owned_work)
    free, R, p = problem.freedom, np.empty((3, 3)), np.empty(3)
    for s in range(blocked.shape[0]):
        for g in range(blocked.shape[1]):
            start, form = free.start[g], free.form[g]
            samples = free.first[g + 1] - free.first[g]
            for child in range(free.child_first[start], free.child_first[start + samples]):
                if not blocked[s, g]:
                    break
                u = free.u[start + free.children[child]]
                pose_of(form, u, problem.goal_R[s, g], problem.goal_p[s, g], R, p)
                blocked[s, g] = gripper_contact_at(problem, work, s, R, p) != NO_CONTACT


def score_rows(problem: Problem, grippers: IntArray, rows: Rows, scores: Scores) -> None:
    """Score configurations.

    Args:
        problem: The scene and its goals.
        grippers: From `gripper_contacts`.
        rows: The configurations.
        scores: Filled; every array has a row for each of `rows`. `dexterity` and `joints` are
            written only where a goal is reached, `reason` and `contact` everywhere.
    """
    # Allocated here to outlive the call: the compiled code takes unowned views of these arrays.
    work, solver, free = new_workspace(problem), new_solver(problem), freedom_if_any(problem)
    _score_rows(problem, free, work, solver, grippers, rows, scores)


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
    rounded = np.empty(7)
    base_code = NO_CONTACT
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
        body_A = problem.body_A[torso]
        # The reported contact must not depend on the configurations scored before.
        work.last[0] = -1
        environment_placed = False
        for g in range(problem.goal_p.shape[1]):
            scores.contact[row, g] = NO_CONTACT
            if free is not None:
                if not environment_placed:
                    environment_in_arm_base(problem, work, torso)
                    environment_placed = True
                reason, code = score_free(problem, work, solver, grippers, state, torso, g)
                scores.reason[row, g], scores.contact[row, g] = reason, code
                if reason == REACHED:
                    write_winner(problem, solver.best, rounded, scores, row, g)
                continue
            if grippers[state, g] != NO_CONTACT:
                scores.reason[row, g] = GRIPPER_BLOCKED_BY_ENVIRONMENT
                scores.contact[row, g] = grippers[state, g]
                continue
            goal_in_arm_base(problem, work, state, torso, g)
            reason = out_of_reach(problem, work, solver)
            if reason == TOO_FAR:
                scores.reason[row, g] = reason
                continue
            code = gripper_body_contact(problem, work, body_A)
            if code != NO_CONTACT:
                scores.reason[row, g] = GRIPPER_BLOCKED_BY_ROBOT
                scores.contact[row, g] = code
                continue
            if reason != REACHED:
                scores.reason[row, g] = reason
                continue
            if not environment_placed:
                environment_in_arm_base(problem, work, torso)
                environment_placed = True
            reason, code = score_pair(problem, work, body_A, solver)
            scores.reason[row, g] = reason
            scores.contact[row, g] = code
            if reason == REACHED:
                write_winner(problem, solver.best, rounded, scores, row, g)


@inner
def write_winner(
    problem: Problem, best: FloatArray, rounded: FloatArray, scores: Scores, row: int, g: int
) -> None:
    """Store the joint angles of the best solution, rounded to float32, and the measure at these."""
    rounded_inward(best, problem.arm.lower, problem.arm.upper, rounded)
    for i in range(7):
        scores.joints[row, g, i] = rounded[i]
    scores.dexterity[row, g] = measure_at(problem, rounded)

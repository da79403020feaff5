"""Every initial configuration of a slice of the grid against every goal."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.analytic.arcs import IN_REACH, OUT_OF_REACH, elbow_arcs
from tcs.kernel.analytic.ik import wrist_goal
from tcs.kernel.analytic.pairs import (
    BODY_BLOCKED,
    GRIPPER_BLOCKED_BY_ENVIRONMENT,
    GRIPPER_BLOCKED_BY_ROBOT,
    JOINT_LIMITS,
    REACHED,
    TOO_FAR,
    score_pair,
)
from tcs.kernel.analytic.search import Search, new_search
from tcs.kernel.analytic.solver import is_outside
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import environment_in_arm_base, goal_in_arm_base, place_base
from tcs.kernel.cache import inner, jit
from tcs.kernel.contacts import (
    BASE_FIXED,
    NO_CONTACT,
    TORSO_MOUNTED,
    Workspace,
    base_contact,
    gripper_body_contact,
    gripper_environment_contact,
    new_workspace,
)
from tcs.kernel.measure import measure_at, rounded_inward
from tcs.kernel.problem import Problem
from tcs.kernel.views import unowned


class Scores(NamedTuple):
    """Output of a slice; row 0 is configuration `start` of the slice."""

    reason: NDArray[np.uint8]
    """Shape (n, goals)."""
    contact: NDArray[np.int32]
    """Contact code or NO_CONTACT, shape (n, goals)."""
    dexterity: NDArray[np.float32]
    """The measure, isotropy if no other was asked for; 0 where not reached, shape (n, goals)."""
    joints: NDArray[np.float32]
    """Winning joints [rad], 0 where not reached, shape (n, goals, 7)."""


def gripper_contacts(problem: Problem) -> IntArray:
    """Return the gripper's contact with the environment at every goal, shape (states, goals).

    It does not depend on where the robot stands.
    """
    codes = np.empty(problem.goal_p.shape[:2], np.int64)
    _gripper_contacts(problem, new_workspace(problem), codes)
    return codes


@jit
def _gripper_contacts(owned_problem: Problem, owned_work: Workspace, codes: IntArray) -> None:
    problem, work = unowned(owned_problem), unowned(owned_work)
    for s in range(codes.shape[0]):
        for g in range(codes.shape[1]):
            codes[s, g] = gripper_environment_contact(problem, work, s, g)


def score_slice(
    problem: Problem, grippers: IntArray, start: int, stop: int, scores: Scores
) -> None:
    """Score the configurations start <= h < stop in the flat order of the grid.

    Args:
        problem: The scene, its goals and its grid.
        grippers: From `gripper_contacts`.
        start: First configuration.
        stop: One after the last.
        scores: Filled; every array holds stop - start rows.
    """
    if is_outside(problem.arm):
        # Imported where it is needed: most arms have a closed form.
        from tcs.kernel.numeric.sweep import score_numeric_slice

        score_numeric_slice(problem, grippers, start, stop, scores)
        return
    # Made here, where they outlive the call: the compiled code only borrows them.
    _score_slice(problem, new_workspace(problem), new_search(), grippers, start, stop, scores)


@jit
def _score_slice(
    owned_problem: Problem,
    owned_work: Workspace,
    owned_search: Search,
    grippers: IntArray,
    start: int,
    stop: int,
    owned_scores: Scores,
) -> None:
    problem, scores = unowned(owned_problem), unowned(owned_scores)
    work, search = unowned(owned_work), unowned(owned_search)
    rounded = np.empty(7)
    place, base_code, state = -1, NO_CONTACT, 0
    for h in range(start, stop):
        row, torso = h - start, h % problem.torso_levels
        if h // problem.torso_levels != place:
            place = h // problem.torso_levels
            state = place_base(problem, work, place)
            base_code = base_contact(problem, work, BASE_FIXED, BASE_FIXED)
        code = base_code
        if code == NO_CONTACT:
            code = base_contact(problem, work, torso, TORSO_MOUNTED)
        if code != NO_CONTACT:
            scores.reason[row] = BODY_BLOCKED
            scores.contact[row] = code
            continue
        body_A = problem.body_A[torso]
        # What blocks here must not depend on what was scored before.
        work.last[0] = -1
        environment_placed = False
        for g in range(problem.goal_p.shape[1]):
            scores.contact[row, g] = NO_CONTACT
            if grippers[state, g] != NO_CONTACT:
                scores.reason[row, g] = GRIPPER_BLOCKED_BY_ENVIRONMENT
                scores.contact[row, g] = grippers[state, g]
                continue
            goal_in_arm_base(problem, work, state, torso, g)
            wrist_goal(problem.arm, work.R_AG, work.p_AG, search.goal)
            arcs, reach = elbow_arcs(problem.arm, search.goal, search.arcs)
            if reach != IN_REACH:
                scores.reason[row, g] = TOO_FAR if reach == OUT_OF_REACH else JOINT_LIMITS
                continue
            code = gripper_body_contact(problem, work, body_A)
            if code != NO_CONTACT:
                scores.reason[row, g] = GRIPPER_BLOCKED_BY_ROBOT
                scores.contact[row, g] = code
                continue
            if not environment_placed:
                environment_in_arm_base(problem, work, torso)
                environment_placed = True
            reason, code = score_pair(problem, work, body_A, search, arcs)
            scores.reason[row, g] = reason
            scores.contact[row, g] = code
            if reason == REACHED:
                keep(problem, search.best, rounded, scores, row, g)


@inner
def keep(
    problem: Problem, best: FloatArray, rounded: FloatArray, scores: Scores, row: int, g: int
) -> None:
    """Write the winner. Its measure is that of the rounded joints, as anyone can recompute."""
    rounded_inward(best, problem.arm.lower, problem.arm.upper, rounded)
    for i in range(7):
        scores.joints[row, g, i] = rounded[i]
    scores.dexterity[row, g] = measure_at(problem, rounded)

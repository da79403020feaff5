"""The sweep for arms that no closed form solves: the same checks in the same order."""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.pairs import (
    BODY_BLOCKED,
    GRIPPER_BLOCKED_BY_ENVIRONMENT,
    GRIPPER_BLOCKED_BY_ROBOT,
    REACHED,
    TOO_FAR,
)
from tcs.kernel.arrays import IntArray
from tcs.kernel.base_pose import environment_in_arm_base, goal_in_arm_base, place_base
from tcs.kernel.cache import jit
from tcs.kernel.contacts import (
    BASE_FIXED,
    NO_CONTACT,
    TORSO_MOUNTED,
    Workspace,
    base_contact,
    gripper_body_contact,
    new_workspace,
)
from tcs.kernel.numeric.arm import NumericArm, numeric_arm_of
from tcs.kernel.numeric.pairs import score_numeric_pair
from tcs.kernel.numeric.search import (
    MOST_CANDIDATES,
    MOST_CURVES,
    MOST_POINTS,
    CurveSearch,
    is_within_span,
    new_curve_search,
)
from tcs.kernel.problem import Problem
from tcs.kernel.sweep import Scores, keep
from tcs.kernel.views import unowned


def score_numeric_slice(
    problem: Problem, grippers: IntArray, start: int, stop: int, scores: Scores
) -> None:
    """Score the configurations start <= h < stop, as `sweep.score_slice`."""
    arm = numeric_arm_of(problem)
    # Made here, where they outlive the call: the compiled code only borrows them.
    work, search = (
        new_workspace(problem),
        new_curve_search(MOST_POINTS, MOST_CURVES, MOST_CANDIDATES),
    )
    _score_numeric_slice(problem, arm, work, search, grippers, start, stop, scores)


@jit
def _score_numeric_slice(
    owned_problem: Problem,
    owned_arm: NumericArm,
    owned_work: Workspace,
    owned_search: CurveSearch,
    grippers: IntArray,
    start: int,
    stop: int,
    owned_scores: Scores,
) -> None:
    problem, arm = unowned(owned_problem), unowned(owned_arm)
    work, search, scores = unowned(owned_work), unowned(owned_search), unowned(owned_scores)
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
            if not is_within_span(arm, work.R_AG, work.p_AG):
                scores.reason[row, g] = TOO_FAR
                continue
            code = gripper_body_contact(problem, work, body_A)
            if code != NO_CONTACT:
                scores.reason[row, g] = GRIPPER_BLOCKED_BY_ROBOT
                scores.contact[row, g] = code
                continue
            if not environment_placed:
                environment_in_arm_base(problem, work, torso)
                environment_placed = True
            reason, code = score_numeric_pair(problem, arm, work, body_A, search)
            scores.reason[row, g] = reason
            scores.contact[row, g] = code
            if reason == REACHED:
                keep(problem, search.best, rounded, scores, row, g)

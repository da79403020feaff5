"""Many starts from everywhere: the yardstick for what numeric IK may have missed."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.base_pose import environment_in_arm_base, goal_in_arm_base, place_base
from tcs.kernel.cache import int_constant, jit
from tcs.kernel.contacts import NO_CONTACT, Workspace, gripper_body_contact, new_workspace
from tcs.kernel.measure import measure_at
from tcs.kernel.numeric.arm import NumericArm, joint_ranges, numeric_arm_of, spread
from tcs.kernel.numeric.pairs import NOWHERE, bisect_contacts, choose
from tcs.kernel.numeric.search import CurveSearch, find_candidates, new_curve_search, trace_from
from tcs.kernel.problem import Problem
from tcs.kernel.views import unowned

STARTS = 400
"""Postures spread over the joint limits, each brought to the goal."""
ITERATIONS = int_constant(60)
"""Looks that a start gets: it may be half a turn and a whole arm off."""
STRIDE, SPACING = 0.08, 0.0125
"""As in `numeric_pairs`, but finer [rad]."""
EVERYWHERE = np.inf
"""How far beyond their limits joints are followed [rad]: to the end of every curve."""
POINTS, CURVES, CANDIDATES = 16_384, 256, 65_536


def numeric_dense_scan(
    problem: Problem, configuration: int, goal: int, starts: int, joints: FloatArray
) -> float:
    """Return the best measure of any collision-free solution found, or -1 when there is none.

    Every start that arrives is followed along its whole curve, limits or not. The table that the
    sweep starts from is not used, and nothing is refined. The base is not checked: ask only for
    configurations whose base is free.

    Args:
        problem: The scene, its goals and its grid.
        configuration: Flat index of the initial configuration.
        goal: Index of the goal, one whose gripper is free.
        starts: How many postures to start from.
        joints: Filled with the solution [rad] when there is one, shape (7,).
    """
    arm = numeric_arm_of(problem)
    low, high = joint_ranges(problem.arm.lower, problem.arm.upper)
    postures = low + spread(starts, 7) * (high - low)
    # Made here, where they outlive the call: the compiled code only borrows them.
    work, search = new_workspace(problem), new_curve_search(POINTS, CURVES, CANDIDATES)
    return float(_scan(problem, arm, work, search, configuration, goal, postures, joints))


@jit
def _scan(
    owned_problem: Problem,
    owned_arm: NumericArm,
    owned_work: Workspace,
    owned_search: CurveSearch,
    configuration: int,
    goal: int,
    postures: FloatArray,
    joints: FloatArray,
) -> float:
    problem, arm = unowned(owned_problem), unowned(owned_arm)
    work, search = unowned(owned_work), unowned(owned_search)
    torso = configuration % problem.torso_levels
    state = place_base(problem, work, configuration // problem.torso_levels)
    goal_in_arm_base(problem, work, state, torso, goal)
    body_A = problem.body_A[torso]
    if gripper_body_contact(problem, work, body_A) != NO_CONTACT:
        return -1.0
    environment_in_arm_base(problem, work, torso)
    count = 0
    for n in range(len(postures)):
        search.curves.q_now[:] = postures[n]
        count = trace_from(
            arm,
            work.R_AG,
            work.p_AG,
            search,
            count,
            EVERYWHERE,
            STRIDE,
            ITERATIONS,
            problem.measure.of,
        )
    found = find_candidates(problem, arm, search, count, SPACING)
    if found == 0:
        return -1.0
    at, _ = choose(problem, arm, work, body_A, search, found)
    if at == NOWHERE:
        at = bisect_contacts(problem, arm, work, body_A, search, found)
    if at == NOWHERE:
        return -1.0
    joints[:] = search.curves.q_now
    return measure_at(problem, joints)

"""Newton's method from many starts, to find solutions that the numeric search misses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import environment_in_arm_base, goal_in_arm_base, place_base
from tcs.kernel.cache import int_constant, jit
from tcs.kernel.contacts import NO_CONTACT, gripper_body_contact
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.low_discrepancy import spread
from tcs.kernel.numeric.arm import NumericArm, joint_ranges, numeric_arm_of
from tcs.kernel.numeric.score_curves import NOWHERE, bisect_contacts, choose
from tcs.kernel.numeric.search import CurveSearch, find_candidates, new_curve_search, trace_from
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace, new_workspace

STARTS = 400
"""Number of starts."""
ITERATIONS = int_constant(60)
"""Greatest number of Newton iterations from a start, which may be 180 degrees and an arm's length
away from the goal."""
STRIDE, SPACING = 0.08, 0.0125
"""As in `tcs.kernel.numeric.search`, but finer [rad, norm of the joints]."""
EVERYWHERE = np.inf
"""How far beyond its limits a joint is followed [rad]: to the end of every curve."""
POINTS, CURVES, CANDIDATES = 16_384, 256, 65_536
"""Capacities of the scratch arrays."""


def numeric_dense_scans(
    problem: Problem, rows: Rows, pairs: IntArray, starts: int, joints: FloatArray
) -> NDArray[np.float64]:
    """Return the dexterity of a collision-free solution for each pair, -1 where none is found.

    Starts are spread over the joint limits; the table of the sweep is not used. Each curve that a
    start converges to is traced once, also beyond the joint limits, until the scratch memory is
    full. The result is the collision-free candidate with the highest interpolated measure, not
    refined; or, if all candidates are in contact, any collision-free position between two of them.
    Contacts of base and gripper with the environment are not checked.

    Args:
        problem: The scene and its goals.
        rows: Initial configurations.
        pairs: Rows whose base is free of contact, and goals at which the gripper is free of contact
            with the environment, shape (n, 2).
        starts: Number of postures to start from.
        joints: Filled with the joint angles of each solution [rad], shape (n, 7).
    """
    arm = numeric_arm_of(problem)
    low, high = joint_ranges(problem.arm.lower, problem.arm.upper)
    postures = low + spread(starts, 7) * (high - low)
    # Allocated here to outlive the call: the compiled code takes unowned views of these arrays.
    work, search = new_workspace(problem), new_curve_search(POINTS, CURVES, CANDIDATES)
    return np.array(
        [
            _scan(problem, arm, work, search, rows, n, g, postures, q)
            for (n, g), q in zip(pairs, joints, strict=True)
        ]
    )


@jit
def _scan(
    owned_problem: Problem,
    owned_arm: NumericArm,
    owned_work: Workspace,
    owned_search: CurveSearch,
    owned_rows: Rows,
    row: int,
    goal: int,
    postures: FloatArray,
    joints: FloatArray,
) -> float:
    problem, arm = unowned(owned_problem), unowned(owned_arm)
    work, search, rows = unowned(owned_work), unowned(owned_search), unowned(owned_rows)
    state, torso = rows.state[row], rows.torso[row]
    place_base(problem, work, rows, row)
    goal_in_arm_base(problem, work, state, torso, goal)
    body_A = problem.body.shapes_A[torso]
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

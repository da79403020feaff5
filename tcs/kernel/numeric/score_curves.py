"""Score of one initial configuration at one goal, for an arm without a closed form.

A position on the curves is the index of a point plus a fraction of the stride to the next point.
"""

from __future__ import annotations

from tcs.kernel.analytic.scratch import best_of
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.contacts import NO_CONTACT, arm_contact, at_goal, pair_touches
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.kinematics import copy_joints, link_poses
from tcs.kernel.numeric.arm import NumericArm
from tcs.kernel.numeric.curves import correct, point_between, slack_of
from tcs.kernel.numeric.newton import converge
from tcs.kernel.numeric.search import (
    LAST_FRACTION,
    SPACING,
    CurveSearch,
    NumericSolver,
    find_candidates,
    find_curves,
    is_within_span,
    turn_into_limits,
)
from tcs.kernel.problem import Problem
from tcs.kernel.scores import ARM_BLOCKED, JOINT_LIMITS, REACHED, TOO_FAR
from tcs.kernel.workspace import Workspace

EXACT = 1e-9
"""Error of a solution [rad and m], far below the 1e-7 that forward kinematics must confirm."""
FIRST_TRIES = 6
"""Number of candidates checked in the order of their measure before all are checked in sequence."""
REFINEMENTS, REFINE_SAMPLES = 3, 8
"""As in `tcs.kernel.analytic.score_pair`."""
BISECTIONS = 8
"""Bisections of the interval between two contacts, down to SPACING / 256."""
APPROXIMATE, SOLVED = int_constant(0), int_constant(1)
"""Joint angles interpolated by the cubic; joint angles of a solution."""
PATIENCE = int_constant(60)
"""Greatest number of Newton iterations from a candidate where none is a solution after CORRECTIONS.
At the edge of the workspace J is all but singular along a whole curve, which is then traced to 0.1
rad only, and Newton's method converges slowly; 10 to 50 are typical."""
NO_SOLUTION = -2
"""Value in place of a contact: there is no solution within the limits."""
NOWHERE, TRIED = -1.0, -1.0
"""Position and measure that stand for none."""
NEIGHBOURS = 0.75
"""Greatest distance of neighbouring candidates, in strides. A stride has at least two parts, so a
greater distance means that the curve leaves the limits in between."""


@inner
def solve_at(arm: NumericArm, work: Workspace, search: CurveSearch, at: float) -> bool:
    """Fill `q_now` with the solution at a position on the curves.

    Returns:
        Whether Newton's method has converged, to joint angles within the limits.
    """
    curves = search.curves
    point_between(curves, int(at), at - int(at), curves.q_now)
    arrived = correct(arm, work.R_AG, work.p_AG, curves, EXACT)
    return arrived and slack_of(arm, curves.q_now) >= 0.0


@inner
def contact_at(
    problem: Problem, arm: NumericArm, work: Workspace, body_A: FloatArray, search: CurveSearch,
    at: float, first: int, last: int, least: float,
) -> int:  # fmt: skip
    """Return the contact at a position on the curves, NO_CONTACT or NO_SOLUTION.

    Args:
        problem: The scene.
        arm: Constants of the arm.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A.
        search: `q_now` is filled with the joint angles checked last [rad].
        at: The position.
        first: First check, APPROXIMATE (joints of the cubic, with an error of 1e-5 rad) or SOLVED
            (joints of a solution). If the joints of the cubic touch something, no solution is
            computed.
        last: Last check.
        least: A solution whose measure is not above this counts as none; negative for no bound.
    """
    q, contact = search.curves.q_now, NO_CONTACT
    for newton in range(first, last + 1):
        if newton == SOLVED:
            if not solve_at(arm, work, search, at):
                return NO_SOLUTION
            turn_into_limits(problem, q)
            if least >= 0.0 and measure_at(problem, q) <= least:
                return NO_SOLUTION
        else:
            point_between(search.curves, int(at), at - int(at), q)
        contact = arm_contact(problem, work, body_A, q)
        if contact != NO_CONTACT:
            return contact
    if last == SOLVED and not at_goal(problem, work):
        return NO_SOLUTION
    return contact


@inner
def choose(
    problem: Problem,
    arm: NumericArm,
    work: Workspace,
    body_A: FloatArray,
    search: CurveSearch,
    found: int,
) -> tuple[float, int]:
    """Return the best collision-free candidate; fills `q_now` with its joint angles.

    FIRST_TRIES candidates of the highest measure are checked first. If none is free, all candidates
    are checked in the order of their positions, as neighbours mostly touch the same pair, and those
    whose interpolated joints are free are checked in descending order of measure.

    Returns:
        Position of the candidate or NOWHERE; contact of the candidate with the highest measure, or
        NO_SOLUTION if no candidate is a solution within the limits.
    """
    first_contact, walked, tries = NO_SOLUTION, False, 0
    while True:
        if tries == FIRST_TRIES and not walked:
            walked = True
            for n in range(found):
                work.last[0] = NO_CONTACT if n == 0 else work.last[0]
                contact = contact_at(
                    problem, arm, work, body_A, search, search.at[n], APPROXIMATE, APPROXIMATE, -1.0
                )
                search.pair[n] = work.last
                if contact == NO_CONTACT:
                    search.pair[n, 0] = -1
                else:
                    search.measure[n] = TRIED
        tries += 1
        top = best_of(search.measure, found)
        if search.measure[top] == TRIED:
            if walked:
                break
            continue
        at = search.at[top]
        contact = contact_at(problem, arm, work, body_A, search, at, APPROXIMATE, SOLVED, -1.0)
        if contact == NO_CONTACT:
            return at, contact
        if first_contact == NO_SOLUTION:
            first_contact = contact
        search.measure[top] = TRIED
    return NOWHERE, first_contact


@inner
def choose_far(
    problem: Problem,
    arm: NumericArm,
    work: Workspace,
    body_A: FloatArray,
    search: CurveSearch,
    found: int,
) -> int:
    """Fill `best` with the best collision-free solution that lies far from its candidate.

    For goals of which no candidate is a solution: here many Newton iterations start from each.

    Returns:
        NO_CONTACT if there is a collision-free solution, else the contact of the first solution, or
        NO_SOLUTION if there is none within the limits.
    """
    q, first_contact, value = search.curves.q_now, NO_SOLUTION, -1.0
    for n in range(found):
        at = search.at[n]
        point_between(search.curves, int(at), at - int(at), q)
        newton = search.curves.newton
        arrived = converge(arm, work.R_AG, work.p_AG, q, newton, PATIENCE, EXACT)
        if not arrived or slack_of(arm, q) < 0.0:
            continue
        turn_into_limits(problem, q)
        contact = arm_contact(problem, work, body_A, q)
        if contact != NO_CONTACT:
            first_contact = contact if first_contact == NO_SOLUTION else first_contact
        elif at_goal(problem, work) and measure_at(problem, q) > value:
            value = measure_at(problem, q)
            copy_joints(q, search.best)
    return NO_CONTACT if value >= 0.0 else first_contact


@inner
def bisect_contacts(
    problem: Problem,
    arm: NumericArm,
    work: Workspace,
    body_A: FloatArray,
    search: CurveSearch,
    found: int,
) -> float:
    """Search for a collision-free position between candidates that are all in contact.

    As in `analytic.score_pair.bisect_contacts`, where the pair in contact changes from one
    candidate to the next, bisection searches between the two positions.

    Returns:
        The position or NOWHERE.
    """
    for n in range(1, found):
        partner, i, j = search.pair[n - 1, 0], search.pair[n - 1, 1], search.pair[n - 1, 2]
        other, k, m = search.pair[n, 0], search.pair[n, 1], search.pair[n, 2]
        low, high = search.at[n - 1], search.at[n]
        changed = other != partner or k != i or m != j
        if not changed or partner < 0 or other < 0 or high - low > NEIGHBOURS:
            continue
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            point = int(middle)
            q = search.curves.q_now
            point_between(search.curves, point, middle - point, q)
            link_poses(problem.chain.R, problem.chain.p, q, work.link_R, work.link_p)
            if pair_touches(problem, work, body_A, q, partner, i, j):
                low = middle
            elif pair_touches(problem, work, body_A, q, other, k, m):
                high = middle
            else:
                contact = contact_at(
                    problem, arm, work, body_A, search, middle, SOLVED, SOLVED, -1.0
                )
                if contact == NO_CONTACT:
                    return middle
                break
    return NOWHERE


@inner
def refine(
    problem: Problem, arm: NumericArm, work: Workspace, body_A: FloatArray, search: CurveSearch,
    count: int, centre: float, spacing: float,
) -> None:  # fmt: skip
    """Improve a collision-free solution by sampling the curve near it; fills `search.best`.

    The solution is in `q_now`. Each round spreads positions over one spacing to either side of the
    best one, and reduces the spacing.
    """
    curves = search.curves
    copy_joints(curves.q_now, search.best)
    value = measure_at(problem, search.best)
    point = int(centre)
    low, high = 0.0, 0.0
    for k in range(count):
        if curves.first[k] <= point < curves.first[k + 1]:
            low, high = float(curves.first[k]), curves.first[k + 1] - 2.0 + LAST_FRACTION
    step = min(spacing / max(curves.length[point], spacing), 0.5)
    for _ in range(REFINEMENTS):
        fine = 2.0 * step / (REFINE_SAMPLES - 1)
        start, best_at = centre - step, centre
        for sample in range(REFINE_SAMPLES):
            at = min(max(start + sample * fine, low), high)
            contact = contact_at(problem, arm, work, body_A, search, at, SOLVED, SOLVED, value)
            if contact == NO_CONTACT:
                value, best_at = measure_at(problem, curves.q_now), at
                copy_joints(curves.q_now, search.best)
        centre, step = best_at, fine


@inner
def out_of_reach(problem: Problem, work: Workspace, solver: NumericSolver) -> int:
    """Return TOO_FAR if the reach bounds of the arm rule the goal out, else REACHED.

    Args:
        problem: The scene.
        work: Workspace with the goal in A.
        solver: The arm's solver.
    """
    return REACHED if is_within_span(solver.arm, work.R_AG, work.p_AG) else TOO_FAR


@inner
def score_pair(
    problem: Problem, work: Workspace, body_A: FloatArray, solver: NumericSolver
) -> tuple[int, int]:
    """Score one goal within reach, base and gripper being free of contact.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        solver: `best` is filled with the joint angles [rad] of the solution if the goal is reached.

    Returns:
        Reason and contact code.
    """
    arm, search = solver.arm, solver.search
    count = find_curves(arm, work.R_AG, work.p_AG, search, problem.measure.of)
    if count == 0:
        return JOINT_LIMITS, NO_CONTACT
    found = find_candidates(problem, arm, search, count, SPACING)
    if found == 0:
        return JOINT_LIMITS, NO_CONTACT
    at, contact = choose(problem, arm, work, body_A, search, found)
    if at == NOWHERE and contact == NO_SOLUTION:
        contact = choose_far(problem, arm, work, body_A, search, found)
        if contact == NO_SOLUTION:
            return JOINT_LIMITS, NO_CONTACT
        return (REACHED if contact == NO_CONTACT else ARM_BLOCKED), contact
    if at == NOWHERE:
        at = bisect_contacts(problem, arm, work, body_A, search, found)
    if at == NOWHERE:
        return ARM_BLOCKED, contact
    refine(problem, arm, work, body_A, search, count, at, SPACING)
    return REACHED, NO_CONTACT

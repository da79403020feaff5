"""Score of one initial configuration at one goal, for an arm with a closed form.

The score is the best collision-free solution, or the reason why there is none.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.arcs import IN_REACH, OUT_OF_REACH, elbow_arcs
from tcs.kernel.analytic.ik import sample_joints, wrist_goal
from tcs.kernel.analytic.samples import solve_samples
from tcs.kernel.analytic.search import (
    MAX_CANDIDATES,
    Search,
    best_of,
    fill_samples,
    find_candidates,
    sort_candidates,
)
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.contacts import (
    NO_CONTACT,
    Workspace,
    arm_contact,
    at_goal,
    pair_touches,
)
from tcs.kernel.dexterity import ISOTROPY, UNLIMITED
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.kinematics import link_poses
from tcs.kernel.problem import Problem
from tcs.kernel.scores import ARM_BLOCKED, JOINT_LIMITS, REACHED, TOO_FAR

ONE_SAMPLE, NOTHING = int_constant(1), int_constant(-1)

REFINEMENTS = 3
"""Number of refinement rounds; each multiplies the spacing by 2 / (REFINE_SAMPLES - 1)."""
REFINE_SAMPLES = int_constant(8)
BISECTIONS = 8
"""Bisections of the interval between two contacts: down to FINE_STEP / 256, below the spacing of
the dense scan."""
BISECTION_PARTS = 16.0
"""The refinement of an angle found by bisection starts with the distance between the two contacts
divided by this as its spacing."""
END_HALVINGS = 12
"""Bisections towards the end of a feasible interval: down to FINE_STEP / 7 / 4096, 4e-7 rad."""
SAME_STRETCH = 1.01
"""Candidates closer than this many sample spacings have no infeasible sample between them; the
excess over 1 allows for rounding."""


@inner
def samples_hold_measure(problem: Problem) -> bool:
    """Return whether isotropy, which `solve_samples` computes, is the measure to maximise."""
    return problem.measure.of == ISOTROPY and problem.measure.penalty == UNLIMITED


@inner
def measure_of(problem: Problem, search: Search, b: int, angle: float) -> float:
    """Return the measure to maximise at an angle [rad] of the free joint on branch b; fills `q`."""
    sample_joints(problem.arm, search.goal, problem.arm.branches[b], angle, search.q)
    return measure_at(problem, search.q)


@inner
def best_free(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search, found: int
) -> tuple[int, int]:
    """Return the best collision-free candidate, and the contact of the best candidate.

    Candidates are checked in descending order of their measure.

    Returns:
        Index of the best collision-free candidate or -1; contact code of the candidate with the
        highest measure, or NO_CONTACT if it touches nothing.
    """
    first_contact = NO_CONTACT
    top = best_of(search.found_measure, found)
    for rank in range(found):
        if rank == 1:
            for n in range(found):
                search.key[n] = -search.found_measure[n]
            sort_candidates(search, found)
        if rank:
            top = search.order[rank]
        branch = problem.arm.branches[search.found_branch[top]]
        sample_joints(problem.arm, search.goal, branch, search.found_angle[top], search.q)
        contact = arm_contact(problem, work, body_A, search.q)
        if contact == NO_CONTACT and at_goal(problem, work):
            return top, first_contact
        if rank == 0:
            first_contact = contact
    return -1, first_contact


@inner
def bisect_contacts(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search, found: int
) -> int:
    """Search for a collision-free angle when every candidate is in contact.

    A collision-free interval narrower than the spacing lies between the end of one contact and the
    start of another, or between the end of a contact and a joint limit. So the ends of the feasible
    intervals are added to the candidates, all candidates are checked in the order of their angles,
    and where the pair in contact changes, bisection searches between the two angles.

    Returns:
        Index of the candidate that now holds a collision-free angle, or -1.
    """
    arm = problem.arm
    found = _add_ends(problem, search, found)
    _by_angle(search, found)
    order = search.order
    work.last[0] = -1
    partner, i, j = NOTHING, NOTHING, NOTHING
    for rank in range(found):
        n = order[rank]
        b = search.found_branch[n]
        sample_joints(arm, search.goal, arm.branches[b], search.found_angle[n], search.q)
        contact = arm_contact(problem, work, body_A, search.q)
        if contact == NO_CONTACT and at_goal(problem, work):
            return n
        changed = work.last[0] != partner or work.last[1] != i or work.last[2] != j
        if rank and changed and _are_neighbours(search, order[rank - 1], n):
            first = search.found_angle[order[rank - 1]]
            width = search.found_angle[n] - first
            angle = _between(problem, work, body_A, search, b, first, width, partner, i, j)
            if np.isfinite(angle):
                search.found_angle[n] = angle
                search.found_measure[n] = _measure_if_feasible(problem, search, b, angle)
                search.found_step[n] = width / BISECTION_PARTS
                return n
        partner, i, j = work.last[0], work.last[1], work.last[2]
    return -1


@inner
def _by_angle(search: Search, found: int) -> None:
    """Sort the candidates by branch, then by angle."""
    for n in range(found):
        # The offset exceeds any angle of the free joint [rad].
        search.key[n] = search.found_angle[n] + 1e4 * search.found_branch[n]
    sort_candidates(search, found)


@inner
def _are_neighbours(search: Search, m: int, n: int) -> bool:
    """Return whether no infeasible sample lies between two consecutive candidates."""
    width = search.found_angle[n] - search.found_angle[m]
    spacing = max(search.found_step[m], search.found_step[n])
    return search.found_branch[m] == search.found_branch[n] and width < SAME_STRETCH * spacing


@inner
def _add_ends(problem: Problem, search: Search, found: int) -> int:
    """Append the outermost feasible angle at each end of the feasible intervals.

    Returns:
        Updated number of candidates.
    """
    _by_angle(search, found)
    order, before = search.order, found
    for rank in range(before):
        n = order[rank]
        for side in (-1, 1):
            if 0 <= rank + side < before:
                m = order[rank + side]
                left, right = (m, n) if side < 0 else (n, m)
                if _are_neighbours(search, left, right):
                    continue
            found = _add_end(problem, search, n, side, found)
    return found


@inner
def _add_end(problem: Problem, search: Search, n: int, side: int, found: int) -> int:
    """Append the end of a feasible interval, on the given side of its outermost candidate n.

    Args:
        problem: The scene.
        search: The candidates.
        n: Index of the candidate.
        side: -1 towards smaller angles, 1 towards greater ones.
        found: Number of candidates.

    Returns:
        Updated number of candidates.
    """
    b, angle = search.found_branch[n], search.found_angle[n]
    inside, outside, value = 0.0, search.found_step[n], -1.0
    for _ in range(END_HALVINGS):
        middle = 0.5 * (inside + outside)
        measure = _measure_if_feasible(problem, search, b, angle + side * middle)
        if measure >= 0.0:
            inside, value = middle, measure
        else:
            outside = middle
    if inside == 0.0 or found == MAX_CANDIDATES:
        return found
    search.found_branch[found], search.found_angle[found] = b, angle + side * inside
    search.found_step[found], search.found_measure[found] = inside, value
    return found + 1


@inner
def _between(
    problem: Problem,
    work: Workspace,
    body_A: FloatArray,
    search: Search,
    b: int,
    first: float,
    width: float,
    partner: int,
    i: int,
    j: int,
) -> float:
    """Return a collision-free angle in [first, first + width] [rad], or nan if none is found.

    At `first` the pair (partner, i, j) is in contact, at the other end the pair in `work.last`.
    """
    arm = problem.arm
    other, k, m = work.last[0], work.last[1], work.last[2]
    answer = np.nan
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        angle = first + middle * width
        sample_joints(arm, search.goal, arm.branches[b], angle, search.q)
        link_poses(problem.chain_R, problem.chain_p, search.q, work.link_R, work.link_p)
        if pair_touches(problem, work, body_A, partner, i, j):
            low = middle
        elif pair_touches(problem, work, body_A, other, k, m):
            high = middle
        else:
            if _measure_if_feasible(problem, search, b, angle) >= 0.0 and (
                arm_contact(problem, work, body_A, search.q) == NO_CONTACT
                and at_goal(problem, work)
            ):
                answer = angle
            break
    work.last[0], work.last[1], work.last[2] = other, k, m
    return answer


@inner
def _measure_if_feasible(problem: Problem, search: Search, b: int, angle: float) -> float:
    """Return the measure at an angle [rad] on branch b, or -1 where the angle is infeasible."""
    arm = problem.arm
    search.cosine[0], search.sine[0] = np.cos(angle), np.sin(angle)
    solve_samples(
        arm, search.goal, arm.branches[b], search.cosine, search.sine, ONE_SAMPLE,
        search.slack, search.measure,
    )  # fmt: skip
    if search.slack[0] < 0.0:
        return -1.0
    return (
        search.measure[0]
        if samples_hold_measure(problem)
        else measure_of(problem, search, b, angle)
    )


@inner
def refine(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search, winner: int
) -> None:
    """Improve a collision-free candidate by sampling angles near it; fills `search.best`.

    Each round spreads samples over one spacing to either side, moves to the best sample that is
    feasible and collision-free, and reduces the spacing.
    """
    arm = problem.arm
    branch = arm.branches[search.found_branch[winner]]
    centre, step = search.found_angle[winner], search.found_step[winner]
    value = search.found_measure[winner]
    sample_joints(arm, search.goal, branch, centre, search.best)
    for _ in range(REFINEMENTS):
        fine = fill_samples(search, centre - step, centre + step, REFINE_SAMPLES)
        solve_samples(
            arm, search.goal, branch, search.cosine, search.sine, REFINE_SAMPLES,
            search.slack, search.measure,
        )  # fmt: skip
        for i in range(REFINE_SAMPLES):
            if search.slack[i] < 0.0:
                search.measure[i] = -1.0
            elif not samples_hold_measure(problem):
                b, angle = search.found_branch[winner], search.angle[i]
                search.measure[i] = measure_of(problem, search, b, angle)
        for _ in range(REFINE_SAMPLES):
            i = best_of(search.measure, REFINE_SAMPLES)
            if search.measure[i] <= value:
                break
            sample_joints(arm, search.goal, branch, search.angle[i], search.q)
            contact = arm_contact(problem, work, body_A, search.q)
            if contact == NO_CONTACT and at_goal(problem, work):
                centre, value = search.angle[i], search.measure[i]
                for k in range(7):
                    search.best[k] = search.q[k]
                break
            search.measure[i] = -1.0
        step = fine


@inner
def out_of_reach(problem: Problem, work: Workspace, search: Search) -> int:
    """Return TOO_FAR or JOINT_LIMITS if no angle of the free joint reaches the goal, else REACHED.

    Args:
        problem: The scene.
        work: Workspace with the goal in A.
        search: `goal`, `arcs` and `arc_count` are filled.
    """
    wrist_goal(problem.arm, work.R_AG, work.p_AG, search.goal)
    search.arc_count[0], reach = elbow_arcs(problem.arm, search.goal, search.arcs)
    if reach == IN_REACH:
        return REACHED
    return TOO_FAR if reach == OUT_OF_REACH else JOINT_LIMITS


@inner
def score_pair(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search
) -> tuple[int, int]:
    """Score one goal within reach, base and gripper being free of contact.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        search: As filled by `out_of_reach`; `best` is filled with the joint angles [rad] of the
            solution if the goal is reached.

    Returns:
        Reason and contact code.
    """
    found = find_candidates(problem.arm, search, search.arc_count[0])
    if found == 0:
        return JOINT_LIMITS, NO_CONTACT
    if not samples_hold_measure(problem):
        for n in range(found):
            b, angle = search.found_branch[n], search.found_angle[n]
            search.found_measure[n] = measure_of(problem, search, b, angle)
    winner, contact = best_free(problem, work, body_A, search, found)
    if winner < 0:
        winner = bisect_contacts(problem, work, body_A, search, found)
    if winner < 0:
        return ARM_BLOCKED, contact
    refine(problem, work, body_A, search, winner)
    return REACHED, NO_CONTACT

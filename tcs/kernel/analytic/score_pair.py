"""Score of one initial configuration at one goal, for an arm with a closed form.

The score is the best collision-free solution, or the reason why there is none.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.arcs import IN_REACH, OUT_OF_REACH, elbow_arcs
from tcs.kernel.analytic.clearance import free_between
from tcs.kernel.analytic.ik import sample_joints, wrist_goal
from tcs.kernel.analytic.intervals import divide_intervals
from tcs.kernel.analytic.scratch import (
    NO_PAIR,
    Search,
    add_candidate,
    best_of,
    fill_samples,
    measure_feasible,
    solve,
    sort_candidates,
)
from tcs.kernel.analytic.search import find_candidates, find_coarse, record_all
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.contacts import NO_CONTACT, arm_contact, at_goal
from tcs.kernel.dexterity import ANY, ISOTROPY, UNLIMITED
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.problem import Problem
from tcs.kernel.scores import ARM_BLOCKED, JOINT_LIMITS, REACHED, TOO_FAR
from tcs.kernel.workspace import Workspace

NONE, NOTHING = int_constant(0), int_constant(-1)

REFINEMENTS, MORE_REFINEMENTS = int_constant(3), int_constant(8)
"""Number of refinement rounds; each multiplies the spacing by 2 / (REFINE_SAMPLES - 1). Between two
contacts the best solution lies next to one of them, and where joints move fast they move far from
one sample to the next: both take more."""
REFINE_SAMPLES = int_constant(8)
QUICK_TRIES = int_constant(16)
"""Most candidates of a pose that a quick look checks for contacts, evenly among all."""
WORTH = 1.00001
"""By what factor a solution found later must be better to replace one: isotropy counts to the sixth
power here, and rounding joints to float32 costs up to 1e-7."""
NEARBY = 0.25
"""Range of the free joint about a known solution in which one for a pose next to it is tried, to
either side [rad]."""


@inner
def samples_hold_measure(problem: Problem) -> bool:
    """Return whether isotropy, which `solve_samples` computes, is the measure to maximise.

    If any solution will do, isotropy puts the samples in order.
    """
    of = problem.measure.of
    return (of == ISOTROPY or of == ANY) and problem.measure.penalty == UNLIMITED


@inner
def measure_of(problem: Problem, search: Search, b: int, angle: float) -> float:
    """Return the measure to maximise at an angle [rad] of the free joint on branch b; fills `q`."""
    sample_joints(problem.arm, search.goal, problem.arm.branches[b], angle, search.q)
    return measure_at(problem, search.q)


@inner
def best_free(
    problem: Problem,
    work: Workspace,
    body_A: FloatArray,
    search: Search,
    start: int,
    found: int,
    least: float,
) -> tuple[int, int]:
    """Return the best collision-free candidate, and the contact of the best candidate.

    Candidates are tried in descending order of their measure. Those tried in vain keep their joints
    and the pair in contact.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        search: Its candidates are set.
        start: First candidate to try.
        found: One after the last.
        least: Measure that the candidate has to exceed.

    Returns:
        Index of the best collision-free candidate or -1; contact code of the candidate with the
        highest measure, or NO_CONTACT if it touches nothing.
    """
    candidates = search.candidates
    first_contact = NO_CONTACT
    top = start + best_of(candidates.measure[start:found], found - start)
    for rank in range(found - start):
        if rank == 1:
            for n in range(found):
                candidates.key[n] = -candidates.measure[n] if n >= start else np.inf
            sort_candidates(search, found)
        if rank:
            top = candidates.order[rank]
        if candidates.measure[top] <= least:
            break
        branch = problem.arm.branches[candidates.branch[top]]
        sample_joints(problem.arm, search.goal, branch, candidates.angle[top], search.q)
        contact = arm_contact(problem, work, body_A, search.q)
        if contact == NO_CONTACT and at_goal(problem, work):
            return top, first_contact
        for k in range(7):
            candidates.q[top, k] = search.q[k]
        for k in range(3):
            candidates.pair[top, k] = work.last[k] if contact != NO_CONTACT else NO_PAIR
        if rank == 0:
            first_contact = contact
    return -1, first_contact


@inner
def refine(
    problem: Problem,
    work: Workspace,
    body_A: FloatArray,
    search: Search,
    winner: int,
    rounds: int,
    least: float,
) -> float:
    """Climb from a collision-free candidate to the best angle nearby.

    Each round spreads samples over one spacing to either side, moves to the best sample that is
    feasible and collision-free, and reduces the spacing.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        search: `best` gets filled if the measure there exceeds `least`.
        winner: The candidate.
        rounds: Number of rounds.
        least: Measure to exceed.

    Returns:
        The measure at `best`, or `least`.
    """
    candidates, samples = search.candidates, search.samples
    arm = problem.arm
    b = candidates.branch[winner]
    centre, step = candidates.angle[winner], candidates.step[winner]
    value = candidates.measure[winner]
    sample_joints(arm, search.goal, arm.branches[b], centre, search.trial)
    for _ in range(rounds):
        fine = fill_samples(search, centre - step, centre + step, REFINE_SAMPLES)
        solve(arm, search, b, REFINE_SAMPLES)
        measure_feasible(arm, search, REFINE_SAMPLES)
        for i in range(REFINE_SAMPLES):
            if samples.slack[i] < 0.0:
                samples.measure[i] = -1.0
            elif not samples_hold_measure(problem):
                samples.measure[i] = measure_of(problem, search, b, samples.angle[i])
        for _ in range(REFINE_SAMPLES):
            i = best_of(samples.measure, REFINE_SAMPLES)
            if samples.measure[i] <= value:
                break
            sample_joints(arm, search.goal, arm.branches[b], samples.angle[i], search.q)
            contact = arm_contact(problem, work, body_A, search.q)
            if contact == NO_CONTACT and at_goal(problem, work):
                centre, value = samples.angle[i], samples.measure[i]
                for k in range(7):
                    search.trial[k] = search.q[k]
                break
            samples.measure[i] = -1.0
        step = fine
    if value <= least:
        return least
    for k in range(7):
        search.best[k] = search.trial[k]
    return value


@inner
def out_of_reach(problem: Problem, work: Workspace, search: Search) -> int:
    """Return TOO_FAR or JOINT_LIMITS if no angle of the free joint reaches the goal, else REACHED.

    Args:
        problem: The scene.
        work: Workspace with the goal in A.
        search: `goal` and the arcs of `feasible` are filled.
    """
    wrist_goal(problem.arm, work.R_AG, work.p_AG, search.goal)
    search.feasible.arc_count[0], reach = elbow_arcs(problem.arm, search.goal, search.feasible.arcs)
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
    found = find_candidates(problem.arm, search, search.feasible.arc_count[0])
    _measure_candidates(problem, search, NONE, found)
    winner, contact, value = NOTHING, NO_CONTACT, -1.0
    if found:
        winner, contact = best_free(problem, work, body_A, search, NONE, found, -1.0)
    if winner >= 0 and problem.measure.of == ANY:
        for k in range(7):
            search.best[k] = search.q[k]
        return REACHED, NO_CONTACT
    if winner >= 0:
        value = refine(problem, work, body_A, search, winner, REFINEMENTS, -1.0)
    exceeded = -1.0
    if winner >= 0:
        exceeded = value ** (1.0 / 6.0) if samples_hold_measure(problem) else 0.0
    elif found:
        record_all(problem.arm, search, search.feasible.arc_count[0])
    total = divide_intervals(problem.arm, search, found, exceeded)
    if total > found:
        _measure_candidates(problem, search, found, total)
        better, first = best_free(
            problem, work, body_A, search, found, total, value * WORTH if winner >= 0 else -1.0
        )
        if found == 0:
            contact = first
        if better >= 0:
            least = value * WORTH if winner >= 0 else -1.0
            refine(problem, work, body_A, search, better, MORE_REFINEMENTS, least)
            return REACHED, NO_CONTACT
    if winner >= 0:
        return REACHED, NO_CONTACT
    if total == 0:
        return JOINT_LIMITS, NO_CONTACT
    last = free_between(problem, work, body_A, search, total)
    first = search.candidates.free_from[0]
    if first == last:
        return ARM_BLOCKED, contact
    _measure_candidates(problem, search, first, last)
    for n in range(first, last):
        value = refine(problem, work, body_A, search, n, MORE_REFINEMENTS, value)
    return REACHED, NO_CONTACT


@inner
def quick_look(
    problem: Problem, work: Workspace, body_A: FloatArray, least: float, search: Search
) -> tuple[int, int]:
    """Return REACHED if a sample of the free joint serves a goal, else a likely reason.

    What lies between the samples is left out: `score_pair` finds more, at several times the cost.
    With a bound, the best sample is refined; without one, `score_pair` goes on from any.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        least: Measure that the sample has to exceed; negative for any.
        search: As filled by `out_of_reach`; `best` is filled with the joint angles [rad] of the
            solution if there is one.

    Returns:
        Reason and contact code.
    """
    if least >= 0.0:
        found = find_candidates(problem.arm, search, search.feasible.arc_count[0])
        if not found:
            return JOINT_LIMITS, NO_CONTACT
        return _best_above(problem, work, body_A, search, found, least)
    found = find_coarse(problem.arm, search, search.feasible.arc_count[0])
    if not found:
        return JOINT_LIMITS, NO_CONTACT
    contact = NO_CONTACT
    for n in range(0, found, 1 + found // QUICK_TRIES):
        branch = problem.arm.branches[search.candidates.branch[n]]
        sample_joints(problem.arm, search.goal, branch, search.candidates.angle[n], search.q)
        code = arm_contact(problem, work, body_A, search.q)
        if code == NO_CONTACT and at_goal(problem, work):
            return score_pair(problem, work, body_A, search)
        if n == 0:
            contact = code
    return ARM_BLOCKED, contact


@inner
def look_near(
    problem: Problem, work: Workspace, body_A: FloatArray, least: float, search: Search
) -> tuple[int, int]:
    """Score a goal next to one whose solution is known, by the angles near that of its free joint.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        least: Measure that the solution has to exceed.
        search: As filled by `out_of_reach`; `best` holds the known solution, and is filled with the
            joint angles [rad] of the new one if there is one.

    Returns:
        Reason and contact code.
    """
    arm, found = problem.arm, NONE
    middle = search.best[arm.free]
    low, high = max(middle - NEARBY, arm.lower[arm.free]), min(middle + NEARBY, arm.upper[arm.free])
    for b in range(len(arm.branches)):
        step = fill_samples(search, low, high, REFINE_SAMPLES)
        solve(arm, search, b, REFINE_SAMPLES)
        measure_feasible(arm, search, REFINE_SAMPLES)
        for i in range(REFINE_SAMPLES):
            if search.samples.slack[i] >= 0.0:
                found = add_candidate(search, b, i, step, found)
    if not found:
        return JOINT_LIMITS, NO_CONTACT
    return _best_above(problem, work, body_A, search, found, least)


@inner
def _best_above(
    problem: Problem,
    work: Workspace,
    body_A: FloatArray,
    search: Search,
    found: int,
    least: float,
) -> tuple[int, int]:
    """Refine the best collision-free candidate above a measure; return reason and contact code."""
    _measure_candidates(problem, search, NONE, found)
    bound = least**6 if samples_hold_measure(problem) else least
    winner, contact = best_free(problem, work, body_A, search, NONE, found, bound)
    if winner < 0:
        return ARM_BLOCKED, contact
    refine(problem, work, body_A, search, winner, REFINEMENTS, -1.0)
    return REACHED, NO_CONTACT


@inner
def _measure_candidates(problem: Problem, search: Search, start: int, found: int) -> None:
    """Give candidates the measure that counts, if it is not the isotropy that samples hold."""
    candidates = search.candidates
    if samples_hold_measure(problem):
        return
    for n in range(start, found):
        b, angle = candidates.branch[n], candidates.angle[n]
        candidates.measure[n] = measure_of(problem, search, b, angle)

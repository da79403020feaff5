"""One initial configuration against one goal: is it reached, how well, and if not, why not?"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arcs import MAX_ARCS, windows_of
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import jit
from tcs.kernel.contacts import (
    NO_CONTACT,
    Workspace,
    arm_contact,
    at_goal,
    pair_touches,
    place_links,
)
from tcs.kernel.lanes import lane_joints, solve_lanes
from tcs.kernel.problem import Problem
from tcs.kernel.solver import ArmSolver

REACHED, TOO_FAR, JOINT_LIMITS, BODY_BLOCKED, GRIPPER_BLOCKED, ARM_BLOCKED = 0, 1, 2, 3, 4, 5
"""Reasons, the numbers of `tcs.tables.Reason`."""

FIRST_LANES = 48
"""Lanes over all arcs together in the first look: enough to find the feasible windows."""
FINE_STEP = 0.0125
"""Spacing [rad] of the second look inside the windows. Chosen by measurement: recall against a
dense scan of 11,520 samples (benchmarks/)."""
LEAST_LANES = 8
"""Lanes that even the smallest window or arc gets: one vector of the processor."""
FINEST_LANES = 8
"""Lanes at each end of a feasible stretch, and about the peak of a window that shows none."""
MAX_LANES = 512
MAX_WINDOWS = 32
MAX_CANDIDATES = 4096
REFINEMENTS = 3
"""Rounds in which the neighbourhood of the best solution is divided by REFINE_LANES / 2."""
REFINE_LANES = 8
SQUEEZES = 8
"""Halvings of the room between two contacts: down to FINE_STEP / 256, below the dense scan's."""
SQUEEZE_PARTS = 16.0
"""How finely the neighbourhood of an angle found by halving is refined."""


class Search(NamedTuple):
    """Scratch of the search over the free joint, reused from pair to pair."""

    goal: FloatArray
    arcs: FloatArray
    windows: FloatArray
    ends: FloatArray
    """Outer and inner side of the ends of feasible stretches [rad], shape (MAX_WINDOWS, 2)."""
    angle: FloatArray
    cosine: FloatArray
    sine: FloatArray
    slack: FloatArray
    measure: FloatArray
    found_angle: FloatArray
    """Free joint of each candidate [rad], shape (MAX_CANDIDATES,)."""
    found_step: FloatArray
    """Spacing [rad] of the lanes it was found with."""
    found_measure: FloatArray
    """Its isotropy to the sixth power; -1 once it was found to collide."""
    found_branch: IntArray
    """Row of its branch in `arm.branches`."""
    q: FloatArray
    """Joint angles in hand, shape (7,)."""
    best: FloatArray
    """Joint angles of the best solution so far, shape (7,)."""


@jit
def new_search() -> Search:
    """Return scratch memory for one worker."""
    return Search(
        np.empty((4, 3)),
        np.empty((MAX_ARCS, 2)),
        np.empty((MAX_WINDOWS, 2)),
        np.empty((MAX_WINDOWS, 2)),
        np.empty(MAX_LANES),
        np.empty(MAX_LANES),
        np.empty(MAX_LANES),
        np.empty(MAX_LANES),
        np.empty(MAX_LANES),
        np.empty(MAX_CANDIDATES),
        np.empty(MAX_CANDIDATES),
        np.empty(MAX_CANDIDATES),
        np.empty(MAX_CANDIDATES, np.int64),
        np.empty(7),
        np.empty(7),
    )


@jit
def fill_lanes(search: Search, first: float, last: float, count: int) -> float:
    """Spread `count` >= 2 lanes evenly from first to last, ends included; return their spacing.

    Cosines and sines follow by turning the first ones on: 512 turns lose about 1e-13, and the
    joint angles of a solution are computed anew from its angle.
    """
    step = (last - first) / (count - 1)
    c, s = np.cos(first), np.sin(first)
    dc, ds = np.cos(step), np.sin(step)
    for i in range(count):
        search.angle[i] = first + i * step
        search.cosine[i], search.sine[i] = c, s
        c, s = c * dc - s * ds, s * dc + c * ds
    return step


@jit
def _best_of(measure: FloatArray, count: int) -> int:
    """Return the index of the greatest value, the first one of equals."""
    best = 0
    for i in range(1, count):
        if measure[i] > measure[best]:
            best = i
    return best


@jit
def find_candidates(arm: ArmSolver, search: Search, arcs: int) -> int:
    """Collect angles of the free joint, on every branch, at which all joints keep their limits.

    Args:
        arm: The arm.
        search: Its `goal` and `arcs` are set; its candidates get filled.
        arcs: How many arcs there are.

    Returns:
        How many candidates were found.
    """
    length = 0.0
    for k in range(arcs):
        length += search.arcs[k, 1] - search.arcs[k, 0]
    found = 0
    for k in range(arcs):
        first, last = search.arcs[k, 0], search.arcs[k, 1]
        share = FIRST_LANES * (last - first) / length if length > 0.0 else 0.0
        count = max(LEAST_LANES, int(share))
        for b in range(len(arm.branches)):
            step = fill_lanes(search, first, last, count)
            solve_lanes(
                arm, search.goal, arm.branches[b], search.cosine, search.sine, count,
                search.slack, search.measure,
            )  # fmt: skip
            windows = windows_of(search.slack, count, step, search.windows, 0)
            for w in range(windows):
                start = first + search.windows[w, 0] * step
                stop = first + search.windows[w, 1] * step
                found = _look_closer(arm, search, b, start, stop, found)
    return found


@jit
def _look_closer(
    arm: ArmSolver, search: Search, b: int, first: float, last: float, found: int
) -> int:
    """Append the feasible angles of one window on branch b; return how many there are now."""
    count = min(max(LEAST_LANES, int((last - first) / FINE_STEP) + 1), MAX_LANES)
    step = fill_lanes(search, first, last, count)
    solve_lanes(
        arm, search.goal, arm.branches[b], search.cosine, search.sine, count,
        search.slack, search.measure,
    )  # fmt: skip
    before = search.slack[0] >= 0.0
    ends = 0
    for i in range(count):
        inside = search.slack[i] >= 0.0
        if inside:
            found = _add(search, b, i, step, found)
        if inside != before and ends < MAX_WINDOWS:
            # The outer and the inner side of an end of a feasible stretch.
            search.ends[ends, 0] = search.angle[i - 1] if inside else search.angle[i]
            search.ends[ends, 1] = search.angle[i] if inside else search.angle[i - 1]
            ends += 1
        before = inside
    if ends == 0 and not before:
        # Nothing yet: the window may be narrower than these lanes, about the highest of them.
        peak = _best_of(search.slack, count)
        middle = search.angle[peak]
        return _look_between(arm, search, b, middle - step, middle + step, found)
    for e in range(ends):
        found = _look_between(arm, search, b, search.ends[e, 0], search.ends[e, 1], found)
    return found


@jit
def _look_between(
    arm: ArmSolver, search: Search, b: int, outer: float, inner: float, found: int
) -> int:
    """Append feasible angles between two neighbouring lanes, themselves left out.

    Close to a joint limit, where a feasible stretch ends, the best measure often is.
    """
    step = fill_lanes(search, outer, inner, FINEST_LANES)
    solve_lanes(
        arm, search.goal, arm.branches[b], search.cosine, search.sine, FINEST_LANES - 1,
        search.slack, search.measure,
    )  # fmt: skip
    for i in range(1, FINEST_LANES - 1):
        if search.slack[i] >= 0.0:
            found = _add(search, b, i, abs(step), found)
    return found


@jit
def _add(search: Search, b: int, i: int, step: float, found: int) -> int:
    """Append lane i as a candidate on branch b; return how many there are now."""
    if found == MAX_CANDIDATES:
        return found
    search.found_angle[found] = search.angle[i]
    search.found_step[found] = step
    search.found_measure[found] = search.measure[i]
    search.found_branch[found] = b
    return found + 1


@jit
def best_free(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search, found: int
) -> tuple[int, int]:
    """Return the best collision-free candidate, and the contact of the best one of all.

    Candidates are tried in descending order of their measure. Those tried in vain are marked.

    Returns:
        Index of the candidate or -1; contact code of the very best candidate or NO_CONTACT.
    """
    first_contact = NO_CONTACT
    top = _best_of(search.found_measure, found)
    order = np.empty(0, np.int64)
    for rank in range(found):
        if rank == 1:
            order = np.argsort(-search.found_measure[:found], kind="mergesort")
        if rank:
            top = order[rank]
        branch = problem.arm.branches[search.found_branch[top]]
        lane_joints(problem.arm, search.goal, branch, search.found_angle[top], search.q)
        contact = arm_contact(problem, work, body_A, search.q)
        if contact == NO_CONTACT and at_goal(problem, work):
            return top, first_contact
        if rank == 0:
            first_contact = contact
    return -1, first_contact


@jit
def squeeze(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search, found: int
) -> int:
    """Look for a free angle between neighbouring candidates that all touch something.

    A free stretch narrower than the spacing lies where one contact has ended and another not
    begun. So the candidates are walked in order; where the pair in contact changes, halving finds
    whether there is room between the two.

    Returns:
        Index of the candidate that now holds a free angle, or -1.
    """
    arm = problem.arm
    work.last[0] = -1
    partner, i, j = -1, -1, -1
    for n in range(found):
        b = search.found_branch[n]
        lane_joints(arm, search.goal, arm.branches[b], search.found_angle[n], search.q)
        arm_contact(problem, work, body_A, search.q)
        changed = work.last[0] != partner or work.last[1] != i or work.last[2] != j
        if n and changed and b == search.found_branch[n - 1]:
            width = search.found_angle[n] - search.found_angle[n - 1]
            if abs(width) < 1.5 * search.found_step[n]:
                first = search.found_angle[n - 1]
                angle = _between(problem, work, body_A, search, b, first, width, partner, i, j)
                if np.isfinite(angle):
                    search.found_angle[n] = angle
                    search.found_measure[n] = search.measure[0]
                    search.found_step[n] = abs(width) / SQUEEZE_PARTS
                    return n
        partner, i, j = work.last[0], work.last[1], work.last[2]
    return -1


@jit
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
    """Return a free angle in first .. first + width, or nan.

    At `first` the pair (partner, i, j) touches, at the other end the pair in `work.last`.
    """
    arm = problem.arm
    other, k, m = work.last[0], work.last[1], work.last[2]
    answer = np.nan
    low, high = 0.0, 1.0
    for _ in range(SQUEEZES):
        middle = 0.5 * (low + high)
        angle = first + middle * width
        lane_joints(arm, search.goal, arm.branches[b], angle, search.q)
        place_links(arm.R, arm.p, search.q, work.link_R, work.link_p)
        if pair_touches(problem, work, body_A, partner, i, j):
            low = middle
        elif pair_touches(problem, work, body_A, other, k, m):
            high = middle
        else:
            if _is_feasible(arm, search, b, angle) and (
                arm_contact(problem, work, body_A, search.q) == NO_CONTACT
                and at_goal(problem, work)
            ):
                answer = angle
            break
    work.last[0], work.last[1], work.last[2] = other, k, m
    return answer


@jit
def _is_feasible(arm: ArmSolver, search: Search, b: int, angle: float) -> bool:
    """Return whether branch b exists at this angle and keeps all limits; fills measure[0]."""
    search.cosine[0], search.sine[0] = np.cos(angle), np.sin(angle)
    solve_lanes(
        arm, search.goal, arm.branches[b], search.cosine, search.sine, 1,
        search.slack, search.measure,
    )  # fmt: skip
    return search.slack[0] >= 0.0


@jit
def refine(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search, winner: int
) -> None:
    """Climb from a collision-free candidate to the best angle nearby; fills `search.best`.

    Each round spreads lanes over one spacing to either side, takes the best one that is feasible
    and free, and narrows the spacing.
    """
    arm = problem.arm
    branch = arm.branches[search.found_branch[winner]]
    centre, step = search.found_angle[winner], search.found_step[winner]
    value = search.found_measure[winner]
    lane_joints(arm, search.goal, branch, centre, search.best)
    for _ in range(REFINEMENTS):
        fine = fill_lanes(search, centre - step, centre + step, REFINE_LANES)
        solve_lanes(
            arm, search.goal, branch, search.cosine, search.sine, REFINE_LANES,
            search.slack, search.measure,
        )  # fmt: skip
        for i in range(REFINE_LANES):
            if search.slack[i] < 0.0:
                search.measure[i] = -1.0
        for _ in range(REFINE_LANES):
            i = _best_of(search.measure, REFINE_LANES)
            if search.measure[i] <= value:
                break
            lane_joints(arm, search.goal, branch, search.angle[i], search.q)
            contact = arm_contact(problem, work, body_A, search.q)
            if contact == NO_CONTACT and at_goal(problem, work):
                centre, value = search.angle[i], search.measure[i]
                search.best[:] = search.q
                break
            search.measure[i] = -1.0
        step = fine


@jit
def score_pair(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search, arcs: int
) -> tuple[int, int]:
    """Score one goal within reach; base and gripper are free already.

    Args:
        problem: The scene.
        work: Room, base and gripper are placed.
        body_A: The robot's other shapes in A at the torso level in hand.
        search: `goal` and `arcs` are set; `best` gets filled with joint angles [rad] when reached.
        arcs: How many arcs there are.

    Returns:
        Reason and contact code.
    """
    found = find_candidates(problem.arm, search, arcs)
    if found == 0:
        return JOINT_LIMITS, NO_CONTACT
    winner, contact = best_free(problem, work, body_A, search, found)
    if winner < 0:
        winner = squeeze(problem, work, body_A, search, found)
    if winner < 0:
        return ARM_BLOCKED, contact
    refine(problem, work, body_A, search, winner)
    return REACHED, NO_CONTACT

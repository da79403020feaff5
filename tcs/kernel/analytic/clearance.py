"""Free angles between samples of the free joint that all touch something.

A pair of shapes that overlaps deeper than it moves until the next sample overlaps all the way: that
rules most intervals out. The others are halved until they are ruled out, a free angle is found, or
nothing moves enough to matter.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.ik import sample_joints
from tcs.kernel.analytic.scratch import (
    MAX_STACK,
    NO_PAIR,
    UNCHECKED_PAIR,
    Search,
    add_candidate,
    measure_feasible,
    solve,
    sort_candidates,
)
from tcs.kernel.arrays import BOX, CAPSULE, FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.collide import CENTRE, ROTATION, SIZE, TYPE, closer, move
from tcs.kernel.contacts import ARM, ENVIRONMENT, NO_CONTACT, arm_contact, at_goal
from tcs.kernel.distances import may_come_apart
from tcs.kernel.kinematics import copy_joints, link_poses
from tcs.kernel.problem import Problem
from tcs.kernel.workspace import Workspace

PATH = 1.25
"""Longest way of a shape from the nearer end of an interval, over half the distance of the ends: an
arc of 150 degrees has 1.25."""
LEAST_MOTION = 1e-4
"""Motion of the shapes in contact [m] below which an interval is not divided further."""
MAX_HALVINGS = 4096
"""Most intervals divided for one goal."""
END_HALVINGS = 12
"""Bisections towards the end of a feasible interval: down to FINE_STEP / 7 / 4096, 4e-7 rad."""
SAME_STRETCH = 1.01
"""Candidates closer than this many sample spacings have no infeasible sample between them; the
excess over 1 allows for rounding."""
ZERO, ONE, THREE, NOWHERE = int_constant(0), int_constant(1), int_constant(3), int_constant(-1)


@inner
def by_angle(search: Search, found: int) -> None:
    """Sort the candidates by branch, then by angle."""
    candidates = search.candidates
    for n in range(found):
        # The offset exceeds any angle of the free joint [rad].
        candidates.key[n] = candidates.angle[n] + 1e4 * candidates.branch[n]
    sort_candidates(search, found)


@inner
def are_neighbours(search: Search, m: int, n: int) -> bool:
    """Return whether no infeasible sample lies between two consecutive candidates."""
    candidates = search.candidates
    width = candidates.angle[n] - candidates.angle[m]
    spacing = max(candidates.step[m], candidates.step[n])
    return candidates.branch[m] == candidates.branch[n] and width < SAME_STRETCH * spacing


@inner
def add_ends(problem: Problem, search: Search, found: int) -> int:
    """Append the outermost feasible angle at each end of the feasible intervals.

    Returns:
        Updated number of candidates.
    """
    by_angle(search, found)
    order, before = search.candidates.order, found
    for rank in range(before):
        n = order[rank]
        for side in (-1, 1):
            if 0 <= rank + side < before:
                m = order[rank + side]
                left, right = (m, n) if side < 0 else (n, m)
                if are_neighbours(search, left, right):
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
    candidates = search.candidates
    b, angle = candidates.branch[n], candidates.angle[n]
    inside, outside = 0.0, candidates.step[n]
    for _ in range(END_HALVINGS):
        middle = 0.5 * (inside + outside)
        if is_feasible(problem, search, b, angle + side * middle):
            inside = middle
        else:
            outside = middle
    if inside == 0.0:
        return found
    is_feasible(problem, search, b, angle + side * inside)
    measure_feasible(problem.arm, search, ONE)
    return add_candidate(search, b, ZERO, inside, found)


@inner
def is_feasible(problem: Problem, search: Search, b: int, angle: float) -> bool:
    """Return whether all joints keep their limits at an angle on branch b, the first sample."""
    samples = search.samples
    samples.angle[0], samples.cosine[0], samples.sine[0] = angle, np.cos(angle), np.sin(angle)
    solve(problem.arm, search, b, ONE)
    return samples.slack[0] >= 0.0


@inner
def free_between(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search, found: int
) -> int:
    """Append free angles that lie between candidates or at the ends of feasible stretches.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        search: All its candidates touch something; those checked hold joints and pair in contact.
        found: Number of candidates.

    Returns:
        Updated number of candidates; those appended at the end, from `candidates.free_from` on, are
        free.
    """
    candidates, bisection = search.candidates, search.bisection
    found = add_ends(problem, search, found)
    candidates.free_from[0] = found
    by_angle(search, found)
    count, halvings, placed = found, 0, NOWHERE
    for rank in range(count):
        n = candidates.order[rank]
        if candidates.pair[n, 0] == UNCHECKED_PAIR and _is_free_at(
            problem, work, body_A, search, candidates.branch[n], candidates.angle[n]
        ):
            search.samples.angle[0], search.samples.measure[0] = (
                candidates.angle[n],
                candidates.measure[n],
            )
            found = add_candidate(search, candidates.branch[n], ZERO, candidates.step[n], found)
            candidates.pair[n, 0] = NO_PAIR
        elif candidates.pair[n, 0] == UNCHECKED_PAIR:
            _keep(search.q, work.last, candidates.q[n], candidates.pair[n])
        if rank == 0 or not are_neighbours(search, candidates.order[rank - 1], n):
            continue
        m, b = candidates.order[rank - 1], candidates.branch[n]
        ends, end_q, end_pair = bisection.angle, bisection.q, bisection.pair
        ends[0, 0], ends[0, 1] = candidates.angle[m], candidates.angle[n]
        _keep(candidates.q[m], candidates.pair[m], end_q[0, 0], end_pair[0, 0])
        _keep(candidates.q[n], candidates.pair[n], end_q[0, 1], end_pair[0, 1])
        R, p = bisection.R, bisection.p
        # The left end is the right end of the last interval.
        if placed == m:
            _copy_poses(R[0, 1], p[0, 1], R[0, 0], p[0, 0])
        else:
            link_poses(problem.chain.R, problem.chain.p, candidates.q[m], R[0, 0], p[0, 0])
        link_poses(problem.chain.R, problem.chain.p, candidates.q[n], R[0, 1], p[0, 1])
        placed, top = n, 1
        while top and halvings < MAX_HALVINGS:
            top -= 1
            if _stays_in_contact(problem, work, body_A, search, top):
                continue
            halvings += 1
            first, last = ends[top, 0], ends[top, 1]
            middle = 0.5 * (first + last)
            if not first < middle < last or top + 2 > MAX_STACK:
                continue
            _keep_pair(end_pair[top, 0], work.last)
            if _is_free_at(problem, work, body_A, search, b, middle):
                if is_feasible(problem, search, b, middle):
                    measure_feasible(problem.arm, search, ONE)
                    found = add_candidate(search, b, ZERO, 0.5 * (last - first), found)
                    break
                work.last[0] = NO_PAIR
            # The right half goes on top of the left one, which takes the place of the whole.
            ends[top + 1, 0], ends[top + 1, 1] = middle, last
            _keep(search.q, work.last, end_q[top + 1, 0], end_pair[top + 1, 0])
            _keep(end_q[top, 1], end_pair[top, 1], end_q[top + 1, 1], end_pair[top + 1, 1])
            _copy_poses(work.link_R, work.link_p, R[top + 1, 0], p[top + 1, 0])
            _copy_poses(R[top, 1], p[top, 1], R[top + 1, 1], p[top + 1, 1])
            ends[top, 1] = middle
            _keep(search.q, work.last, end_q[top, 1], end_pair[top, 1])
            _copy_poses(work.link_R, work.link_p, R[top, 1], p[top, 1])
            placed = NOWHERE
            top += 2
    return found


@inner
def _keep(q: FloatArray, pair: IntArray, to_q: FloatArray, to_pair: IntArray) -> None:
    """Copy joints and the pair in contact there."""
    copy_joints(q, to_q)
    _keep_pair(pair, to_pair)


@inner
def _keep_pair(pair: IntArray, to_pair: IntArray) -> None:
    """Copy a pair in contact."""
    for k in range(3):
        to_pair[k] = pair[k]


@inner
def _copy_poses(R: FloatArray, p: FloatArray, to_R: FloatArray, to_p: FloatArray) -> None:
    """Copy the poses of the links."""
    for i in range(8):
        for r in range(3):
            to_p[i, r] = p[i, r]
            for c in range(3):
                to_R[i, r, c] = R[i, r, c]


@inner
def _is_free_at(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search, b: int, angle: float
) -> bool:
    """Return whether nothing touches at an angle on branch b; fills `q`, and `work.last` if not."""
    sample_joints(problem.arm, search.goal, problem.arm.branches[b], angle, search.q)
    if arm_contact(problem, work, body_A, search.q) != NO_CONTACT:
        return False
    if at_goal(problem, work):
        return True
    work.last[0] = NO_PAIR
    return False


@inner
def _stays_in_contact(
    problem: Problem, work: Workspace, body_A: FloatArray, search: Search, top: int
) -> bool:
    """Return whether the pairs in contact at the ends of an interval keep in contact between them.

    True also if they move too little for a free angle between the ends to matter.
    """
    bisection = search.bisection
    pair, R, p = bisection.pair[top], bisection.R[top], bisection.p[top]
    if pair[0, 0] == NO_PAIR or pair[1, 0] == NO_PAIR:
        return pair[0, 0] == pair[1, 0]
    motion = other = _motion(problem, search, R, p, pair[0])
    if pair[0, 0] != pair[1, 0] or pair[0, 1] != pair[1, 1] or pair[0, 2] != pair[1, 2]:
        other = _motion(problem, search, R, p, pair[1])
    if max(motion, other) < LEAST_MOTION:
        return True
    return (
        _touches(problem, R[0], p[0], work, body_A, pair[0], motion)
        and _touches(problem, R[1], p[1], work, body_A, pair[1], other)
        and not _table_may_clear(problem, search, top, pair[0])
        and not _table_may_clear(problem, search, top, pair[1])
    )


@inner
def _table_may_clear(problem: Problem, search: Search, top: int, pair: IntArray) -> bool:
    """Return whether a table of distances may clear a pair between the ends of an interval."""
    if pair[0] == ENVIRONMENT:
        return False
    i, j = pair[1], pair[2]
    if pair[0] == ARM:
        other, gap = problem.links.body[j], problem.clearances.arm[i, j]
    else:
        other, gap = problem.body.body[j], problem.clearances.body[i, j]
    distances, ends = problem.distances, search.bisection.q[top]
    n = distances.of_bodies[problem.links.body[i], other]
    return n >= 0 and may_come_apart(distances, n, ends[0], ends[1], PATH, gap)


@inner
def _motion(
    problem: Problem, search: Search, R: FloatArray, p: FloatArray, pair: IntArray
) -> float:
    """Return how far the shapes of a pair move between the link poses R, p at two ends [m]."""
    total = 0.0
    for side in range(1, 3):
        if side == 2 and pair[0] != ARM:
            break
        i = pair[side]
        frame, rows = problem.links.frame[i], search.bisection.moved
        move(R[0, frame], p[0, frame], problem.links.shapes, i, rows, ZERO)
        move(R[1, frame], p[1, frame], problem.links.shapes, i, rows, ONE)
        total += np.sqrt(_square(rows, CENTRE, ONE))
        shape = int(rows[0, TYPE])
        if shape == CAPSULE:
            total += rows[0, SIZE + 1] * np.sqrt(_square(rows, ROTATION + 2, THREE))
        elif shape == BOX:
            for k in range(3):
                total += rows[0, SIZE + k] * np.sqrt(_square(rows, ROTATION + k, THREE))
    return total


@inner
def _square(rows: FloatArray, first: int, stride: int) -> float:
    """Return the squared distance of two vectors in rows 0 and 1."""
    x = rows[1, first] - rows[0, first]
    y = rows[1, first + stride] - rows[0, first + stride]
    z = rows[1, first + 2 * stride] - rows[0, first + 2 * stride]
    return x * x + y * y + z * z


@inner
def _touches(
    problem: Problem,
    link_R: FloatArray,
    link_p: FloatArray,
    work: Workspace,
    body_A: FloatArray,
    pair: IntArray,
    motion: float,
) -> bool:
    """Return whether a pair would be in contact even if its shapes came apart by half a motion."""
    partner, i, j = pair[0], pair[1], pair[2]
    frame = problem.links.frame[i]
    move(link_R[frame], link_p[frame], problem.links.shapes, i, work.arm, i)
    if partner == ENVIRONMENT:
        others, gap = work.environment_A, problem.clearances.environment[i, j]
    elif partner == ARM:
        frame = problem.links.frame[j]
        move(link_R[frame], link_p[frame], problem.links.shapes, j, work.arm, j)
        others, gap = work.arm, problem.clearances.arm[i, j]
    else:
        others, gap = body_A, problem.clearances.body[i, j]
    gap -= 0.5 * PATH * motion
    # Cores of spheres and capsules that overlap tell no depth: only their radii can be used up.
    radii = 0.0
    if work.arm[i, TYPE] != BOX:
        radii += work.arm[i, SIZE]
    if others[j, TYPE] != BOX:
        radii += others[j, SIZE]
    both_boxes = work.arm[i, TYPE] == BOX and others[j, TYPE] == BOX
    return (both_boxes or radii + gap > 0.0) and closer(work.arm, i, others, j, gap)

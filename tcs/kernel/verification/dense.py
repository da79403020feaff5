"""Dense scans of the free joint, to find solutions that the search misses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.analytic.ik import sample_joints, wrist_goal
from tcs.kernel.analytic.pairs import measure_of, samples_hold_measure
from tcs.kernel.analytic.samples import solve_samples
from tcs.kernel.analytic.search import MAX_SAMPLES, Search, fill_samples, new_search
from tcs.kernel.analytic.solver import ArmSolver, is_outside
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import environment_in_arm_base, goal_in_arm_base, place_base
from tcs.kernel.cache import inner, jit
from tcs.kernel.contacts import (
    NO_CONTACT,
    Workspace,
    arm_contact,
    at_goal,
    gripper_body_contact,
    new_workspace,
)
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.problem import Problem
from tcs.kernel.verification.numeric_dense import STARTS, numeric_dense_scans
from tcs.kernel.views import unowned

DENSE_SAMPLES = 11_520
"""Angles of the free joint in a dense scan: one every 1/32 degree of a full turn."""


def dense_scan(
    problem: Problem, configuration: int, goal: int, samples: int, joints: FloatArray
) -> float:
    """Return the dexterity of the best collision-free sample of one pair, -1 if none is free.

    Args:
        problem: The scene, its goals and its grid.
        configuration: As in `dense_scans`.
        goal: As in `dense_scans`.
        samples: As in `dense_scans`.
        joints: Filled with the joint angles of the solution [rad] if there is one, shape (7,).
    """
    pairs, found = np.array([[configuration, goal]]), np.empty((1, 7))
    (value,) = dense_scans(problem, pairs, samples, found)
    if value >= 0.0:
        joints[:] = found[0]
    return float(value)


def dense_scans(
    problem: Problem, pairs: IntArray, samples: int, joints: FloatArray
) -> NDArray[np.float64]:
    """Return the dexterity of the best collision-free sample of each pair, -1 where none is free.

    With a closed form, every sample of the free joint is solved on every branch, and solutions
    within the joint limits are checked for contacts in descending order of their measure; the best
    one is not refined. Without a closed form, `numeric_dense_scans` is used. Contacts of base and
    gripper with the environment are not checked. The GIL is released.

    Args:
        problem: The scene, its goals and its grid.
        pairs: Flat indices of initial configurations whose base is free of contact, and goals at
            which the gripper is free of contact with the environment, shape (n, 2).
        samples: Number of angles, spread evenly over the limits of the free joint; ignored without
            a closed form.
        joints: Filled with the joint angles of each solution [rad], shape (n, 7).
    """
    if is_outside(problem.arm):
        return numeric_dense_scans(problem, pairs, STARTS, joints)
    values = np.empty(len(pairs))
    # Allocated here to outlive the call: the compiled code takes unowned views of these arrays.
    work, search = new_workspace(problem), new_search()
    _dense_scans(problem, work, search, pairs, samples, values, joints)
    return values


@jit
def _dense_scans(
    owned_problem: Problem,
    owned_work: Workspace,
    owned_search: Search,
    pairs: IntArray,
    samples: int,
    values: FloatArray,
    joints: FloatArray,
) -> None:
    problem, work, search = unowned(owned_problem), unowned(owned_work), unowned(owned_search)
    arm = problem.arm
    first, last = arm.lower[arm.free], arm.upper[arm.free]
    if not np.isfinite(first):
        first, last = -np.pi, np.pi
    step = (last - first) / (samples - 1)
    # The samples of all pairs are the same: angle, cosine, sine.
    table = np.empty((3, samples))
    for start in range(0, samples, MAX_SAMPLES):
        count = min(MAX_SAMPLES, samples - start)
        stop = start + max(count, 2) - 1
        fill_samples(search, first + start * step, first + stop * step, stop - start + 1)
        for i in range(count):
            table[0, start + i] = search.angle[i]
            table[1, start + i], table[2, start + i] = search.cosine[i], search.sine[i]
    angles = np.empty(samples * len(arm.branches))
    measures, branches = np.empty(angles.size), np.empty(angles.size, np.int64)
    for n in range(len(pairs)):
        values[n] = _scan(
            problem, work, search, pairs[n, 0], pairs[n, 1], table,
            angles, measures, branches, joints[n],
        )  # fmt: skip


@inner
def _scan(
    problem: Problem,
    work: Workspace,
    search: Search,
    configuration: int,
    goal: int,
    table: FloatArray,
    angles: FloatArray,
    measures: FloatArray,
    branches: IntArray,
    joints: FloatArray,
) -> float:
    """Return the dexterity of the best collision-free sample of a pair, -1 if none is free."""
    arm = problem.arm
    torso = configuration % problem.torso_levels
    state = place_base(problem, work, configuration // problem.torso_levels)
    goal_in_arm_base(problem, work, state, torso, goal)
    wrist_goal(arm, work.R_AG, work.p_AG, search.goal)
    samples, found, environment_placed = table.shape[1], 0, False
    body_A = problem.body_A[torso]
    for start in range(0, samples, MAX_SAMPLES):
        count = min(MAX_SAMPLES, samples - start)
        # Most pairs are out of reach of the elbow at most samples, and no branch is within reach.
        if not _elbow_spans_any(arm, search.goal, table, start, start + count):
            continue
        if not environment_placed:
            if gripper_body_contact(problem, work, body_A) != NO_CONTACT:
                return -1.0
            environment_in_arm_base(problem, work, torso)
            environment_placed = True
        search.angle[:count] = table[0, start : start + count]
        search.cosine[:count] = table[1, start : start + count]
        search.sine[:count] = table[2, start : start + count]
        for b in range(len(arm.branches)):
            solve_samples(
                arm, search.goal, arm.branches[b], search.cosine, search.sine, count,
                search.slack, search.measure,
            )  # fmt: skip
            for i in range(count):
                if search.slack[i] >= 0.0:
                    angles[found], branches[found] = search.angle[i], b
                    measures[found] = search.measure[i]
                    if not samples_hold_measure(problem):
                        measures[found] = measure_of(problem, search, b, search.angle[i])
                    found += 1
    for i in np.argsort(-measures[:found], kind="mergesort"):
        sample_joints(arm, search.goal, arm.branches[branches[i]], angles[i], search.q)
        contact = arm_contact(problem, work, body_A, search.q)
        if contact == NO_CONTACT and at_goal(problem, work):
            joints[:] = search.q
            return measure_at(problem, joints)
    return -1.0


@inner
def _elbow_spans_any(
    arm: ArmSolver, goal: FloatArray, table: FloatArray, start: int, stop: int
) -> bool:
    """Return whether the elbow spans the distance from shoulder to wrist at any sample.

    The formula is that of `solve_samples`, whose slack is negative at every other sample.
    """
    wx, wy, dz = goal[0, 0], goal[0, 1], goal[0, 2] - arm.p[1, 2]
    sx, sy, reach0, reach1 = arm.p[1, 0], arm.p[1, 1], arm.reach[0], arm.reach[1]
    spanned = 0
    for i in range(start, stop):
        c, s = table[1, i], table[2, i]
        dx, dy = c * wx + s * wy - sx, -s * wx + c * wy - sy
        k = (dx * dx + dy * dy + dz * dz - reach0) / reach1
        # Counted, not returned early: so the loop is vectorised.
        spanned += 1.0 - k * k >= 0.0
    return spanned > 0

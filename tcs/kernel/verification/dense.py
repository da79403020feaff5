"""Dense scans of the free joint, to find solutions that the search misses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.analytic.ik import sample_joints, wrist_goal
from tcs.kernel.analytic.samples import AIM, C2, ELBOW_ROUNDING, MAX_SAMPLES, ROW, WRIST
from tcs.kernel.analytic.score_pair import measure_of, samples_hold_measure
from tcs.kernel.analytic.scratch import Search, fill_samples, measure_feasible, new_search, solve
from tcs.kernel.analytic.solver import ArmSolver, is_outside
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import environment_in_arm_base, goal_in_arm_base, place_base
from tcs.kernel.cache import inner, int_constant, jit
from tcs.kernel.contacts import NO_CONTACT, arm_contact, at_goal, gripper_body_contact
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.problem import Problem, chain_of
from tcs.kernel.rows import Rows
from tcs.kernel.verification.newton_solutions import newton_solutions, within
from tcs.kernel.verification.numeric_dense import STARTS, numeric_dense_scans
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace, new_workspace

COARSE = 0.005
"""Motion of any joint between two samples [rad] above which the dense scan adds samples."""
FINEST = 1e-14
"""Spacing of samples [rad] close to the last digit of the free joint."""
MOST_ADDED = 20_000
"""Most intervals that a dense scan divides on one branch."""
THREE = int_constant(3)
DENSE_SAMPLES = 11_520
"""Angles of the free joint in a dense scan: one every 1/32 degree of a full turn."""


def scans_of_poses(
    problem: Problem, rows: Rows, pairs: IntArray, samples: int, joints: FloatArray
) -> NDArray[np.float64]:
    """Return the dexterity of the best free sample of each pair at single poses, -1 where none is.

    With a closed form, every sample of the free joint is solved on every branch, and more are added
    where a joint moves farther than COARSE from one to the next. Solutions within the joint limits
    are checked for contacts in descending order of their measure; the best one is not refined.
    Without a closed form, `numeric_dense_scans` is used; for six joints, `six_joint_scans`.
    Contacts of base and gripper with the environment are not checked. The GIL is released.

    Args:
        problem: The scene and its goals.
        rows: Initial configurations.
        pairs: Rows whose base is free of contact, and goals at which the gripper is free of contact
            with the environment, shape (n, 2).
        samples: Number of angles, spread evenly over the limits of the free joint; ignored without
            a closed form.
        joints: Filled with the joint angles of each solution [rad], shape (n, 7).
    """
    if problem.chain.joints == 6:
        return six_joint_scans(problem, rows, pairs, joints)
    if is_outside(problem.arm):
        return numeric_dense_scans(problem, rows, pairs, STARTS, joints)
    values = np.empty(len(pairs))
    # Allocated here to outlive the call: the compiled code takes unowned views of these arrays.
    work, search = new_workspace(problem), new_search()
    _dense_scans(problem, work, search, rows, pairs, samples, values, joints)
    return values


@jit
def _dense_scans(
    owned_problem: Problem,
    owned_work: Workspace,
    owned_search: Search,
    owned_rows: Rows,
    pairs: IntArray,
    samples: int,
    values: FloatArray,
    joints: FloatArray,
) -> None:
    problem, work, search = unowned(owned_problem), unowned(owned_work), unowned(owned_search)
    rows = unowned(owned_rows)
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
            table[0, start + i] = search.samples.angle[i]
            table[1, start + i], table[2, start + i] = (
                search.samples.cosine[i],
                search.samples.sine[i],
            )
    angles = np.empty((samples + MOST_ADDED) * len(arm.branches))
    measures, branches = np.empty(angles.size), np.empty(angles.size, np.int64)
    for n in range(len(pairs)):
        values[n] = _scan(
            problem, work, search, rows, pairs[n, 0], pairs[n, 1], table,
            angles, measures, branches, joints[n],
        )  # fmt: skip


@inner
def _scan(
    problem: Problem,
    work: Workspace,
    search: Search,
    rows: Rows,
    row: int,
    goal: int,
    table: FloatArray,
    angles: FloatArray,
    measures: FloatArray,
    branches: IntArray,
    joints: FloatArray,
) -> float:
    """Return the dexterity of the best collision-free sample of a pair, -1 if none is free."""
    arm = problem.arm
    state, torso = rows.state[row], rows.torso[row]
    place_base(problem, work, rows, row)
    goal_in_arm_base(problem, work, state, torso, goal)
    wrist_goal(arm, work.R_AG, work.p_AG, search.goal)
    samples, found, environment_placed = table.shape[1], 0, False
    step = table[0, 1] - table[0, 0]
    fast, added = np.empty((MAX_SAMPLES, 2)), np.zeros(len(arm.branches), np.int64)
    body_A = problem.body.shapes_A[torso]
    # Blocks share a sample, so that every two neighbours are compared.
    for start in range(0, samples - 1, MAX_SAMPLES - 1):
        count = min(MAX_SAMPLES, samples - start)
        # Most pairs are out of reach of the elbow at most samples, and no branch is within reach.
        if not _elbow_spans_any(arm, search.goal, table, start, start + count):
            continue
        if not environment_placed:
            if gripper_body_contact(problem, work, body_A) != NO_CONTACT:
                return -1.0
            environment_in_arm_base(problem, work, torso)
            environment_placed = True
        for b in range(len(arm.branches)):
            search.samples.angle[:count] = table[0, start : start + count]
            search.samples.cosine[:count] = table[1, start : start + count]
            search.samples.sine[:count] = table[2, start : start + count]
            solve(arm, search, b, count)
            measure_feasible(arm, search, count)
            pending = 0
            for i in range(count):
                if search.samples.slack[i] >= 0.0 and (i or not start):
                    angles[found], branches[found] = search.samples.angle[i], b
                    measures[found] = search.samples.measure[i]
                    found += 1
                if i + 1 < count and _is_coarse(search, i, step):
                    fast[pending, 0], fast[pending, 1] = (
                        search.samples.angle[i],
                        search.samples.angle[i + 1],
                    )
                    pending += 1
            while pending and added[b] < MOST_ADDED:
                pending -= 1
                added[b] += 1
                low, high = fast[pending, 0], fast[pending, 1]
                half = fill_samples(search, low, high, THREE)
                solve(arm, search, b, THREE)
                measure_feasible(arm, search, THREE)
                if search.samples.slack[1] >= 0.0:
                    angles[found], branches[found] = search.samples.angle[1], b
                    measures[found] = search.samples.measure[1]
                    found += 1
                for i in range(2):
                    if half > FINEST and pending < MAX_SAMPLES and _is_coarse(search, i, half):
                        fast[pending, 0], fast[pending, 1] = (
                            search.samples.angle[i],
                            search.samples.angle[i + 1],
                        )
                        pending += 1
    if not samples_hold_measure(problem):
        for i in range(found):
            measures[i] = measure_of(problem, search, branches[i], angles[i])
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
        spanned += 1.0 - k * k + ELBOW_ROUNDING >= 0.0
    return spanned > 0


@inner
def _is_coarse(search: Search, i: int, step: float) -> bool:
    """Return whether a joint moves farther than COARSE from sample i to the next, and may matter.

    It does not where both samples are too far from feasible for the joints to get there and back.
    """
    samples = search.samples
    rows, motion = samples.rows, 0.0
    for k in range(6):
        c, s = int(C2) + 2 * k * ROW, int(C2) + (2 * k + 1) * ROW
        sine = rows[s + i + 1] * rows[c + i] - rows[c + i + 1] * rows[s + i]
        cosine = rows[c + i + 1] * rows[c + i] + rows[s + i + 1] * rows[s + i]
        motion = max(motion, abs(np.arctan2(sine, cosine)))
    if motion <= COARSE:
        return False
    aim, wrist = int(AIM) + i, int(WRIST) + i
    if rows[aim] > 0.0 and rows[aim + 1] > 0.0:
        reach = np.sqrt(search.goal[0, 0] ** 2 + search.goal[0, 1] ** 2 + search.goal[0, 2] ** 2)
        return rows[aim] + rows[aim + 1] <= 2.0 * reach * (step + motion)
    if rows[wrist] > 0.0 and rows[wrist + 1] > 0.0:
        return rows[wrist] + rows[wrist + 1] <= 4.0 * (step + motion)
    return max(samples.slack[i], samples.slack[i + 1]) > -2.0 * motion


def six_joint_scans(
    problem: Problem, rows: Rows, pairs: IntArray, joints: FloatArray
) -> NDArray[np.float64]:
    """Return the dexterity of the best collision-free solution of each pair, -1 where none is free.

    The solutions are those of `newton_solutions`. Contacts of base and gripper with the environment
    are not checked.

    Args:
        problem: The scene and its goals, with an arm of six joints.
        rows: Initial configurations.
        pairs: Rows whose base is free of contact, and goals at which the gripper is free of contact
            with the environment, shape (n, 2).
        joints: Filled with the joint angles of each solution [rad], shape (n, 7).
    """
    work = new_workspace(problem)
    chain = chain_of(problem)
    values = np.full(len(pairs), -1.0)
    for i, (row, goal) in enumerate(pairs):
        if not _place(problem, work, rows, row, goal):
            continue
        postures = within(chain, newton_solutions(chain, work.R_AG.copy(), work.p_AG.copy()))
        torso = int(rows.torso[row])
        values[i] = _best(problem, work, torso, np.ascontiguousarray(postures), joints[i])
    return values


@jit
def _place(
    owned_problem: Problem, owned_work: Workspace, owned_rows: Rows, row: int, goal: int
) -> bool:
    """Place base, goal and environment; return whether the gripper is free of the body."""
    problem, work, rows = unowned(owned_problem), unowned(owned_work), unowned(owned_rows)
    state, torso = rows.state[row], rows.torso[row]
    place_base(problem, work, rows, row)
    goal_in_arm_base(problem, work, state, torso, goal)
    if gripper_body_contact(problem, work, problem.body.shapes_A[torso]) != NO_CONTACT:
        return False
    environment_in_arm_base(problem, work, torso)
    return True


@jit
def _best(
    owned_problem: Problem,
    owned_work: Workspace,
    torso: int,
    postures: FloatArray,
    joints: FloatArray,
) -> float:
    """Return the greatest dexterity of the collision-free postures, -1 if none is free."""
    problem, work = unowned(owned_problem), unowned(owned_work)
    best = -1.0
    for n in range(len(postures)):
        value = measure_at(problem, postures[n])
        contact = arm_contact(problem, work, problem.body.shapes_A[torso], postures[n])
        if value > best and contact == NO_CONTACT and at_goal(problem, work):
            best = value
            joints[:] = postures[n]
    return best

"""Dense scans of any goals; poses of those with freedom are drawn anew, far more densely."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import goal_in_arm_base, place_base
from tcs.kernel.cache import jit
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.five_joints.turned import turned_chain
from tcs.kernel.freedom.forms import (
    AXIS,
    FEWEST_JOINTS,
    FOLD,
    HALF,
    ROTATES,
    TILT,
)
from tcs.kernel.problem import Problem, chain_of
from tcs.kernel.rows import Rows
from tcs.kernel.scores import REACHED
from tcs.kernel.sweep import gripper_contacts, score
from tcs.kernel.together.arms import keep_free, measures_of, place_gripper_pose
from tcs.kernel.verification.dense import scans_of_poses
from tcs.kernel.verification.newton_solutions import newton_solutions, within
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace, new_workspace

ANGLES = 360
"""Poses of a goal that is free to rotate about an axis: one every degree."""
POSES = 1000
"""Poses of any other freedom."""


def drawn_poses(form: FloatArray, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Return tool poses X_GT within a freedom, the nominal one first.

    They are random, and share nothing with those of the search but the meaning of the freedom. A
    single free angle is divided evenly, from a random angle on.

    Args:
        form: The freedom, in the columns of `tcs.kernel.freedom.forms`.
        seed: Seed of the poses.

    Returns:
        Orientations (n, 3, 3) and positions (n, 3) [m].
    """
    rng = np.random.default_rng(seed)
    axis, half = form[AXIS : AXIS + 3], form[HALF : HALF + 3]
    only_angle = bool(form[ROTATES]) and not form[TILT] and not np.any(half)
    varies = form[TILT] > 0 or bool(np.any(half))
    count = ANGLES if only_angle else POSES if varies else max(int(form[FOLD]), 1)
    if form[ROTATES]:
        angle = rng.uniform(0.0, 2.0 * np.pi, count)
        if only_angle:
            angle = angle[0] + np.arange(count) * 2.0 * np.pi / count
    else:
        fold = max(int(form[FOLD]), 1)
        angle = (np.arange(count) % fold) * 2.0 * np.pi / fold
    about = Rotation.from_rotvec(angle[:, None] * axis)
    # Uniform on the cap of directions within the tilt.
    tilt = np.arccos(1.0 - rng.uniform(size=count) * (1.0 - np.cos(form[TILT])))
    across = np.cross(axis, rng.normal(size=(count, 3)))
    length = np.linalg.norm(across, axis=1, keepdims=True)
    across = across / np.where(length > 0.0, length, 1.0)
    R = (Rotation.from_rotvec(tilt[:, None] * across) * about).as_matrix()
    p = rng.uniform(-1.0, 1.0, (count, 3)) * half
    R[0], p[0] = np.eye(3), 0.0
    return R, p


def at_poses(problem: Problem, state: int, goal: int) -> Problem:
    """Return a problem whose goals are the drawn poses of one goal, alike in every state.

    Args:
        problem: The problem.
        state: The environment state from which the goal is taken.
        goal: The goal.
    """
    drawn = []
    for pose in problem.goals.poses_of(goal):
        R_GT, p_GT = np.eye(3)[None], np.zeros((1, 3))
        if problem.goals.freedom.first.size:
            R_GT, p_GT = drawn_poses(problem.goals.freedom.form[pose])
        R_WG, p_WG = problem.goals.R[state, pose], problem.goals.p[state, pose]
        drawn.append((R_WG @ R_GT, p_WG + p_GT @ R_WG.T))
    R, p = (np.concatenate(parts) for parts in zip(*drawn, strict=True))
    states = len(problem.goals.R)
    return problem.at_single_poses(
        np.repeat(R[None], states, axis=0), np.repeat(p[None], states, axis=0)
    )


def dense_scan(problem: Problem, row: Rows, goal: int, samples: int, joints: FloatArray) -> float:
    """Return the dexterity of the best collision-free sample of one pair, -1 if none is free.

    Args:
        problem: The scene and its goals.
        row: The configuration.
        goal: As in `dense_scans`.
        samples: As in `dense_scans`.
        joints: Filled with the joint angles of the solution [rad] if there is one, shape (7,).
    """
    pairs, found = np.array([[0, goal]]), np.empty((1, 7))
    (value,) = dense_scans(problem, row, pairs, samples, found)
    if value >= 0.0:
        joints[:] = found[0]
    return float(value)


def dense_scans(
    problem: Problem, rows: Rows, pairs: IntArray, samples: int, joints: FloatArray
) -> NDArray[np.float64]:
    """Return the dexterity of the best collision-free sample of each pair, -1 where none is free.

    A goal of several poses, or with freedom, is scanned at many of them (`free_scans`). The
    arguments are those of `scans_of_poses`.
    """
    if problem.goals.freedom.first.size or problem.goals.first_pose.size:
        return free_scans(problem, rows, pairs, samples, joints)
    return scans_of_poses(problem, rows, pairs, samples, joints)


def free_scans(
    problem: Problem, rows: Rows, pairs: IntArray, samples: int, joints: FloatArray
) -> NDArray[np.float64]:
    """Return the dexterity of the best collision-free sample over the poses of each goal.

    The arguments are those of `dense_scans`; `samples` is divided by 8, because neighbouring poses
    have neighbouring solutions. An arm of six joints has all its solutions at each pose, those of
    the closed form, which `six_joint_scans` checks without freedom. So has an arm of five joints,
    with the angle about the axis; where that alone is free, Newton's method finds them.
    """
    values = np.full(len(pairs), -1.0)
    for i, (row, goal) in enumerate(pairs):
        at = rows.at(slice(row, row + 1))
        state = int(at.state[0])
        (first, *others) = problem.goals.poses_of(int(goal))
        is_one = problem.chain.joints == FEWEST_JOINTS and not others
        if is_one and not np.any(problem.goals.freedom.step[first]):
            values[i] = five_joint_scan(problem, at, first, joints[i])
            continue
        posed = at_poses(problem, state, int(goal))
        if problem.chain.joints < 7:
            values[i], joints[i] = best_score(posed, at)
            continue
        clear = np.flatnonzero(gripper_contacts(posed)[state] == NO_CONTACT)
        if not clear.size:
            continue
        tried = np.stack([np.zeros(clear.size, np.int64), clear], axis=1)
        found = np.empty((clear.size, 7))
        of_poses = scans_of_poses(posed, at, tried, samples // 8, found)
        best = int(np.argmax(of_poses))
        values[i], joints[i] = of_poses[best], found[best]
    return values


def best_score(posed: Problem, row: Rows) -> tuple[float, FloatArray]:
    """Return the greatest score over the goals of a problem, and its joints; -1 for none."""
    scores = score(posed, row)
    values = np.where(scores.reason[0] == REACHED, scores.dexterity[0], -1.0)
    best = int(np.argmax(values))
    return float(values[best]), scores.joints[0, best].astype(np.float64)


def five_joint_scan(problem: Problem, row: Rows, goal: int, joints: FloatArray) -> float:
    """Return the dexterity of the best collision-free posture at a goal, -1 if none is free.

    The angle about the axis that the goal leaves free is found with the joints, by Newton's method
    from many starts. Contacts of the base with the environment are not checked.

    Args:
        problem: The scene and its goals, with an arm of five joints.
        row: An initial configuration.
        goal: A goal that leaves the rotation about `Problem.goals.turn` free, and nothing else.
        joints: Filled with the joint angles of the posture [rad], shape (7,).
    """
    work = new_workspace(problem)
    turned = turned_chain(chain_of(problem), problem.goals.turn)
    state, torso = int(row.state[0]), int(row.torso[0])
    _place(problem, work, row, goal)
    best, R_WG, p_WG = -1.0, problem.goals.R[state, goal], problem.goals.p[state, goal]
    for solution in within(turned, newton_solutions(turned, work.R_AG.copy(), work.p_AG.copy())):
        u = np.array([-solution[6], 0.0, 0.0, 0.0, 0.0, 0.0])
        form = problem.goals.freedom.form[goal]
        if not place_gripper_pose(problem, work, row, form, u, R_WG, p_WG):
            continue
        posture = np.concatenate([np.zeros(2), solution[1:6]])[None]
        if not keep_free(problem, work, torso, posture):
            continue
        value = float(measures_of(problem, posture)[0])
        if value > best:
            best, joints[:] = value, posture[0]
    return best


@jit
def _place(owned_problem: Problem, owned_work: Workspace, owned_row: Rows, goal: int) -> None:
    """Place base and goal in the arm base."""
    problem, work, row = unowned(owned_problem), unowned(owned_work), unowned(owned_row)
    place_base(problem, work, row, 0)
    goal_in_arm_base(problem, work, row.state[0], row.torso[0], goal)

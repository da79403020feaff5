"""Contact between two arms, and the best pair of postures without."""

from __future__ import annotations

import numpy as np

from tcs.errors import ArmClassError
from tcs.kernel.arrays import FloatArray, IntArray, SceneArrays
from tcs.kernel.base_pose import environment_in_arm_base, place_base, pose_in_arm_base
from tcs.kernel.cache import inner, jit
from tcs.kernel.collide import closer, move, spheres_overlap
from tcs.kernel.contacts import (
    NO_CONTACT,
    arm_contact,
    at_goal,
    gripper_body_contact,
    gripper_contact_at,
    place_coupled_links,
)
from tcs.kernel.dexterity.measures import measure_at, rounded_inward
from tcs.kernel.freedom.forms import FEWEST_JOINTS, pose_of
from tcs.kernel.group_contacts import groups_touch
from tcs.kernel.kinematics import link_poses
from tcs.kernel.motion.goal_postures import postures_at
from tcs.kernel.problem import Problem, gaps_between
from tcs.kernel.rows import Rows
from tcs.kernel.six_joints.score_solutions import new_six_joint_solver
from tcs.kernel.six_joints.solutions import MOST_SOLUTIONS, solve_six_joints, within_limits
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace, new_workspace

SAMPLES_OF_FREE_GOALS = 8
"""Least number of values of the free joint at each sampled pose of a goal with freedom, which has
dozens."""


class TwoArms:
    """The problems of two arms of one robot, and the gaps between their shapes."""

    def __init__(self, first: Problem, second: Problem, scenes: tuple[SceneArrays, SceneArrays]):
        """Prepare the contact of two arms.

        Args:
            first: The problem of one arm, without the other.
            second: The problem of the other.
            scenes: Their scenes.

        Raises:
            ArmClassError: If an arm has five joints.
        """
        if first.chain.joints == FEWEST_JOINTS or second.chain.joints == FEWEST_JOINTS:
            raise ArmClassError(
                "two arms at once need six or seven joints each, and one of them has five: leave "
                "'together_with' out of the goals."
            )
        self.problems = (first, second)
        self.works = (new_workspace(first), new_workspace(second))
        self.gaps = gaps_between(*scenes, first.links.groups, second.links.groups)

    def contacts(self, torsos: IntArray, first: FloatArray, second: FloatArray) -> IntArray:
        """Return the bodies of the two arms that touch, of several pairs of postures.

        Args:
            torsos: The torso level of each pair, shape (n,).
            first: Joints of the first arm [rad], shape (n, 7).
            second: Joints of the second arm [rad], shape (n, 7).

        Returns:
            Numbers of a body of the first and of one of the second arm, in the scene of each; -1
            where the arms do not touch, shape (n, 2).
        """
        bodies = np.full((len(torsos), 2), -1)
        contacts_of_pairs(*self.problems, *self.works, torsos, first, second, self.gaps, bodies)
        return bodies

    def grippers_meet(self, bodies: tuple[int, int]) -> bool:
        """Return whether both bodies in contact are of the grippers, which the goals place."""
        return all(
            np.all(problem.links.frame[: problem.links.body.size][problem.links.body == body] == 7)
            for problem, body in zip(self.problems, bodies, strict=True)
        )

    def best_pair(
        self,
        row: Rows,
        goals: tuple[int, int],
        known: tuple[FloatArray, FloatArray],
        samples: int,
    ) -> tuple[float, FloatArray, FloatArray] | None:
        """Return the pair of free postures with the greatest lesser measure.

        Args:
            row: An initial configuration.
            goals: The goal of each arm.
            known: A free posture of each arm by itself [rad], shape (0 or 1, 7).
            samples: Values of the free joint that are tried.

        Returns:
            The lesser measure and the joints of both arms [rad], rounded to float32; None if the
            arms touch each other in every pair.
        """
        found = [self.postures(k, row, goals[k], known[k], samples) for k in range(2)]
        (first, of_first), (second, of_second) = found
        if not len(first) or not len(second):
            return None
        lesser = np.minimum(of_first[:, None], of_second[None, :])
        order = np.argsort(-lesser, axis=None, kind="stable")
        pairs = np.stack(np.unravel_index(order, lesser.shape), axis=1).astype(np.int64)
        torso = int(row.torso[0])
        best = best_free_pair(*self.problems, *self.works, torso, first, second, pairs, self.gaps)
        if best < 0:
            return None
        i, j = pairs[best]
        return float(lesser[i, j]), first[i], second[j]

    def postures(
        self, k: int, row: Rows, goal: int, known: FloatArray, samples: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return free postures of an arm by itself at a goal, the best first, and measures."""
        problem, work = self.problems[k], self.works[k]
        parts = [known] if len(known) else []
        for pose in problem.goals.poses_of(goal):
            parts += self._postures_at(problem, work, row, pose, samples)
        postures = np.concatenate(parts) if parts else np.empty((0, 7))
        measures = measures_of(problem, postures)
        order = np.argsort(-measures, kind="stable")
        return np.ascontiguousarray(postures[order]), measures[order]

    def _postures_at(
        self, problem: Problem, work: Workspace, row: Rows, pose: int, samples: int
    ) -> list[FloatArray]:
        """Return free postures of an arm by itself at the samples of a pose, shapes (n, 7)."""
        free = problem.goals.freedom
        R, p = problem.goals.R[row.state[0], pose], problem.goals.p[row.state[0], pose]
        offsets, form = np.zeros((1, 6)), np.zeros(15)
        if free.first.size:
            offsets, form = free.samples(pose), free.form[pose]
        if len(offsets) > 1:
            samples = max(SAMPLES_OF_FREE_GOALS, samples // len(offsets))
        parts = []
        for u in offsets:
            if not place_gripper_pose(problem, work, row, form, u, R, p):
                continue
            if problem.chain.joints == 6:
                tried = six_joint_postures(problem, work)
            else:
                tried = postures_at(problem, work.R_AG, work.p_AG, samples)
            kept = keep_free(problem, work, int(row.torso[0]), tried)
            parts.append(tried[:kept])
        return parts


def six_joint_postures(problem: Problem, work: Workspace) -> FloatArray:
    """Return the solutions of an arm of six joints within its limits, shape (n, 7)."""
    solver, solutions = new_six_joint_solver(problem), np.empty((MOST_SOLUTIONS, 7))
    found = solve_six_joints(solver.arm, work.R_AG, work.p_AG, solutions)
    return solutions[: within_limits(solver.arm, solutions, found)]


@jit
def place_gripper_pose(
    owned_problem: Problem,
    owned_work: Workspace,
    owned_row: Rows,
    form: FloatArray,
    u: FloatArray,
    R_WG: FloatArray,
    p_WG: FloatArray,
) -> bool:
    """Place environment and tool in the arm base; return whether the gripper touches nothing.

    Args:
        owned_problem: The scene.
        owned_work: Filled.
        owned_row: An initial configuration.
        form: Row of `FreeGoals.form`, zeros for a single pose.
        u: Parameters of the pose, shape (6,).
        R_WG: Orientation of the goal, shape (3, 3).
        p_WG: Position of the goal [m], shape (3,).
    """
    problem, work = unowned(owned_problem), unowned(owned_work)
    row = unowned(owned_row)
    state, torso = row.state[0], row.torso[0]
    place_base(problem, work, row, 0)
    environment_in_arm_base(problem, work, torso)
    R, p = np.empty((3, 3)), np.empty(3)
    pose_of(form, u, R_WG, p_WG, R, p)
    if gripper_contact_at(problem, work, state, R, p) != NO_CONTACT:
        return False
    pose_in_arm_base(problem, work, torso, R, p)
    return gripper_body_contact(problem, work, problem.body.shapes_A[torso]) == NO_CONTACT


@jit
def keep_free(
    owned_problem: Problem, owned_work: Workspace, torso: int, postures: FloatArray
) -> int:
    """Keep, at the begin of the array, the postures of an arm that touch nothing.

    They are rounded to float32 within the limits, as scores are. The scene is that of the last
    `place_gripper_pose`.

    Args:
        owned_problem: The scene.
        owned_work: Workspace with environment, gripper and tool pose in place.
        torso: The torso level.
        postures: Joints [rad] that hold the tool at its pose, changed in place, shape (n, 7).

    Returns:
        The number of kept postures.
    """
    problem, work = unowned(owned_problem), unowned(owned_work)
    rounded = np.empty(7)
    kept = 0
    work.last[0] = -1
    for n in range(len(postures)):
        if arm_contact(problem, work, problem.body.shapes_A[torso], postures[n]) != NO_CONTACT:
            continue
        if not at_goal(problem, work):
            continue
        rounded_inward(postures[n], problem.arm.lower, problem.arm.upper, rounded)
        for i in range(7):
            postures[kept, i] = rounded[i]
        kept += 1
    return kept


@jit
def measures_of(owned_problem: Problem, postures: FloatArray) -> FloatArray:
    """Return the dexterity measure of each posture, shape (n,)."""
    problem = unowned(owned_problem)
    measures = np.empty(len(postures))
    for n in range(len(postures)):
        measures[n] = measure_at(problem, postures[n])
    return measures


@jit
def contacts_of_pairs(
    owned_first: Problem,
    owned_second: Problem,
    owned_work: Workspace,
    owned_other: Workspace,
    torsos: IntArray,
    first: FloatArray,
    second: FloatArray,
    gaps: FloatArray,
    bodies: IntArray,
) -> None:
    """Fill the bodies of two arms that touch, of pairs of postures; see `TwoArms.contacts`."""
    a, b = unowned(owned_first), unowned(owned_second)
    work, other = unowned(owned_work), unowned(owned_other)
    shapes, others = np.empty_like(a.links.shapes), np.empty_like(b.links.shapes)
    R, p, rows = np.empty((3, 3)), np.empty(3), np.zeros(2, np.int64)
    for n in range(len(torsos)):
        _pose_of_second(a, b, torsos[n], R, p)
        _place_arm(a, work, first[n], np.eye(3), np.zeros(3), shapes)
        _place_arm(b, other, second[n], R, p, others)
        bodies[n, 0] = bodies[n, 1] = -1
        if _arms_touch(a, shapes, b, others, gaps, rows):
            bodies[n, 0], bodies[n, 1] = a.links.body[rows[0]], b.links.body[rows[1]]


@jit
def best_free_pair(
    owned_first: Problem,
    owned_second: Problem,
    owned_work: Workspace,
    owned_other: Workspace,
    torso: int,
    first: FloatArray,
    second: FloatArray,
    pairs: IntArray,
    gaps: FloatArray,
) -> int:
    """Return the number of the first pair of postures in which the arms do not touch, -1 if none.

    Args:
        owned_first: The problem of the first arm.
        owned_second: That of the second.
        owned_work: Workspace of the first problem.
        owned_other: Workspace of the second.
        torso: The torso level.
        first: Postures of the first arm [rad], shape (n, 7).
        second: Postures of the second arm [rad], shape (m, 7).
        pairs: Numbers of the postures to pair, in the order to try, shape (k, 2).
        gaps: From `gaps_between`.
    """
    a, b = unowned(owned_first), unowned(owned_second)
    work, other = unowned(owned_work), unowned(owned_other)
    R, p, rows = np.empty((3, 3)), np.empty(3), np.zeros(2, np.int64)
    _pose_of_second(a, b, torso, R, p)
    shapes = np.empty((len(first), len(a.links.shapes), a.links.shapes.shape[1]))
    others = np.empty((len(second), len(b.links.shapes), b.links.shapes.shape[1]))
    for n in range(len(first)):
        _place_arm(a, work, first[n], np.eye(3), np.zeros(3), shapes[n])
    for n in range(len(second)):
        _place_arm(b, other, second[n], R, p, others[n])
    for k in range(len(pairs)):
        if not _arms_touch(a, shapes[pairs[k, 0]], b, others[pairs[k, 1]], gaps, rows):
            return k
    return -1


@inner
def _pose_of_second(a: Problem, b: Problem, torso: int, R: FloatArray, p: FloatArray) -> None:
    """Fill the pose of the second arm's base in that of the first, at a torso level."""
    for r in range(3):
        p[r] = 0.0
        for m in range(3):
            p[r] += a.arm_base.R[torso, m, r] * (b.arm_base.p[torso, m] - a.arm_base.p[torso, m])
        for c in range(3):
            R[r, c] = 0.0
            for m in range(3):
                R[r, c] += a.arm_base.R[torso, m, r] * b.arm_base.R[torso, m, c]


@inner
def _place_arm(
    problem: Problem,
    work: Workspace,
    q: FloatArray,
    R: FloatArray,
    p: FloatArray,
    shapes: FloatArray,
) -> None:
    """Fill the packed shapes of an arm and of its groups, its base being at the pose (R, p)."""
    link_poses(problem.chain.R, problem.chain.p, q, work.link_R, work.link_p)
    if len(problem.chain.coupled):
        place_coupled_links(problem, work, q)
    link_R, link_p = np.empty((3, 3)), np.empty(3)
    last = -1
    for i in range(len(problem.links.shapes)):
        frame = problem.links.frame[i]
        if frame != last:
            for r in range(3):
                link_p[r] = p[r]
                for m in range(3):
                    link_p[r] += R[r, m] * work.link_p[frame, m]
                for c in range(3):
                    link_R[r, c] = 0.0
                    for m in range(3):
                        link_R[r, c] += R[r, m] * work.link_R[frame, m, c]
            last = frame
        move(link_R, link_p, problem.links.shapes, i, shapes, i)


@inner
def _arms_touch(
    a: Problem,
    shapes: FloatArray,
    b: Problem,
    others: FloatArray,
    gaps: FloatArray,
    rows: IntArray,
) -> bool:
    """Return whether two arms with their shapes in one frame touch; fills `rows`."""
    groups, other_groups = a.links.groups, b.links.groups
    first, second = groups.first, other_groups.first
    for g in range(len(first) - 1):
        box = first[-1] + g
        for h in range(len(second) - 1):
            other = second[-1] + h
            gap = gaps[box, other]
            if (
                spheres_overlap(shapes, box, others, other, gap)
                and closer(shapes, box, others, other, gap)
                and groups_touch(shapes, groups, g, others, other_groups, h, gaps, rows)
            ):
                return True
    return False

"""The scene of the certified checks, filled anew for each line by compiled code.

It has the layout of `tcs.kernel.motion.scene`, with memory for every shape of the problem and the
boxes around groups of shapes. Shapes are numbered: those of the arm, then the boxes around its
groups; the environment; the rest of the robot, then the boxes around its groups. Only pairs that
may meet along a line are in the scene: groups first, then the shapes of those that may meet on a
piece of it.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import COLUMNS, spheres_overlap
from tcs.kernel.contacts import Workspace
from tcs.kernel.motion.pairs import (
    ROUNDING,
    is_near,
    is_near_on_piece,
    place_shape,
    take_posture,
)
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace, motion_scene
from tcs.kernel.problem import Problem


def new_scene(problem: Problem) -> MotionScene:
    """Return the memory of a scene; `list_groups` and `list_shapes` fill its pairs."""
    arm, rows, environment = (
        len(problem.link_body),
        len(problem.links),
        problem.environment.shape[1],
    )
    others, other_rows = len(problem.body_body), problem.body_A.shape[1]
    # Pairs of groups are followed by the pairs of their shapes, and a row for the one in question.
    groups = rows - arm
    pairs = arm * (environment + others) + arm * arm // 2
    pairs += groups * (environment + other_rows - others) + groups * groups // 2 + 1
    robot = problem.environment_bodies
    body = np.zeros(rows + environment + other_rows, np.int64)
    body[:arm] = problem.link_body + robot
    body[rows : rows + environment] = problem.environment_body
    body[rows + environment :][:others] = problem.body_body + robot
    return motion_scene(problem, 0)._replace(
        links=problem.links,
        link_frame=problem.link_frame,
        fixed=np.zeros((environment + other_rows, COLUMNS)),
        pair=np.zeros((pairs, 3), np.int64),
        first_pair=np.zeros(rows + 1, np.int64),
        first_moving=np.zeros(rows, np.int64),
        centre=np.zeros((3, pairs)),
        bound=np.zeros(pairs),
        gap=np.zeros(pairs),
        body=body,
    )


@inner
def place_scene(problem: Problem, work: Workspace, torso: int, motion: MotionWorkspace) -> None:
    """Place the shapes around the arm.

    Args:
        problem: The scene and its grid.
        work: Workspace with the environment in A.
        torso: Torso level.
        motion: Its shapes are filled.
    """
    environment, body_A, shapes = work.environment_A, problem.body_A[torso], motion.shapes
    at = len(problem.links)
    for n in range(work.near_count[0]):
        j = work.near[n]
        for c in range(COLUMNS):
            shapes[at + j, c] = environment[j, c]
    at += len(environment)
    for j in range(len(body_A)):
        for c in range(COLUMNS):
            shapes[at + j, c] = body_A[j, c]


@inner
def list_groups(
    problem: Problem,
    work: Workspace,
    scene: MotionScene,
    motion: MotionWorkspace,
    points: FloatArray,
    tangents: FloatArray,
) -> int:
    """List the pairs of groups whose boxes may meet along a spline; return their number.

    Args:
        problem: The scene.
        work: Workspace with the environment in A.
        scene: Its first pairs are filled.
        motion: The shapes around the arm are in place.
        points: Joint angles of the spline [rad], shape (pieces + 1, 7), pieces being even.
        tangents: Their derivatives, as in `take_piece`.
    """
    _take_middle(motion, points, tangents)
    take_posture(scene, motion)
    at_environment = len(problem.links)
    at_body = at_environment + len(work.environment_A)
    first_box, body_box = len(problem.link_body), len(problem.body_body)
    count = 0
    for i in range(first_box, len(problem.links)):
        for n in range(work.near_count[0]):
            j = work.near[n]
            gap = problem.gap_environment[i, j]
            count += _may_meet(scene, motion, gap, i, at_environment + j, 0, count)
        for j in range(body_box, body_box + len(problem.body_first) - 1):
            count += _may_meet(scene, motion, problem.gap_body[i, j], i, at_body + j, 0, count)
        # Shapes begin at the tool: those of greater index are on links nearer to the base.
        for j in range(i + 1, len(problem.links)):
            link = problem.link_frame[j]
            if link != problem.link_frame[i]:
                count += _may_meet(scene, motion, problem.gap_arm[i, j], i, j, link, count)
    return count


@inner
def keep_near(
    scene: MotionScene, motion: MotionWorkspace, groups: IntArray, count: int, kept: IntArray
) -> int:
    """List the pairs of groups that may meet on the current piece; return their number.

    Args:
        scene: The scene.
        motion: Scratch, with the current posture.
        groups: Pairs of groups.
        count: Their number.
        kept: Filled with those that may meet.
    """
    near = 0
    for n in range(count):
        if is_near_on_piece(scene, motion, groups[n]):
            kept[near] = groups[n]
            near += 1
    return near


@inner
def list_shapes(
    problem: Problem,
    scene: MotionScene,
    motion: MotionWorkspace,
    groups: int,
    near: IntArray,
    near_count: int,
) -> int:
    """List the pairs of shapes that may meet on the current piece; return their number.

    Args:
        problem: The scene.
        scene: The first pairs are those of groups; its further pairs are filled.
        motion: Scratch, with the current posture; `pairs` is filled.
        groups: Number of pairs of groups.
        near: Those of them that may meet on a piece around the current one.
        near_count: Their number.
    """
    at_environment, count = len(problem.links), groups
    at_body = at_environment + len(problem.gap_environment[0])
    first = problem.link_first
    for n in range(near_count):
        k = near[n]
        if not is_near_on_piece(scene, motion, k):
            continue
        j = scene.pair[k, 1]
        if j < at_environment:
            count = _list_below(scene, motion, problem.gap_arm, first, first, 0, k, count)
        elif j >= at_body:
            others = problem.body_first
            count = _list_below(scene, motion, problem.gap_body, first, others, at_body, k, count)
        else:
            g = scene.pair[k, 0] - first[-1]
            for i in range(first[g], first[g + 1]):
                gap = problem.gap_environment[i, j - at_environment]
                count += _may_meet(scene, motion, gap, i, j, 0, count)
    for k in range(groups, count):
        motion.pairs[k - groups] = k
    return count - groups


@inner
def _list_below(
    scene: MotionScene,
    motion: MotionWorkspace,
    gaps: FloatArray,
    first: IntArray,
    others: IntArray,
    at: int,
    k: int,
    count: int,
) -> int:
    """Append the shapes of a pair of groups to the pairs of the scene; return how many there are.

    Args:
        scene: The scene.
        motion: Scratch, with the current posture.
        gaps: Distances that shapes of the arm and others must keep [m].
        first: First shape of each group of the arm.
        others: First shape of each group of the others.
        at: Number of the first of the others.
        k: The pair of groups.
        count: Number of pairs listed already.
    """
    g, box, link = scene.pair[k, 0] - first[-1], scene.pair[k, 1] - at, scene.pair[k, 2]
    h = box - others[-1]
    for i in range(first[g], first[g + 1]):
        if _may_meet(scene, motion, gaps[i, box], i, at + box, link, count):
            for j in range(others[h], others[h + 1]):
                count += _may_meet(scene, motion, gaps[i, j], i, at + j, link, count)
    return count


@inner
def _take_middle(motion: MotionWorkspace, points: FloatArray, tangents: FloatArray) -> None:
    """Fill the posture in the middle of a spline, and how far each joint is from it on the spline.

    The spline lies between the control points of its pieces.
    """
    last = len(points) - 1
    third = 1.0 / (3.0 * last)
    for k in range(7):
        middle, most = points[last // 2, k], 0.0
        for n in range(last + 1):
            along = abs(points[n, k] - middle) + third * abs(tangents[n, k])
            most = max(most, along)
        motion.q[k], motion.delta[k] = middle, most


@inner
def _may_meet(
    scene: MotionScene, motion: MotionWorkspace, gap: float, i: int, j: int, base: int, k: int
) -> bool:
    """Return whether two shapes may touch on the current piece; makes them pair k of the scene.

    Args:
        scene: The scene.
        motion: Scratch, with the current posture.
        gap: Distance that they must keep, or UNCHECKED [m].
        i: Shape of the arm.
        j: Other shape.
        base: Link that carries the other shape, 0 if it is fixed.
        k: Row of the pairs.
    """
    if gap <= 0.0:
        return False
    # Most pairs are far apart: the shapes are in place, but for the arm's own.
    place_shape(scene, motion, i)
    if base == 0 and not spheres_overlap(
        motion.shapes, i, motion.shapes, j, gap + motion.motion[i, 0] + ROUNDING
    ):
        return False
    scene.pair[k, 0], scene.pair[k, 1], scene.pair[k, 2] = i, j, base
    scene.gap[k] = gap
    return is_near(scene, motion, k, True)


@inner
def pair_contact_code(problem: Problem, scene: MotionScene, k: int) -> int:
    """Return the contact code, as in `tcs.kernel.contacts`, of pair k of the scene."""
    bodies = problem.environment_bodies + problem.robot_bodies
    return problem.link_body[scene.pair[k, 0]] * bodies + scene.body[scene.pair[k, 1]]

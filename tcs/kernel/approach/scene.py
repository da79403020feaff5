"""The scene of the certified checks, filled anew for each initial configuration by compiled code.

It has the layout of `tcs.kernel.motion.scene`, with memory for every shape and every pair of the
problem. Shapes are numbered: those of the arm, the environment, the rest of the robot.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import BOUND, CENTRE, COLUMNS
from tcs.kernel.contacts import Workspace
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace, motion_scene
from tcs.kernel.problem import Problem


def new_scene(problem: Problem) -> MotionScene:
    """Return the memory of a scene; `place_scene` fills its shapes and pairs."""
    arm, environment = len(problem.link_body), problem.environment.shape[1]
    others = len(problem.body_body)
    pairs = arm * (environment + others) + arm * arm // 2
    robot = problem.environment_bodies
    return motion_scene(problem, 0)._replace(
        fixed=np.zeros((environment + others, COLUMNS)),
        pair=np.zeros((pairs, 3), np.int64),
        first_pair=np.zeros(arm + 1, np.int64),
        first_moving=np.zeros(arm, np.int64),
        centre=np.zeros((3, pairs)),
        bound=np.zeros(pairs),
        gap=np.zeros(pairs),
        body=np.concatenate(
            [problem.link_body + robot, problem.environment_body, problem.body_body + robot]
        ),
    )


@inner
def place_scene(
    problem: Problem, work: Workspace, torso: int, scene: MotionScene, motion: MotionWorkspace
) -> None:
    """Place the shapes around the arm, and list the pairs that may come near each other.

    Args:
        problem: The scene and its grid.
        work: Workspace with the environment in A.
        torso: Torso level.
        scene: Its pairs are filled.
        motion: Its shapes are filled.
    """
    arm, others, near = len(problem.link_body), len(problem.body_body), work.near_count[0]
    environment, body_A, shapes = work.environment_A, problem.body_A[torso], motion.shapes
    first_body = arm + problem.environment.shape[1]
    # Rows that nothing reads hold the distance of each shape from A, less its size.
    away = scene.fixed
    for n in range(near):
        j = work.near[n]
        for c in range(COLUMNS):
            shapes[arm + j, c] = environment[j, c]
        away[j, 0] = _distance_from_base(environment, j)
    for j in range(others):
        for c in range(COLUMNS):
            shapes[first_body + j, c] = body_A[j, c]
    count = 0
    for i in range(arm):
        scene.first_pair[i] = count
        reach = _reach(problem, i)
        for n in range(near):
            j = work.near[n]
            gap = problem.gap_environment[i, j]
            if gap > 0.0 and away[j, 0] <= reach + gap:
                count = _add_pair(scene, shapes, count, i, arm + j, gap)
        for j in range(others):
            gap = problem.gap_body[i, j]
            if gap > 0.0:
                count = _add_pair(scene, shapes, count, i, first_body + j, gap)
        scene.first_moving[i] = count
        # Shapes begin at the tool: those of greater index are on links nearer to the base.
        for j in range(i + 1, arm):
            gap = problem.gap_arm[i, j]
            if gap > 0.0 and problem.link_frame[i] != problem.link_frame[j]:
                count = _add_pair(scene, shapes, count, i, j, gap)
                scene.pair[count - 1, 2] = problem.link_frame[j]
    scene.first_pair[arm] = count


@inner
def _add_pair(
    scene: MotionScene, shapes: FloatArray, count: int, i: int, j: int, gap: float
) -> int:
    """Append the pair of arm shape i and fixed shape j to the pairs; return their number."""
    scene.pair[count, 0], scene.pair[count, 1], scene.pair[count, 2] = i, j, 0
    scene.gap[count] = gap
    scene.bound[count] = scene.links[i, BOUND] + shapes[j, BOUND]
    for r in range(3):
        scene.centre[r, count] = shapes[j, CENTRE + r]
    return count + 1


@inner
def _distance_from_base(shapes: FloatArray, j: int) -> float:
    """Return the distance of the bounding sphere of a shape from the origin of A [m]."""
    x, y, z = shapes[j, CENTRE], shapes[j, CENTRE + 1], shapes[j, CENTRE + 2]
    return np.sqrt(x * x + y * y + z * z) - shapes[j, BOUND]


@inner
def _reach(problem: Problem, i: int) -> float:
    """Return an upper bound of the distance of arm shape i from the origin of A [m]."""
    links, reach = problem.links, 0.0
    for k in range(problem.link_frame[i]):
        p = problem.chain_p[k]
        reach += np.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
    x, y, z = links[i, CENTRE], links[i, CENTRE + 1], links[i, CENTRE + 2]
    return reach + np.sqrt(x * x + y * y + z * z) + links[i, BOUND]


@inner
def pair_contact_code(problem: Problem, scene: MotionScene, k: int) -> int:
    """Return the contact code, as in `tcs.kernel.contacts`, of pair k of the scene."""
    bodies = problem.environment_bodies + problem.robot_bodies
    return problem.link_body[scene.pair[k, 0]] * bodies + scene.body[scene.pair[k, 1]]

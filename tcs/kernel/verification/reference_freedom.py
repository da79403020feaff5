"""Reference implementation of goals with freedom: poses tried one by one, in plain loops.

The poses are those that the kernel samples, computed by rotation vectors of SciPy. The kernel then
refines the best of them; `is_served` judges where that led.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from tcs.kernel.arrays import FloatArray, GridArrays, SceneArrays
from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.kernel.freedom.forms import AXIS, COLUMNS, FOLD, HALF, ROTATES, TILT
from tcs.kernel.freedom.goals import FreeGoals
from tcs.kernel.scores import REACHED
from tcs.kernel.verification.reference import Pose, compose, inverse, link_poses
from tcs.kernel.verification.reference_pairs import Verdict, placed_scene, score


def offset(form: FloatArray, u: FloatArray) -> Pose:
    """Return X_GT of the parameters u of a freedom."""
    tilt = u[1] * form[9:12] + u[2] * form[12:15]
    about = u[0] * form[AXIS : AXIS + 3]
    R = Rotation.from_rotvec(tilt) * Rotation.from_rotvec(about)
    return R.as_matrix(), np.array(u[3:6])


def free_score(
    scene: SceneArrays,
    grid: GridArrays,
    h: int,
    goal: int,
    free: FreeGoals,
    measure: str = DEFAULT_MEASURE,
) -> Verdict:
    """Return the best verdict over the samples of the poses of a goal, without refinement.

    If no sample reaches the goal, the verdict is that of the last sample.
    """
    best = None
    posed = []
    for pose in scene.poses_of(goal):
        tools = [(np.eye(3), np.zeros(3))]
        if free.first.size:
            tools = [offset(free.form[pose], u) for u in free.samples(pose)]
        posed += [(at_offset(scene, pose, tool), pose) for tool in tools]
    for single, pose in posed:
        verdict = score(single, grid, h, pose, measure)
        is_better = verdict.reason == REACHED and (
            best is None or best.reason != REACHED or verdict.dexterity > best.dexterity
        )
        if best is None or is_better:
            best = verdict
    assert best is not None
    return best


def at_offset(scene: SceneArrays, goal: int, X_GT: Pose) -> SceneArrays:
    """Return the scene whose goals are all poses, one of them moved by X_GT, and nothing free.

    An arm of five joints keeps the freedom, of which it needs the rotation.
    """
    R, p = scene.goal_R.copy(), scene.goal_p.copy()
    for state in range(len(R)):
        R[state, goal], p[state, goal] = compose((R[state, goal], p[state, goal]), X_GT)
    freedom = scene.freedom if scene.chain.joints == 5 else scene.freedom[:0]
    return scene._replace(goal_R=R, goal_p=p, freedom=freedom, first_pose=scene.first_pose[:0])


def is_served(scene: SceneArrays, grid: GridArrays, h: int, goal: int, q: FloatArray) -> bool:
    """Return whether the tool at joint angles q is at a pose that serves a goal, touching nothing.

    Joint angles are float32: the tolerances are those of `reference_pairs.confirms`.
    """
    return any(_is_served_at(scene, grid, h, pose, q) for pose in scene.poses_of(goal))


def _is_served_at(scene: SceneArrays, grid: GridArrays, h: int, goal: int, q: FloatArray) -> bool:
    """Return what `is_served` does, for one pose."""
    placed, blocked = placed_scene(scene, grid, h, goal)
    X_AT = link_poses(scene.chain, q)[-1]
    R, p = compose(inverse(placed.X_AG), X_AT)
    form = scene.freedom[goal].copy() if len(scene.freedom) else np.zeros(COLUMNS)
    if not np.any(form[AXIS : AXIS + 3]):
        # Nothing is free, about any axis.
        form[AXIS] = 1.0
    at_goal = bool(np.all(np.abs(p) <= form[HALF : HALF + 3] + 2e-6))
    if form[TILT] < math.pi or not form[ROTATES]:
        axis = form[AXIS : AXIS + 3]
        tilted = R @ axis
        angle = math.acos(min(max(float(axis @ tilted), -1.0), 1.0))
        # The cosine of a small angle loses half of the digits.
        at_goal = at_goal and angle <= form[TILT] + 5e-4
        if not form[ROTATES]:
            # R with its tilt taken back is a rotation about the axis by one of the angles.
            normal = np.cross(axis, tilted)
            length = float(np.linalg.norm(normal))
            back = Rotation.from_rotvec(-angle * normal / length if length > 0 else np.zeros(3))
            left = (back * Rotation.from_matrix(R)).as_rotvec()
            turn = 2.0 * math.pi / max(float(form[FOLD]), 1.0)
            at_goal = at_goal and abs(math.remainder(float(left @ axis), turn)) <= 1e-5
    placed.X_AG = X_AT
    limits = bool(np.all((q >= scene.chain.lower) & (q <= scene.chain.upper)))
    gripper = placed.gripper_touches(with_body=False) or placed.gripper_touches(with_body=True)
    return at_goal and limits and not (blocked or gripper or placed.arm_touches(q))

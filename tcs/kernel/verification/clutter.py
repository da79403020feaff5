"""Scenes with shapes added about one configuration of the robot."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, SPHERE, FloatArray, GridArrays, SceneArrays, Shapes
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.verification.free_postures import base_is_free
from tcs.kernel.verification.reference import Pose, compose, rot_z
from tcs.kernel.workspace import new_workspace

CLUTTER = 10
"""Number of shapes added within an arm's length of the arm base."""


def cluttered(
    rng: np.random.Generator, scene: SceneArrays, grid: GridArrays, number: int = CLUTTER
) -> tuple[SceneArrays, int]:
    """Return the scene with shapes added about one random configuration, whose base stays free."""
    problem = build_problem(scene)
    while True:
        h = int(rng.integers(grid.size))
        row = rows_at(grid, [h])
        if not base_is_free(problem, new_workspace(problem), row):
            continue
        at = arm_base(scene, grid, h)[1]
        added = scene
        for k in range(number):
            more = with_obstacle(added, *random_shape(rng, at, k))
            crowded = build_problem(more)
            if base_is_free(crowded, new_workspace(crowded), row):
                added = more
        return added, h


def random_shape(
    rng: np.random.Generator, centre: FloatArray, k: int
) -> tuple[int, FloatArray, FloatArray, FloatArray]:
    """Return type, size [m], orientation and position [m] of a shape within 0.9 m of a point."""
    shape_type = (BOX, CAPSULE, SPHERE)[k % 3]
    size = rng.uniform(0.03, 0.12, 3)
    direction = rng.normal(size=3)
    p = centre + direction / np.linalg.norm(direction) * rng.uniform(0.3, 0.9)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return shape_type, size, axes * np.sign(np.linalg.det(axes)), p


def with_obstacle(
    scene: SceneArrays, shape_type: int, size: FloatArray, R: FloatArray, p: FloatArray
) -> SceneArrays:
    """Return the scene with one more shape in the environment, checked against everything."""
    old = scene.environment
    states = len(old.p)
    size = size * {SPHERE: [1, 0, 0], CAPSULE: [1, 1, 0], BOX: [1, 1, 1]}[shape_type]
    environment = Shapes(
        type=np.append(old.type, np.int8(shape_type)),
        size=np.concatenate([old.size, size[None]]),
        pad=np.append(old.pad, 0.0),
        body=np.append(old.body, old.body.max(initial=0)),
        frame=np.append(old.frame, np.int8(0)),
        R=np.concatenate([old.R, np.repeat(R[None, None], states, axis=0)], axis=1),
        p=np.concatenate([old.p, np.repeat(p[None, None], states, axis=0)], axis=1),
    )

    def more(mask: np.ndarray) -> np.ndarray:
        return np.concatenate([mask, np.ones((len(mask), 1), bool)], axis=1)

    return scene._replace(
        environment=environment,
        arm_vs_environment=more(scene.arm_vs_environment),
        body_vs_environment=more(scene.body_vs_environment),
    )


def arm_base(scene: SceneArrays, grid: GridArrays, h: int) -> Pose:
    """Return X_WA at configuration h."""
    _, x, y, yaw, torso = (int(i) for i in np.unravel_index(h, grid.shape))
    X_WB = rot_z(grid.base_yaw[yaw]), np.array([grid.base_x[x], grid.base_y[y], 0.0])
    return compose(X_WB, (scene.arm_base_R[torso], scene.arm_base_p[torso]))

"""The scene of the certified checks: one for all lines, in which shapes are placed anew.

It is that of `tcs.kernel.motion.scene`, with its groups of shapes. Compiled code places what is
around the arm at each initial configuration.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import CENTRE, COLUMNS
from tcs.kernel.contacts import BASE_FIXED, Workspace
from tcs.kernel.motion.groups import grouped
from tcs.kernel.motion.idle import needed_pairs
from tcs.kernel.motion.scene import (
    MotionScene,
    MotionWorkspace,
    carriers,
    moved_shapes,
    torso_scene,
    with_pairs,
)
from tcs.kernel.problem import Problem

AWAY = 1e3
"""Coordinate of shapes beyond the arm's reach, which are not placed [m]."""


class LineScene(NamedTuple):
    """The scene of all lines of a problem."""

    motion: MotionScene
    """Shapes of the arm and pairs; the places of fixed shapes are those of the first torso level,
    in no particular environment."""
    boxes: FloatArray
    """Boxes around groups of the robot's fixed shapes in A at each torso level, packed, shape
    (torso levels, n_boxes, 17)."""


def approach_scene(problem: Problem) -> LineScene:
    """Return the scene of all lines of a problem; `place_scene` places shapes in it.

    Pairs of the robot's own shapes that touch at no torso level are left out.
    """
    every = [torso_scene(problem, torso) for torso in range(problem.torso_levels)]
    needed = [needed_pairs(scene, problem.environment_bodies) for scene in every]
    scene = grouped(with_pairs(every[0], np.any(needed, axis=0)), carriers(problem))
    return LineScene(scene, _boxes(problem, scene))


def _boxes(problem: Problem, scene: MotionScene) -> FloatArray:
    """Return the boxes around groups of fixed shapes at each torso level, see `LineScene`."""
    shapes = problem.environment_body.size + problem.body_body.size
    boxes = scene.fixed[shapes:]
    bodies = scene.body[len(scene.links) + shapes :] - problem.environment_bodies
    first = [int(np.argmax(problem.body_body == body)) for body in bodies]
    on_base = problem.body_mount[np.array(first, np.int64)] == BASE_FIXED
    every = np.repeat(boxes[None], problem.torso_levels, axis=0)
    for torso, (R_BA, p_BA) in enumerate(zip(problem.base_R, problem.base_p, strict=True)):
        # From A at the first torso level to A here, by way of the base.
        p = R_BA.T @ (problem.base_p[0] - p_BA)
        every[torso, on_base] = moved_shapes(boxes[on_base], R_BA.T @ problem.base_R[0], p)
    return every


@inner
def place_scene(
    problem: Problem,
    work: Workspace,
    torso: int,
    scene: MotionScene,
    boxes: FloatArray,
    motion: MotionWorkspace,
) -> None:
    """Place the shapes around the arm.

    Args:
        problem: The scene and its grid.
        work: Workspace with the environment in A.
        torso: Torso level.
        scene: Its centres are filled.
        boxes: Boxes around groups of the robot's fixed shapes at each torso level.
        motion: Its shapes are filled.
    """
    environment, body_A, shapes = work.environment_A, problem.body_A[torso], motion.shapes
    at = len(scene.links)
    for j in range(len(environment)):
        for r in range(3):
            shapes[at + j, CENTRE + r] = AWAY
    for n in range(work.near_count[0]):
        j = work.near[n]
        for c in range(COLUMNS):
            shapes[at + j, c] = environment[j, c]
    at += len(environment)
    for j in range(len(problem.body_body)):
        for c in range(COLUMNS):
            shapes[at + j, c] = body_A[j, c]
    at += len(problem.body_body)
    for j in range(boxes.shape[1]):
        for c in range(COLUMNS):
            shapes[at + j, c] = boxes[torso, j, c]
    pair, centre = scene.pair, scene.centre
    for k in range(scene.first_pair[-1]):
        if pair[k, 2] == 0:
            for r in range(3):
                centre[r, k] = shapes[pair[k, 1], CENTRE + r]


@inner
def pair_contact_code(problem: Problem, scene: MotionScene, k: int) -> int:
    """Return the contact code, as in `tcs.kernel.contacts`, of pair k of the scene."""
    bodies = problem.environment_bodies + problem.robot_bodies
    return problem.link_body[scene.pair[k, 0]] * bodies + scene.body[scene.pair[k, 1]]

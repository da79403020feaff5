"""The scene of the certified checks: one for all lines, in which shapes are placed anew.

It is that of `tcs.kernel.motion.scene`, with its groups of shapes. Compiled code places what is
around the arm at each initial configuration.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import CENTRE, COLUMNS
from tcs.kernel.contacts import BASE_FIXED
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.motion.box_trees import grouped
from tcs.kernel.motion.edges import curve_is_free, is_placed_free
from tcs.kernel.motion.never_in_contact import needed_pairs
from tcs.kernel.motion.scene import (
    MotionScene,
    MotionWorkspace,
    carriers,
    moved_shapes,
    new_motion_workspace,
    torso_scene,
    with_pairs,
)
from tcs.kernel.problem import Problem
from tcs.kernel.scores import JOINTS
from tcs.kernel.views import compile_for_views
from tcs.kernel.workspace import Workspace

AWAY = 1e3
"""Coordinate of shapes beyond the arm's reach, which are not placed [m]."""


ROUNDING = 1e-9
"""Difference of coordinates that rounding makes [m], above it."""


class LineScene(NamedTuple):
    """The scene of all lines of a problem."""

    motion: MotionScene
    """Shapes of the arm and pairs; the places of fixed shapes are those of the first torso level,
    in no particular environment."""
    moving: IntArray
    """Fixed shapes of the robot, and boxes around groups of them, that are elsewhere in A at other
    torso levels: indices among all shapes, shape (n_moving,)."""
    moved: FloatArray
    """These in A at each torso level, packed, shape (torso levels, n_moving, 17)."""


def approach_scene(problem: Problem) -> LineScene:
    """Return the scene of all lines of a problem; `place_scene` places shapes in it.

    Pairs of the robot's own shapes that touch at no torso level are left out.
    """
    first = torso_scene(problem, 0)
    needed = needed_pairs(
        first, first.shapes.body[first.pairs.members[:, 1]] >= problem.environment.bodies
    )
    apart = _is_apart_from_torso(problem, first)
    for torso in range(1, len(problem.arm_base.R)):
        left = ~needed & apart
        if np.any(left):
            fixed = first.shapes.fixed.copy()
            bodies = len(problem.body.body)
            fixed[problem.environment.body.size :] = problem.body.shapes_A[torso, :bodies]
            elsewhere = first._replace(shapes=first.shapes._replace(fixed=fixed))
            some = with_pairs(elsewhere, left)
            needed[left] = needed_pairs(some, np.ones(len(some.pairs.members), np.bool_))
    scene = grouped(with_pairs(first, needed), carriers(problem))
    of_robot = np.concatenate(
        [problem.body.shapes_A[:, : len(problem.body.body)], _boxes(problem, scene)], axis=1
    )
    moving = np.flatnonzero(_is_moved(of_robot))
    first_shape = len(scene.shapes.links) + problem.environment.body.size
    return LineScene(scene, first_shape + moving, np.ascontiguousarray(of_robot[:, moving]))


def compile_checks(problem: Problem) -> None:
    """Compile the certified checks of postures and curves, as lines are followed with them.

    They are a fifth of what approaches are compiled from, and need nothing that the inverse
    kinematics decides.
    """
    scene = torso_scene(problem, 0)
    work = new_motion_workspace(scene)
    # Scoring without approach needs the first, too.
    compile_for_views(measure_at, problem, np.empty(JOINTS))
    compile_for_views(is_placed_free, scene, work)
    compile_for_views(curve_is_free, scene, work, True)


def _is_apart_from_torso(problem: Problem, scene: MotionScene) -> BoolArray:
    """Return which pairs are of a shape that is elsewhere in A at other torso levels.

    Args:
        problem: The scene.
        scene: A scene of it without groups; the result has shape (n_pairs,).
    """
    moved = np.append(_is_moved(problem.body.shapes_A), False)
    shape = scene.pairs.members[:, 1] - len(scene.shapes.links) - problem.environment.body.size
    found: BoolArray = moved[np.where(shape >= 0, shape, -1)]
    return found


def _is_moved(rows: FloatArray) -> BoolArray:
    """Return which packed shapes, shape (torso levels, n, 17), are elsewhere at other levels."""
    moved: BoolArray = np.any(np.abs(rows - rows[0]) > ROUNDING, axis=(0, 2))
    return moved


def _boxes(problem: Problem, scene: MotionScene) -> FloatArray:
    """Return the boxes around groups of fixed shapes in A, shape (torso levels, n_boxes, 17)."""
    shapes = problem.environment.body.size + problem.body.body.size
    boxes = scene.shapes.fixed[shapes:]
    bodies = scene.shapes.body[len(scene.shapes.links) + shapes :] - problem.environment.bodies
    first = [int(np.argmax(problem.body.body == body)) for body in bodies]
    on_base = problem.body.mount[np.array(first, np.int64)] == BASE_FIXED
    every = np.repeat(boxes[None], len(problem.arm_base.R), axis=0)
    for torso, (R_BA, p_BA) in enumerate(zip(problem.arm_base.R, problem.arm_base.p, strict=True)):
        # From A at the first torso level to A here, by way of the base.
        p = R_BA.T @ (problem.arm_base.p[0] - p_BA)
        every[torso, on_base] = moved_shapes(boxes[on_base], R_BA.T @ problem.arm_base.R[0], p)
    return every


@inner
def place_scene(
    problem: Problem,
    work: Workspace,
    torso: int,
    scene: MotionScene,
    moving: IntArray,
    moved: FloatArray,
    motion: MotionWorkspace,
) -> None:
    """Place the shapes around the arm that are elsewhere than before.

    Args:
        problem: The scene.
        work: Workspace with the environment in A.
        torso: Torso level.
        scene: Its centres are filled.
        moving: As in `LineScene`.
        moved: As in `LineScene`.
        motion: Its shapes are filled.
    """
    environment, shapes = work.environment_A, motion.posture.shapes
    at = len(scene.shapes.links)
    for j in range(len(environment)):
        for r in range(3):
            shapes[at + j, CENTRE + r] = AWAY
    for n in range(work.near_count[0]):
        j = work.near[n]
        for c in range(COLUMNS):
            shapes[at + j, c] = environment[j, c]
    for n in range(len(moving)):
        for c in range(COLUMNS):
            shapes[moving[n], c] = moved[torso, n, c]
    pair, centre = scene.pairs.members, scene.pairs.centre
    for k in range(scene.pairs.first[-1]):
        if pair[k, 2] == 0:
            for r in range(3):
                centre[r, k] = shapes[pair[k, 1], CENTRE + r]


@inner
def pair_contact_code(problem: Problem, scene: MotionScene, k: int) -> int:
    """Return the contact code, as in `tcs.kernel.contacts`, of pair k of the scene."""
    bodies = problem.environment.bodies + problem.robot_bodies
    return (
        problem.links.body[scene.pairs.members[k, 0]] * bodies
        + scene.shapes.body[scene.pairs.members[k, 1]]
    )

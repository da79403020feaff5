"""Collision shapes and goals of a scene as the solids that pictures are made of."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from tcs.kernel.arrays import BOX
from tcs.model.scene import Scene, alternative_poses
from tcs.model.scene.contacts import Group, Part, shape_of
from tcs.model.scene.environment.environment_file import FLOOR
from tcs.model.tasks import Task
from tcs.output.draw import Category, Solid, primitive_corners
from tcs.output.draw.solids import FloatArray, outline

_ARROW = (0.15, 0.06, 0.010, 0.026)
"""Length of a goal's arrow and of its head, half width of shaft and head [m]."""


def robot_solids(scene: Scene, other_arm: Collection[str] = ()) -> list[Solid]:
    """Return the collision shapes of the robot in the present state of the scene.

    Args:
        scene: The scene.
        other_arm: Bodies of an arm that works beside the scored one.
    """
    categories = {Group.ARM: Category.ARM, Group.BODY: Category.ROBOT}
    return [
        part_solid(scene, part, categories[Group.ARM if part.name in other_arm else part.group])
        for part in scene.built.parts
        if part.group in categories
    ]


def environment_solids(scene: Scene, *, in_mount: bool = False) -> list[Solid]:
    """Return the shapes of furniture, person and obstacles in the present state of the scene.

    Args:
        scene: The scene.
        in_mount: Whether they are in the frame of the base poses, for maps, rather than in W.
    """
    parts = environment_parts(scene)
    return [part_solid(scene, part, category, in_mount=in_mount) for part, category in parts]


def environment_parts(scene: Scene) -> list[tuple[Part, Category]]:
    """Return every shape of the environment but the floor, as furniture or person."""
    plant, environment = scene.built.plant, scene.spec.environment
    found = []
    for part in scene.built.parts:
        if part.group is Group.ENVIRONMENT and part.name != FLOOR:
            instance = plant.get_body(part.body).model_instance()
            is_person = environment.is_person(plant.GetModelInstanceName(instance))
            found.append((part, Category.PERSON if is_person else Category.FURNITURE))
    return found


def goal_solids(scene: Scene, task: Task, current: int | None) -> list[Solid]:
    """Return an arrow for each pose of a goal: it ends there and points along the tool's x axis.

    Args:
        scene: The scene.
        task: The task with the goals.
        current: The goal that the arm is at, if any.
    """
    length, head, thin, wide = _ARROW
    half = 0.5 * (length - head)
    shaft = primitive_corners(BOX, (half, thin, thin)) - [head + half, 0.0, 0.0]
    square = np.array([[wide, wide], [-wide, wide], [-wide, -wide], [wide, -wide]])
    tip = np.vstack([np.column_stack([np.full(4, -head), square]), np.zeros((1, 3))])
    solids = []
    for g, poses in enumerate(alternative_poses(scene, task)):
        category = Category.CURRENT_GOAL if g == current else Category.GOAL
        for X_WG in poses:
            R, p = X_WG.rotation().matrix(), X_WG.translation()
            solids += [Solid.placed(category, corners, R, p) for corners in (shaft, tip)]
    return solids


def part_solid(scene: Scene, part: Part, category: Category, *, in_mount: bool = False) -> Solid:
    """Return a collision shape in the present state of the scene, in W or as for a map."""
    corners = primitive_corners(*shape_of(scene.built.scene_graph.model_inspector(), part))
    X = scene.shape_pose(part)
    if in_mount:
        (X,) = scene.seen_from_mount([X])
    return Solid.placed(category, corners, X.rotation().matrix(), X.translation())


def base_outline(scene: Scene) -> FloatArray:
    """Return the outline of the base from above, in its frame [m], shape (n, 2).

    It is that of the bodies on the floor, or of what is bolted down.

    Moves the base of the scene to the origin.
    """
    scene.place_base(0.0, 0.0, 0.0)
    plant, standing = scene.built.plant, scene.spec.robot.standing_bodies
    # The base of a robot that drives with its arm belongs to the arm.
    robot = [part for part in scene.built.parts if part.group is not Group.ENVIRONMENT]
    base = [part for part in robot if plant.get_body(part.body).name() in standing]
    base = base or [part for part in robot if part.group is Group.BODY]
    solids = [part_solid(scene, part, Category.ROBOT, in_mount=True) for part in base]
    corners = [solid.corners[:, :2] for solid in solids]
    return outline(np.concatenate(corners))

"""The things in the viewer: what Meshcat is given once, and what moves with the state."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, Sphere
from pydrake.math import RigidTransform

from tcs.model.scene import Scene, goal_poses
from tcs.model.tasks import Task
from tcs.output.draw import BaseFootprint, Category
from tcs.output.report.scene_solids import base_outline, environment_parts
from tcs.output.view.floor import FloorMap
from tcs.output.view.shapes import Drawn, draw_ground, draw_shapes, rgba, robot_shapes
from tcs.output.view.viewed_set import ViewedSet
from tcs.output.words import REASON_COLOURS
from tcs.placement.tables import Reason

FloatArray = NDArray[np.float64]
Arrow = tuple[int, Reason]
"""A goal's arrow in the colour of a reason."""

ROBOT, ROOM, GOALS, SHOWN, FLOOR, MEMBERS = "robot", "room", "goals", "goal shown", "floor", "set"
"""Paths of the things in Meshcat."""
_BALL = 0.018
"""Radius of the ball at the goal that is shown [m]: seen beside an arrow, and hides none."""
_ARROW = (0.16, 0.055, 0.009, 0.022)
"""Of an arrow: length, length of its head, half widths of shaft and head [m]."""
_MEMBER = "#d7263d"
_MAP_HEIGHT, _LINE_HEIGHT = 0.004, 0.008
"""Above the floor [m], one above the other, so that none flickers through the next."""
_CAMERA = np.array([1.9, -1.9, 1.3])
"""From the middle of the goals [m]: all of a bed and a robot fits into the picture."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Where everything that moves is, and which arrows are seen."""

    poses: Mapping[str, FloatArray]
    """Pose of each path in its parent: rotation and place beside each other, shape (3, 4)."""
    arrows: frozenset[Arrow]
    """The arrows that are seen, one for each goal."""


class SceneObjects:
    """The things of one scene."""

    def __init__(self, scene: Scene, task: Task, viewed: ViewedSet, *, meshes: bool) -> None:
        """Look at a scene.

        Args:
            scene: A scene of the file; it is moved about. Built with meshes if they are shown.
            task: Its task.
            viewed: What came of its configurations.
            meshes: Whether the robot is shown as its meshes, or as its collision shapes.
        """
        self._scene, self._task, self._viewed = scene, task, viewed
        # Moves the base, which every snapshot places anew.
        self._outline = base_outline(scene)
        self._robot = robot_shapes(scene, meshes)
        self._room = _room_shapes(scene)
        self._rest = _resting_arm(scene)

    def snapshot(self, index: int, goal: int) -> Snapshot:
        """Return where everything is at a configuration, the arm at a goal if it is reached.

        Args:
            index: Flat index of the configuration.
            goal: The goal that is shown. Where it is not reached, the arm rests.
        """
        result = self._viewed.result(index)
        scene, at = self._scene, result.configuration
        for name, value in at.environment:
            scene.set_joint(name, value)
        scene.place_base(at.base_x, at.base_y, at.base_yaw)
        scene.set_torso(at.torso)
        joints = self._viewed.joints(index, goal)
        scene.set_arm(self._rest if joints is None else joints)
        plant, context = scene.built.plant, scene.plant_context
        X_WB = scene.base_pose()
        poses = {ROBOT: X_WB}
        for body in {one.body for one in self._robot}:
            X_WL = plant.EvalBodyPoseInWorld(context, plant.get_body(body))
            poses[f"{ROBOT}/{int(body)}"] = X_WB.inverse() @ X_WL
        for body in {one.body for one in self._room}:
            X_WL = plant.EvalBodyPoseInWorld(context, plant.get_body(body))
            poses[f"{ROOM}/{int(body)}"] = X_WL
        goals = goal_poses(scene, self._task)
        poses |= {f"{GOALS}/{g}": X_WG for g, X_WG in enumerate(goals)}
        poses[SHOWN] = RigidTransform(goals[goal].translation())
        return Snapshot(
            {path: X.GetAsMatrix34() for path, X in poses.items()},
            frozenset(enumerate(result.reasons)),
        )

    def set_up(self, meshcat: Meshcat, arrows: Iterable[Arrow], *, compact: bool = False) -> None:
        """Give Meshcat everything there is, nothing placed yet.

        Args:
            meshcat: An empty one.
            arrows: The arrows that will be seen at some time; all are hidden.
            compact: Whether meshes are handed over as bare triangles, which take a fifth of the
                room of their files, but seconds to read.
        """
        draw_ground(meshcat)
        for root, shapes in ((ROBOT, self._robot), (ROOM, self._room)):
            draw_shapes(meshcat, root, shapes, compact=compact)
        corners, faces = _arrow()
        for goal, reason in arrows:
            path = arrow_path((goal, reason))
            meshcat.SetTriangleMesh(path, corners, faces, rgba(REASON_COLOURS[reason]))
            meshcat.SetProperty(path, "visible", False)
        meshcat.SetObject(SHOWN, Sphere(_BALL), rgba(Category.CURRENT_GOAL.colour))
        self._draw_members(meshcat)
        middle = np.mean([X.translation() for X in goal_poses(self._scene, self._task)], axis=0)
        meshcat.SetCameraPose(middle + _CAMERA, middle)

    def _draw_members(self, meshcat: Meshcat) -> None:
        """Draw the outline of the base at each member of the set, and which way it faces."""
        for number, index in enumerate(self._viewed.members):
            at = self._viewed.grid.configuration(index)
            stand = BaseFootprint(at, self._outline)
            middle = np.array([at.base_x, at.base_y])
            ahead = 0.45 * np.array([np.cos(at.base_yaw), np.sin(at.base_yaw)])
            around = np.vstack([stand.polygon, stand.polygon[:1]])
            for name, line in (("outline", around), ("ahead", np.stack([middle, middle + ahead]))):
                points = np.column_stack([line, np.full(len(line), _LINE_HEIGHT)])
                meshcat.SetLine(f"{MEMBERS}/{number}/{name}", points.T, 4.0, rgba(_MEMBER))


def arrow_path(arrow: Arrow) -> str:
    """Return where an arrow is."""
    goal, reason = arrow
    return f"{GOALS}/{goal}/{reason.name.lower()}"


def draw_floor(meshcat: Meshcat, floor: FloorMap, path: str = FLOOR) -> None:
    """Lay a score map on the floor, in place of an older one at that path."""
    if not len(floor.places):
        meshcat.Delete(path)
        return
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    flat = floor.places[:, None] + signs * np.array(floor.half)
    height = np.full((*flat.shape[:2], 1), _MAP_HEIGHT)
    corners = np.concatenate([flat, height], axis=2).reshape(-1, 3)
    halves = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    faces = (4 * np.arange(len(floor.places), dtype=np.int32)[:, None, None] + halves).reshape(
        -1, 3
    )
    colours = np.repeat(floor.colours, 4, axis=0)
    meshcat.SetTriangleColorMesh(
        path, np.asfortranarray(corners.T), np.asfortranarray(faces.T),
        np.asfortranarray(colours.T),
    )  # fmt: skip


def _room_shapes(scene: Scene) -> list[Drawn]:
    inspector = scene.built.scene_graph.model_inspector()
    return [
        Drawn(
            part.body,
            inspector.GetShape(part.geometry),
            inspector.GetPoseInFrame(part.geometry),
            rgba(kind.colour),
        )
        for part, kind in environment_parts(scene)
    ]


def _resting_arm(scene: Scene) -> FloatArray:
    """Return the arm's joints at rest [rad], as the robot file says them, within their limits."""
    robot = scene.spec.robot
    told = np.array([robot.rest.get(name, 0.0) for name in robot.arm_joints])
    lower, upper = scene.arm_limits
    return np.asarray(np.clip(told, lower, upper))


def _arrow() -> tuple[FloatArray, NDArray[np.int32]]:
    """Return corners and triangles of an arrow along x whose tip is at the origin.

    The tip is where the tool has to come to, and it points where the tool points.
    """
    length, head, thin, wide = _ARROW
    square = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    rings = [(-length, thin), (-head, thin), (-head, wide)]
    corners = [np.column_stack([np.full(4, x), size * square]) for x, size in rings]
    points = np.vstack([*corners, np.zeros((1, 3))])
    faces = [[0, 2, 1], [0, 3, 2]]
    for ring in range(2):
        for i in range(4):
            a, b = 4 * ring + i, 4 * ring + (i + 1) % 4
            faces += [[a, b, b + 4], [a, b + 4, a + 4]]
    faces += [[8 + i, 8 + (i + 1) % 4, 12] for i in range(4)]
    return np.asfortranarray(points.T), np.asfortranarray(np.array(faces, dtype=np.int32).T)

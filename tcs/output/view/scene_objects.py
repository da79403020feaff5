"""The objects in the viewer: their shapes, sent once, and their poses in each state."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.geometry import Meshcat, Sphere
from pydrake.math import RigidTransform

from tcs.model.grid import InitialConfiguration
from tcs.model.scene import Scene, goal_poses
from tcs.model.tasks import Task
from tcs.output.draw import BaseFootprint, Category
from tcs.output.report.score.scene_solids import base_outline, environment_parts
from tcs.output.view.floor import FloorMap
from tcs.output.view.shapes import BodyShape, draw_ground, draw_shapes, rgba, robot_shapes
from tcs.output.view.viewed_set import ViewedSet
from tcs.output.words import REASON_COLOURS
from tcs.placement.tables import Reason

FloatArray = NDArray[np.float64]
Arrow = tuple[int, Reason]
"""A goal's arrow in the colour of a reason."""

ROBOT, ENVIRONMENT, GOALS, SHOWN, FLOOR, MEMBERS = (
    "robot",
    "environment",
    "goals",
    "goal shown",
    "floor",
    "set",
)
"""Paths of the objects in Meshcat."""
_MARK_RADIUS = 0.018
"""Radius of the sphere at the shown goal [m]: visible beside an arrow, and does not hide it."""
_ARROW = (0.16, 0.055, 0.009, 0.022)
"""Length of an arrow and of its head, half widths of shaft and head [m]."""
MEMBER_COLOUR = "#d7263d"
"""Colour of the outlines of the members."""
_MAP_HEIGHT, _LINE_HEIGHT = 0.004, 0.008
"""Heights above the floor [m], different to avoid flicker."""
_AWAY, _ABOVE = 2.7, 1.3
"""Distances of the camera from the centre of the goals [m]: a whole bed and a robot are in view."""
_ASIDE = 1.75
"""Angle of the camera from the first base about the goals [rad]: the robot hides none of them."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Poses of all moving objects, and the visible arrows."""

    poses: Mapping[str, FloatArray]
    """Pose of each path in its parent: rotation and position, shape (3, 4)."""
    arrows: frozenset[Arrow]
    """The visible arrows, one for each goal."""


def place(scene: Scene, at: InitialConfiguration) -> None:
    """Set robot and environment of a scene to a configuration; the arm stays as it is."""
    for name, value in at.environment:
        scene.set_joint(name, value)
    scene.place_base(at.base_x, at.base_y, at.base_yaw)
    scene.set_torso(at.torso)


class SceneShapes:
    """The objects of one scene, whatever is shown of it."""

    def __init__(self, scene: Scene, task: Task, *, meshes: bool) -> None:
        """Read the objects of a scene.

        Args:
            scene: The scene, built with meshes if they are shown. Poses move it.
            task: Its task.
            meshes: Whether the robot is shown as its meshes, or as its collision shapes.
        """
        self.scene, self.task = scene, task
        # Moves the base; every pose sets it again.
        self._outline = base_outline(scene)
        self._robot = robot_shapes(scene, meshes)
        self._environment = _environment_shapes(scene)
        self._parked = scene.positions()

    def poses(
        self,
        at: InitialConfiguration,
        joints: ArrayLike | None,
        goal: int,
        arm: Sequence[str] = (),
    ) -> dict[str, FloatArray]:
        """Return the poses of all objects in their parents, shapes (3, 4).

        Args:
            at: Robot and environment.
            joints: The arm [rad], shape (7,); None for its rest posture.
            goal: The goal that is marked.
            arm: Names of the joints of another arm, if `joints` are of that.
        """
        scene = self.scene
        # An arm that was shown at a goal before is parked again.
        scene.restore(self._parked)
        place(scene, at)
        scene.set_arm(scene.resting_arm() if joints is None or arm else joints)
        if arm and joints is not None:
            scene.set_robot_joints(arm, joints)
        plant, context = scene.built.plant, scene.plant_context
        X_WB = scene.base_pose()
        poses = {ROBOT: X_WB}
        for body in {one.body for one in self._robot}:
            X_WL = plant.EvalBodyPoseInWorld(context, plant.get_body(body))
            poses[f"{ROBOT}/{int(body)}"] = X_WB.inverse() @ X_WL
        for body in {one.body for one in self._environment}:
            X_WL = plant.EvalBodyPoseInWorld(context, plant.get_body(body))
            poses[f"{ENVIRONMENT}/{int(body)}"] = X_WL
        goals = goal_poses(scene, self.task, None if joints is None else goal)
        poses |= {f"{GOALS}/{g}": X_WG for g, X_WG in enumerate(goals)}
        poses[SHOWN] = RigidTransform(goals[goal].translation())
        if scene.spec.environment.mount is not None:
            poses |= dict.fromkeys((FLOOR, MEMBERS), scene.mount_pose())
        return {path: X.GetAsMatrix34() for path, X in poses.items()}

    def draw(
        self,
        meshcat: Meshcat,
        arrows: Iterable[Arrow],
        members: Iterable[InitialConfiguration],
        *,
        compact: bool = False,
    ) -> None:
        """Add all objects to Meshcat, without poses.

        Args:
            meshcat: An empty Meshcat.
            arrows: The arrows that are shown at any time; all are hidden.
            members: Configurations whose base is outlined on the floor.
            compact: Whether meshes are sent as bare triangles, a fifth of the size of their files,
                which take seconds to read.
        """
        draw_ground(meshcat)
        for root, shapes in ((ROBOT, self._robot), (ENVIRONMENT, self._environment)):
            draw_shapes(meshcat, root, shapes, compact=compact)
        corners, faces = _arrow()
        for goal, reason in arrows:
            path = arrow_path((goal, reason))
            meshcat.SetTriangleMesh(path, corners, faces, rgba(REASON_COLOURS[reason]))
            meshcat.SetProperty(path, "visible", False)
        meshcat.SetObject(SHOWN, Sphere(_MARK_RADIUS), rgba(Category.CURRENT_GOAL.colour))
        places = list(members)
        for number, at in enumerate(places):
            self._draw_member(meshcat, number, at)
        goals = goal_poses(self.scene, self.task)
        base = (places[0].base_x, places[0].base_y) if places else None
        meshcat.SetCameraPose(*camera_pose(goals, base))

    def _draw_member(self, meshcat: Meshcat, number: int, at: InitialConfiguration) -> None:
        """Draw the outline and the heading of the base."""
        stand = BaseFootprint(at, self._outline)
        middle = np.array([at.base_x, at.base_y])
        ahead = 0.45 * np.array([np.cos(at.base_yaw), np.sin(at.base_yaw)])
        around = np.vstack([stand.polygon, stand.polygon[:1]])
        for name, line in (("outline", around), ("ahead", np.stack([middle, middle + ahead]))):
            points = np.column_stack([line, np.full(len(line), _LINE_HEIGHT)])
            meshcat.SetLine(f"{MEMBERS}/{number}/{name}", points.T, 4.0, rgba(MEMBER_COLOUR))


class SceneObjects(SceneShapes):
    """The objects of the scene of a score file."""

    def __init__(
        self,
        scene: Scene,
        task: Task,
        viewed: ViewedSet,
        *,
        meshes: bool,
        arms: Sequence[Sequence[str]] = (),
    ) -> None:
        """Read the objects of a scene.

        Args:
            scene: The scene of the file, built with meshes if they are shown. Snapshots move it.
            task: Its task.
            viewed: The scores and the set.
            meshes: Whether the robot is shown as its meshes, or as its collision shapes.
            arms: Names of the arm joints of each hand.
        """
        super().__init__(scene, task, meshes=meshes)
        self._viewed, self._arms = viewed, arms

    def snapshot(self, index: int, goal: int) -> Snapshot:
        """Return the poses at a configuration, with the arm at a goal if it is reached.

        Args:
            index: Flat index of the configuration.
            goal: The goal that is shown. If it is not reached, the arm is in its rest posture.
        """
        result = self._viewed.result(index)
        hand = self._viewed.hand(index, goal)
        poses = self.poses(
            result.configuration,
            self._viewed.joints(index, goal),
            goal,
            self._arms[hand] if hand else (),
        )
        return Snapshot(poses, frozenset(enumerate(result.reasons)))

    def set_up(self, meshcat: Meshcat, arrows: Iterable[Arrow], *, compact: bool = False) -> None:
        """Add all objects to Meshcat, without poses: see `draw`."""
        members = (self._viewed.configuration(index) for index in self._viewed.members)
        self.draw(meshcat, arrows, members, compact=compact)


def camera_pose(
    goals: Sequence[RigidTransform], base: tuple[float, float] | None
) -> tuple[FloatArray, FloatArray]:
    """Return where the camera is and what it looks at, so that person and goals are seen first [m].

    It looks at the goals from the side of the robot from which the tool comes, or where there is no
    robot, from there.

    Args:
        goals: Poses of the goals in W.
        base: Position of the first base [m]; None without one.
    """
    middle = np.mean([X.translation() for X in goals], axis=0)
    x, y, _ = -np.mean([X.rotation().matrix()[:, 0] for X in goals], axis=0)
    outwards = float(np.arctan2(y, x))
    around = outwards
    if base is not None:
        robot = float(np.arctan2(base[1] - middle[1], base[0] - middle[0]))
        around = max((robot - _ASIDE, robot + _ASIDE), key=lambda one: np.cos(one - outwards))
    away = np.array([_AWAY * np.cos(around), _AWAY * np.sin(around), _ABOVE])
    return middle + away, middle


def arrow_path(arrow: Arrow) -> str:
    """Return the path of an arrow."""
    goal, reason = arrow
    return f"{GOALS}/{goal}/{reason.name.lower()}"


def draw_floor(meshcat: Meshcat, floor: FloorMap, path: str = FLOOR) -> None:
    """Draw a score map on the floor, in place of an older one at that path."""
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


def _environment_shapes(scene: Scene) -> list[BodyShape]:
    inspector = scene.built.scene_graph.model_inspector()
    return [
        BodyShape(
            part.body,
            inspector.GetShape(part.geometry),
            inspector.GetPoseInFrame(part.geometry),
            rgba(category.colour),
            is_rounded=category is Category.PERSON,
        )
        for part, category in environment_parts(scene)
    ]


def _arrow() -> tuple[FloatArray, NDArray[np.int32]]:
    """Return corners and triangles of an arrow along x whose tip is at the origin.

    The tip is at the goal, and the arrow points along the x axis of the tool.
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

"""The teleoperated arm in Meshcat: robot, tool, target and path of the tool."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Box, Cylinder, Meshcat, Rgba, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import BodyIndex

from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec
from tcs.output.view.shapes import draw_ground, draw_shapes, rgba, robot_shapes
from tcs.teleop import Arm

FloatArray = NDArray[np.float64]
ROBOT, TARGET, TOOL, PATH, COURSE = "robot", "target", "tool", "path", "course"
"""Paths of the objects in Meshcat."""
_AXES = (Rgba(0.85, 0.1, 0.1, 1.0), Rgba(0.1, 0.65, 0.1, 1.0), Rgba(0.1, 0.25, 0.9, 1.0))
_TARGET_AXIS = (0.16, 0.006)
"""Length and width of the target's axes [m]: longer and thinner than those of the tool."""
_TOOL_AXIS = (0.09, 0.014)
_PATH_COLOUR = rgba("#e6550d")
_PATH_STEP = 0.002
"""Least distance between two points of the tool's path [m]."""
_POINTS, _PIECES = 40, 50
"""Points per piece of the path, and number of pieces kept: 4 m. Only the last piece is sent."""
_CAMERA, _LOOKED_AT = np.array([-0.7, -1.25, 0.65]), np.array([0.0, 0.0, -0.25])
"""Positions of the camera and of its target, relative to the midpoint of shoulder and tool [m]: the
robot's forward direction is to the right and away, and the arm is above the panel."""
_BESIDE = 0.02
"""Lateral position of the midpoint beyond which the camera is on the left [m]."""


class RobotDisplay:
    """A robot whose arm is teleoperated."""

    def __init__(self, arm: Arm, *, meshes: bool) -> None:
        """Build the robot.

        Args:
            arm: The arm.
            meshes: Whether the robot is shown with its meshes, where it has any.

        Raises:
            RobotError: If the robot's model cannot be used.
        """
        self._scene = Scene(SceneSpec(arm.robot, EMPTY_ENVIRONMENT), meshes=meshes)
        self._scene.set_torso(arm.torso_height)
        self._shapes = robot_shapes(self._scene, meshes)
        self._shoulder = arm.frames[0, :3, 3]
        bodies = {one.body for one in self._shapes}
        still = self._poses(bodies, np.zeros(len(arm.joints)))
        # Half a radian in every joint moves every body that the arm carries.
        moved = self._poses(bodies, np.full(len(arm.joints), 0.5))
        self._moving = {
            body for body in bodies if not still[body].IsNearlyEqualTo(moved[body], 1e-9)
        }
        self._still = {body: still[body] for body in bodies - self._moving}

    def set_up(
        self, meshcat: Meshcat, tool: FloatArray, *, target: bool = True, compact: bool = False
    ) -> None:
        """Add all objects to Meshcat.

        Args:
            meshcat: An empty Meshcat.
            tool: Initial position of the tool in the base frame [m], shape (3,).
            target: Whether to show a target; recorded runs contain none.
            compact: Whether meshes are sent as bare triangles.
        """
        draw_ground(meshcat)
        draw_shapes(meshcat, ROBOT, self._shapes, compact=compact)
        for body, X_WL in self._still.items():
            meshcat.SetTransform(_body(body), X_WL)
        triads = {TOOL: _TOOL_AXIS} | ({TARGET: _TARGET_AXIS} if target else {})
        for path, (length, width) in triads.items():
            for i, colour in enumerate(_AXES):
                size = np.full(3, width)
                size[i] = length
                meshcat.SetObject(f"{path}/{i}", Box(*size), colour)
                middle = np.zeros(3)
                middle[i] = 0.5 * length
                meshcat.SetTransform(f"{path}/{i}", RigidTransform(middle))
        middle = 0.5 * (self._shoulder + tool)
        side = -1.0 if middle[1] > _BESIDE else 1.0
        meshcat.SetCameraPose(middle + _CAMERA * [1.0, side, 1.0], middle + _LOOKED_AT)

    def poses(self, joints: FloatArray) -> Mapping[str, RigidTransform]:
        """Return the poses of all bodies that move with the arm, by path in Meshcat.

        Args:
            joints: Joint positions [rad], shape (7,).
        """
        found = self._poses(self._moving, joints)
        return {_body(body): X_WL for body, X_WL in found.items()}

    def contacts(self) -> tuple[str, str] | None:
        """Return two bodies of the robot in contact in the posture of the last poses, or None."""
        found = self._scene.violations()
        return found[0][:2] if found else None

    def _poses(self, bodies: set[BodyIndex], joints: FloatArray) -> dict[BodyIndex, RigidTransform]:
        self._scene.set_arm(joints)
        plant, context = self._scene.built.plant, self._scene.plant_context
        return {body: plant.EvalBodyPoseInWorld(context, plant.get_body(body)) for body in bodies}


def pose_of(R: FloatArray, p: FloatArray) -> RigidTransform:
    """Return a pose as a `RigidTransform`, with rounding errors of the rotation removed."""
    return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), p)


def _body(body: BodyIndex) -> str:
    return f"{ROBOT}/{int(body)}"


def draw_course(meshcat: Meshcat, start: FloatArray, end: FloatArray, radius: float) -> None:
    """Draw a line to follow as in the paper: magenta, from a green sphere to a red one.

    Args:
        meshcat: The Meshcat.
        start: Start of the line [m], shape (3,).
        end: End of the line [m], shape (3,).
        radius: Radius of the spheres [m]; a trial ends inside the red one.
    """
    along = np.asarray(end) - np.asarray(start)
    length = float(np.linalg.norm(along))
    for name, place, colour in (("start", start, "#2ca02c"), ("end", end, "#ff2020")):
        transparent = rgba(colour)
        transparent.update(a=0.5)
        meshcat.SetObject(f"{COURSE}/{name}", Sphere(radius), transparent)
        meshcat.SetTransform(f"{COURSE}/{name}", RigidTransform(place))
    meshcat.SetObject(f"{COURSE}/line", Cylinder(0.003, length), rgba("#ff00ff"))
    R = RotationMatrix.MakeFromOneVector(along / length, 2)
    meshcat.SetTransform(f"{COURSE}/line", RigidTransform(R, start + 0.5 * along))


class Trail:
    """The path of the tool in pieces, of which only the last one is sent again."""

    def __init__(self, meshcat: Meshcat) -> None:
        """Start with an empty path."""
        self._meshcat = meshcat
        self._pieces: deque[str] = deque()
        self._points: list[FloatArray] = []
        self._number = 0

    def add(self, point: FloatArray) -> None:
        """Append a point [m], shape (3,), if it is at least `_PATH_STEP` from the last one."""
        points = self._points
        if points and float(np.linalg.norm(point - points[-1])) < _PATH_STEP:
            return
        points.append(np.array(point))
        if len(points) < 2:
            return
        path = f"{PATH}/{self._number}"
        if not self._pieces or self._pieces[-1] != path:
            self._pieces.append(path)
        draw_path(self._meshcat, np.array(points), path)
        if len(points) >= _POINTS:
            self._points = [points[-1]]
            self._number += 1
        if len(self._pieces) > _PIECES:
            self._meshcat.Delete(self._pieces.popleft())

    def clear(self) -> None:
        """Delete the path."""
        self._meshcat.Delete(PATH)
        self._pieces.clear()
        self._points = []


def draw_path(meshcat: Meshcat, points: FloatArray, path: str = PATH) -> None:
    """Draw a path of the tool.

    Args:
        meshcat: The Meshcat.
        points: Points of the path [m], shape (n, 3), n >= 2.
        path: Path of the object in Meshcat.
    """
    meshcat.SetLine(path, np.asfortranarray(points.T), 3.0, _PATH_COLOUR)

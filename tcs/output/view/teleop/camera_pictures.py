"""Pictures of the head camera and of a camera on the wrist, rendered by Drake."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pydrake.common import MemoryFile
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    InMemoryMesh,
    MakeRenderEngineVtk,
    Mesh,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    Rgba,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.sensors import CameraInfo

from tcs.capability.head import head_names, load_head
from tcs.model.robots.urdf.meshes import mesh_triangles
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec
from tcs.output.view.shapes import BodyShape, robot_shapes
from tcs.teleop import Arm

FloatArray = NDArray[np.float64]
SIZE = (320, 240)
"""Width and height of a picture [pixels]."""
HEAD, OVERVIEW, WRIST = "head camera", "overview camera", "wrist camera"
_RENDERER = "vtk"
_HEAD_RANGE, _WRIST_RANGE = (0.3, 10.0), (0.1, 10.0)
"""Distances between which the cameras see [m]: parts of head and hand that enclose them are left
out."""
_FOV_DEG = 60.0
"""Vertical field of view of a camera without a file [deg]."""
_OVERVIEW = np.array([-0.55, 0.0, 0.75])
"""Position of the camera of a robot without a head, relative to the first joint [m]."""
_WRIST, _WRIST_AIM = np.array([-0.14, 0.0, 0.16]), np.array([0.1, 0.0, 0.0])
"""Positions of the wrist camera and of the point it looks at, in the tool frame [m]."""
_GROUND = Rgba(0.93, 0.93, 0.91, 1.0)


@dataclass(frozen=True, slots=True)
class CameraView:
    """A camera and where it looks."""

    name: str
    X_FC: RigidTransform
    """Its pose in its frame F, x to the right of the picture, y down, z ahead."""
    on_tool: bool
    """Whether F is the tool; else it is the world."""
    fov: float
    """Vertical field of view [rad]."""

    @property
    def distances(self) -> tuple[float, float]:
        """Least and greatest distance that it sees [m]."""
        return _WRIST_RANGE if self.on_tool else _HEAD_RANGE


def camera_views(arm: Arm, scene: Scene, tool: FloatArray) -> tuple[CameraView, CameraView]:
    """Return the camera of the head, or an overview where the robot has none, and of the wrist.

    The head is turned so that the tool is in the middle of its picture at the start, and stays.

    Args:
        arm: The arm.
        scene: A scene of its robot at the torso height of the arm.
        tool: Position of the tool at the start [m], shape (3,).

    Source:
        ITCM thesis, section III.B and Appendix I: the overview camera shows the task at the same
        place of the picture, fixed during a condition, and a second camera is on the wrist.
    """
    if arm.robot.name in head_names():
        head = load_head(arm.robot)
        frame = scene.built.plant.GetFrameByName(head.camera_frame)
        position = frame.CalcPoseInWorld(scene.plant_context).translation()
        first = CameraView(
            HEAD, look_at(position, tool), False, math.radians(head.vertical_fov_deg)
        )
    else:
        position = arm.frames[0, :3, 3] + _OVERVIEW
        first = CameraView(OVERVIEW, look_at(position, tool), False, math.radians(_FOV_DEG))
    wrist = CameraView(WRIST, look_at(_WRIST, _WRIST_AIM), True, math.radians(_FOV_DEG))
    return first, wrist


def look_at(position: FloatArray, point: FloatArray) -> RigidTransform:
    """Return the pose of a camera that looks at a point, with z of its frame up in the picture.

    Args:
        position: Position of the camera [m], shape (3,).
        point: The point, not straight above or below [m], shape (3,).
    """
    ahead = np.subtract(point, position)
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    R = np.column_stack([right, np.cross(ahead, right), ahead])
    return RigidTransform(RotationMatrix(R), position)


class CameraRenderer:
    """The robot before its cameras, without a display (EGL)."""

    def __init__(self, arm: Arm, joints: FloatArray) -> None:
        """Load the robot, which takes seconds.

        Args:
            arm: The arm.
            joints: Joint positions at the start [rad], shape (7,).

        Raises:
            RobotError: If the robot's model cannot be used.
            RuntimeError: If Drake finds no EGL.
        """
        self._arm = arm
        self._scene = Scene(SceneSpec(arm.robot, EMPTY_ENVIRONMENT), meshes=True)
        self._scene.set_torso(arm.torso_height)
        self._graph = SceneGraph()
        params = RenderEngineVtkParams(backend="EGL", default_clear_color=[0.78, 0.8, 0.86])
        self._graph.AddRenderer(_RENDERER, MakeRenderEngineVtk(params))
        self._source = self._graph.RegisterSource("robot")
        self._frames = self._add_robot(robot_shapes(self._scene, meshes=True))
        self._add_ground()
        self._context = self._graph.CreateDefaultContext()
        self.views = camera_views(arm, self._scene, arm.kinematics(joints).p)
        self._cameras = {view.name: _camera(view) for view in self.views}

    def pictures(self, joints: FloatArray) -> Mapping[str, bytes]:
        """Return the picture of each camera as JPEG, by name.

        Args:
            joints: Joint positions [rad], shape (7,).
        """
        self._scene.set_arm(joints)
        plant, poses = self._scene.built.plant, FramePoseVector()
        for body, frame in self._frames.items():
            X_WB = plant.EvalBodyPoseInWorld(self._scene.plant_context, plant.get_body(body))
            poses.set_value(frame, X_WB)
        port = self._graph.get_source_pose_port(self._source)
        port.FixValue(self._context, AbstractValue.Make(poses))
        query = self._graph.get_query_output_port().Eval(self._context)
        now = self._arm.kinematics(joints)
        X_WT = RigidTransform(RotationMatrix.ProjectToRotationMatrix(now.R), now.p)
        found = {}
        for view in self.views:
            X_WC = X_WT @ view.X_FC if view.on_tool else view.X_FC
            image = query.RenderColorImage(
                self._cameras[view.name], self._graph.world_frame_id(), X_WC
            )
            found[view.name] = _jpeg(image.data)
        return found

    def _add_robot(self, shapes: list[BodyShape]) -> dict[object, object]:
        """Add the shapes of the robot, and return the frame of each body."""
        frames: dict[object, object] = {}
        for number, one in enumerate(shapes):
            if one.body not in frames:
                frame = GeometryFrame(f"body {int(one.body)}")
                frames[one.body] = self._graph.RegisterFrame(self._source, frame)
            shape = _with_normals(one.shape) if isinstance(one.shape, Mesh) else one.shape
            geometry = GeometryInstance(one.X_LS, shape, f"shape {number}")
            geometry.set_perception_properties(_painted(one.colour))
            self._graph.RegisterGeometry(self._source, frames[one.body], geometry)
        return frames

    def _add_ground(self) -> None:
        ground = GeometryInstance(RigidTransform([0.0, 0.0, -0.006]), Box(6.0, 6.0, 0.01), "ground")
        ground.set_perception_properties(_painted(_GROUND))
        self._graph.RegisterAnchoredGeometry(self._source, ground)


def _painted(colour: Rgba) -> PerceptionProperties:
    properties = PerceptionProperties()
    properties.AddProperty("phong", "diffuse", colour)
    properties.AddProperty("label", "id", RenderLabel.kDontCare)
    return properties


def _with_normals(mesh: Mesh) -> Mesh:
    """Return a mesh with the normals of its triangles, which rendering needs and files may lack."""
    corners = mesh_triangles(Path(mesh.source().path()))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normals, axis=1)
    corners, normals = corners[size > 0.0], normals[size > 0.0] / size[size > 0.0, None]
    count = len(normals)
    numbers = np.arange(1, count + 1)
    faces = np.column_stack([3 * numbers - 2, numbers, 3 * numbers - 1, numbers, 3 * numbers])
    faces = np.column_stack([faces, numbers])
    # One format for all numbers is ten times as fast as one for each line.
    text = "v %.6g %.6g %.6g\n" * (3 * count) % tuple(corners.ravel().tolist())
    text += "vn %.4f %.4f %.4f\n" * count % tuple(normals.ravel().tolist())
    text += "f %d//%d %d//%d %d//%d\n" * count % tuple(faces.ravel().tolist())
    contents = text.encode()
    return Mesh(InMemoryMesh(mesh_file=MemoryFile(contents, ".obj", "mesh")), scale3=mesh.scale3())


def _camera(view: CameraView) -> ColorRenderCamera:
    core = RenderCameraCore(
        _RENDERER, CameraInfo(*SIZE, view.fov), ClippingRange(*view.distances), RigidTransform()
    )
    return ColorRenderCamera(core)


def _jpeg(pixels: NDArray[np.uint8]) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels[:, :, :3]).save(stream, "jpeg", quality=80)
    return stream.getvalue()

"""Head files: the camera of the operator and its directions of view."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import Field

from tcs.errors import RobotError, UnknownNameError
from tcs.files.documents import Document, FieldOfViewDeg, read_document
from tcs.files.paths import DataFiles
from tcs.kernel.arrays import FloatArray
from tcs.model.robots import RobotFile
from tcs.model.scene import Scene


class HeadFile(Document):
    """Content of a head file."""

    camera_frame: str = Field(min_length=1)
    """Frame of the URDF at the camera, x along its view with the head at zero."""
    pan_joint: str
    tilt_joint: str
    horizontal_fov_deg: FieldOfViewDeg
    vertical_fov_deg: FieldOfViewDeg
    source: str


@dataclass(frozen=True, slots=True)
class View:
    """Position of a head camera and its directions of view.

    Directions are relative to the camera with the head at zero; the translation of the camera by
    the head joints is neglected, as in the ITCM thesis, Appendix B.2.
    """

    p_BoCo_B: tuple[float, float, float]
    """Position of the camera in the base, at one torso height [m]."""
    yaw: tuple[float, float]
    """Lowest and highest yaw in view, left positive [rad]."""
    pitch: tuple[float, float]
    """Lowest and highest pitch in view, up positive [rad]."""


HEADS = DataFiles("head", "models/heads/*.yaml")


def head_names() -> tuple[str, ...]:
    """Return the names of the robots whose heads ship with `tcs`, sorted."""
    return HEADS.names()


def load_head(robot: RobotFile, head: str | Path | None = None) -> HeadFile:
    """Return the head of a robot.

    Args:
        robot: The robot.
        head: Name of a head that ships, or path of a head file; None is the robot's name.

    Raises:
        UnknownNameError: If no head of that name ships, or its file names an unknown key, link or
            joint.
        RobotError: If no head is named and none ships for the robot, or the file cannot be used.
    """
    names = HEADS.names()
    name = robot.name if head is None else head
    if head is None and robot.name not in names:
        raise RobotError(
            f"robot '{robot.name}': no head file ships for it, only for {', '.join(names)}. Name "
            "one of these or a head file of your own (--head), or make an ICM, which needs none "
            "(--type ICM)."
        )
    path = HEADS.path(name, where=f"robot '{robot.name}'")
    where = f"head file '{path}'"
    found = read_document(path, HeadFile, where, RobotError)
    model = robot.model()
    for noun, value, known in (
        ("link", found.camera_frame, model.links),
        ("joint", found.pan_joint, model.joints),
        ("joint", found.tilt_joint, model.joints),
    ):
        if value not in known:
            raise UnknownNameError(noun, value, known, where=where)
    return found


def head_view(scene: Scene, torso_height: float, head_file: str | Path | None = None) -> View:
    """Return the view of the head camera of the robot in a scene.

    Args:
        scene: The scene; its state is restored.
        torso_height: Height of the torso [m].
        head_file: Name or path of the head; None is the robot's name.

    Raises:
        UnknownNameError: If no head of that name ships.
        RobotError: If the head file cannot be used.

    Source:
        ITCM thesis eqs. (10) and (11): the hard limits of the joints, as there, plus half the field
        of view. The position is that of the URDF; eq. (16) prints that of a prototype, 0.17 m lower
        relative to the shoulder.
    """
    robot = scene.spec.robot
    head = load_head(robot, head_file)
    joints = robot.model().joints
    before = scene.positions()
    try:
        scene.set_torso(torso_height)
        p_BC, _ = _camera(scene, head, 0.0, 0.0)
        # The sign of each joint is read off the model, from a rotation of 0.1 rad.
        pan_sign = np.sign(_angles(_camera(scene, head, 0.1, 0.0)[1])[0])
        tilt_sign = np.sign(_angles(_camera(scene, head, 0.0, 0.1)[1])[1])
    finally:
        scene.restore(before)
    x, y, z = map(float, p_BC)
    return View(
        (x, y, z),
        _range(joints[head.pan_joint].hard, float(pan_sign), head.horizontal_fov_deg),
        _range(joints[head.tilt_joint].hard, float(tilt_sign), head.vertical_fov_deg),
    )


def _camera(scene: Scene, head: HeadFile, pan: float, tilt: float) -> tuple[FloatArray, FloatArray]:
    """Return position and view direction of the camera in B."""
    plant, state = scene.built.plant, scene.plant_context
    plant.GetJointByName(head.pan_joint).set_angle(state, pan)
    plant.GetJointByName(head.tilt_joint).set_angle(state, tilt)
    frame = plant.GetFrameByName(head.camera_frame)
    X_BC = frame.CalcPose(state, scene.built.base_frame)
    return np.array(X_BC.translation()), np.array(X_BC.rotation().matrix()[:, 0])


def _angles(direction: FloatArray) -> tuple[float, float]:
    x, y, z = direction
    return math.atan2(y, x), math.atan2(z, math.hypot(x, y))


def _range(limits: tuple[float, float], sign: float, fov_deg: float) -> tuple[float, float]:
    half = 0.5 * math.radians(fov_deg)
    low, high = sorted(sign * limit for limit in limits)
    return low - half, high + half

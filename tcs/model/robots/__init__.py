"""Robots: their files, their URDF, and the primitives that enclose their meshes."""

from __future__ import annotations

from tcs.model.robots.kinematic import kinematic_urdf, robot_urdf
from tcs.model.robots.meshes import as_obj
from tcs.model.robots.primitives import Primitive, read_primitives, union_volume, write_primitives
from tcs.model.robots.robot_file import RobotFile, joint_limits, load_robot, robot_names
from tcs.model.robots.urdf import Urdf, read_urdf

__all__ = [
    "Primitive",
    "RobotFile",
    "Urdf",
    "as_obj",
    "joint_limits",
    "kinematic_urdf",
    "load_robot",
    "read_primitives",
    "read_urdf",
    "robot_names",
    "robot_urdf",
    "union_volume",
    "write_primitives",
]

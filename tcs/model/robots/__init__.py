"""Robots: their files, their URDF, and the primitives that enclose their meshes.

In: a robot file (YAML), the URDF and meshes that it names, and its primitives (CSV). Out: a checked
`RobotFile` with limits, postures and primitives, the URDF as values, and the text that Drake reads.
"""

from __future__ import annotations

from tcs.model.robots.extras import robot_urdf
from tcs.model.robots.hands import BOTH, arm_references, beside, links_of_arm, robot_of_hand
from tcs.model.robots.held_tool import holding, load_robot, load_tool, tool_names
from tcs.model.robots.loading import robot_names
from tcs.model.robots.primitives import Primitive, read_primitives, union_volume, write_primitives
from tcs.model.robots.robot_file import LEAST_JERK, MOST_JERK, RobotFile, joint_limits
from tcs.model.robots.urdf import Urdf, read_urdf
from tcs.model.robots.urdf.kinematic import kinematic_urdf
from tcs.model.robots.urdf.meshes import as_obj

__all__ = [
    "BOTH",
    "LEAST_JERK",
    "MOST_JERK",
    "Primitive",
    "RobotFile",
    "Urdf",
    "arm_references",
    "as_obj",
    "beside",
    "holding",
    "joint_limits",
    "kinematic_urdf",
    "links_of_arm",
    "load_robot",
    "load_tool",
    "read_primitives",
    "read_urdf",
    "robot_names",
    "robot_of_hand",
    "robot_urdf",
    "tool_names",
    "union_volume",
    "write_primitives",
]

"""Tools that a robot holds: their shapes, and the frame that moves to the goals."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from tcs.errors import RobotError
from tcs.files.documents import Document, Entries, Placed, read_document
from tcs.files.paths import DataFiles
from tcs.model.robots.checks import check_robot
from tcs.model.robots.loading import ROBOTS
from tcs.model.robots.loading import load_robot as load_bare_robot
from tcs.model.robots.robot_file import BodyPrimitive, ExtraBody, ExtraFrame, Name, RobotFile

TOOLS = DataFiles("tool", "models/tools/*.yaml")
HELD = "+"
"""Separates robot and tool in the name of a robot that holds one, e.g. "pr2+spoon"."""


class ToolFile(Document):
    """Content of a tool file; its frame at the origin lies in the tool frame of the robot."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
    title: str
    source: str
    tip: Placed
    """The frame that moves to the goals, x forward out of the tool."""
    grip: Placed = Placed()
    """Pose of the tool in the tool frame of the robot."""
    gripper: Name | None = None
    """Name of the gripper opening while it is held; None leaves that of the robot file."""
    shapes: Annotated[tuple[BodyPrimitive, ...], Entries, Field(min_length=1)]
    """Shapes that enclose the tool, in its own frame."""


def tool_names() -> tuple[str, ...]:
    """Return the names of the tools that ship with `tcs`, sorted."""
    return TOOLS.names()


def load_tool(name_or_path: str | Path) -> ToolFile:
    """Return a tool.

    Args:
        name_or_path: One of `tool_names()`, or the path of a file: a text that ends in `.yaml` or
            contains a path separator.

    Raises:
        UnknownNameError: If no tool has that name, or a key in the file is unknown.
        RobotError: If the file cannot be read or its content is invalid.
    """
    path = TOOLS.path(name_or_path)
    return read_document(path, ToolFile, f"tool file '{path}'", RobotError)


def holding(robot: str | Path, tool: str | Path) -> str:
    """Return the name under which `load_robot` loads a robot with a tool in its hand.

    Args:
        robot: Name of a robot, or path of its file.
        tool: Name of a tool, or path of its file.

    Raises:
        UnknownNameError: If there is no such robot or tool.
    """
    parts = []
    for files, given in ((ROBOTS, robot), (TOOLS, tool)):
        path = files.path(given)
        parts.append(str(given) if str(given) in files.shipped() else str(path.absolute()))
    return HELD.join(parts)


def load_robot(name_or_path: str | Path) -> RobotFile:
    """Return a robot, checked against its URDF; the paths in it are absolute.

    Args:
        name_or_path: One of `robot_names()`, or the path of a file: a text that ends in `.yaml` or
            contains a path separator. "ROBOT+TOOL" is a robot that holds a tool: both are names or
            paths.

    Raises:
        UnknownNameError: If no robot or tool has that name, or the file names something unknown.
        RobotError: If a file, or a model it names, cannot be used.
    """
    robot, plus, tool = str(name_or_path).rpartition(HELD)
    if not plus or not robot or Path(name_or_path).is_file():
        return load_bare_robot(name_or_path)
    held = with_tool(load_bare_robot(robot), load_tool(tool), name=holding(robot, tool))
    check_robot(held, where=f"robot '{robot}' with tool '{tool}'")
    return held


def with_tool(robot: RobotFile, tool: ToolFile, *, name: str) -> RobotFile:
    """Return a robot with a tool in its hand, whose tip is the tool frame.

    Args:
        robot: The robot.
        tool: The tool.
        name: Name of the robot that holds it.

    Raises:
        UnknownNameError: If the robot has no gripper opening of the tool's name for it.
    """
    if tool.gripper is not None:
        robot = robot.with_choices(gripper=tool.gripper)
    body = ExtraBody(
        name=tool.name,
        parent=robot.tool_frame,
        xyz=tool.grip.xyz,
        rpy_deg=tool.grip.rpy_deg,
        primitives=tool.shapes,
    )
    tip = ExtraFrame(
        name=f"{tool.name}_tip", parent=tool.name, xyz=tool.tip.xyz, rpy_deg=tool.tip.rpy_deg
    )
    return robot.model_copy(
        update={
            "name": name,
            "title": f"{robot.title}, with {tool.title}",
            "bodies": (*robot.bodies, body),
            "frames": (*robot.frames, tip),
            "tool_frame": tip.name,
            # The robot files of the arms hold nothing.
            "arms": {},
        }
    )

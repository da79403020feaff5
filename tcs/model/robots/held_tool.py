"""Tools that a robot holds: their shapes, and the frame that moves to the goals."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from tcs.errors import RobotError
from tcs.files.documents import Document, Entries, Placed, read_document
from tcs.files.paths import DataFiles, expanded
from tcs.model.robots.loading import ROBOTS, check_robot
from tcs.model.robots.loading import load_robot as load_bare_robot
from tcs.model.robots.robot_file import BodyPrimitive, ExtraBody, ExtraFrame, Name, RobotFile

TOOLS = DataFiles("tool", "models/tools/*.yaml")
HELD = "+"
"""Separates robot and tool in the name of a robot that holds one, e.g. "pr2+spoon"."""


class ToolMesh(Placed):
    """The mesh of a tool, and its pose in the tool's frame."""

    file: str
    """An OBJ, STL or glTF file; its path from the folder of the tool file."""
    scale: Annotated[float, Field(gt=0.0, le=1000.0)] = 1.0
    """Metres per unit of the file."""
    protrusion: Annotated[float, Field(ge=0.001, le=0.05)] = 0.003
    """Distance by which the shapes around it may protrude [m]."""


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
    shapes: Annotated[tuple[BodyPrimitive, ...], Entries] = ()
    """Shapes that enclose the tool, in its own frame, with those around its mesh."""
    mesh: ToolMesh | None = None
    """A closed mesh to enclose, in its own frame."""

    @model_validator(mode="after")
    def _has_a_volume(self) -> Self:
        if not self.shapes and self.mesh is None:
            raise ValueError("give 'shapes' or 'mesh', or both")
        return self


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
    where = f"tool file '{path}'"
    tool = read_document(path, ToolFile, where, RobotError)
    if tool.mesh is None:
        return tool
    shapes = (*tool.shapes, *_around(tool.mesh, path.parent, where))
    return tool.model_copy(update={"shapes": shapes, "mesh": None})


def _around(mesh: ToolMesh, folder: Path, where: str) -> list[BodyPrimitive]:
    """Return the shapes around a mesh, in the tool's frame.

    Raises:
        RobotError: If the file cannot be used.
    """
    # Imported where they are needed: they are slow to import, and few tools have a mesh.
    from scipy.spatial.transform import Rotation

    from tcs.model.robots.mesh_shapes import shapes_around_mesh

    file = folder / expanded(mesh.file, f"{where}, field 'mesh.file'", RobotError)
    here = f"{where}, field 'mesh'"
    placed = Rotation.from_euler("xyz", mesh.rpy)
    found = []
    for shape in shapes_around_mesh(file, mesh.scale, mesh.protrusion, here, RobotError):
        turned = placed * Rotation.from_quat(shape.quaternion, scalar_first=True)
        x, y, z = (placed.apply(shape.xyz) + mesh.xyz).tolist()
        roll, pitch, yaw = turned.as_euler("xyz", True, suppress_warnings=True).tolist()
        found.append(
            BodyPrimitive(
                kind=shape.kind, size=shape.size, xyz=(x, y, z), rpy_deg=(roll, pitch, yaw)
            )
        )
    return found


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


def held_parts(name_or_path: str | Path) -> tuple[str | Path, str]:
    """Return the references of a robot and of the tool that it holds, "" for none."""
    robot, plus, tool = str(name_or_path).rpartition(HELD)
    if not plus or not robot or Path(name_or_path).is_file():
        return name_or_path, ""
    return robot, tool


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
    robot, tool = held_parts(name_or_path)
    if not tool:
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

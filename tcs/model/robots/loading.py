"""Load robot files: those that ship, those of the user, and what a file is based on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tcs.errors import RobotError
from tcs.files.documents import checked, read_mapping
from tcs.files.paths import named_file, shipped_files
from tcs.model.robots.checks import check_robot
from tcs.model.robots.robot_file import RobotFile

_FILES = ("urdf", "primitives")
"""Fields that name a file, relative to the robot file."""
BASED_ON = "based_on"
"""Key of a file that takes over whatever it does not say itself from another robot."""


def robot_names() -> tuple[str, ...]:
    """Return the names of the robots that ship with `tcs`, sorted."""
    return tuple(_shipped())


def load_robot(name_or_path: str | Path) -> RobotFile:
    """Return a robot, checked against its URDF, the files it names as absolute paths.

    Args:
        name_or_path: One of `robot_names()`, or the path of a file: anything that ends in `.yaml`
            or holds a path separator.

    Raises:
        UnknownNameError: If there is no robot of that name, or the file names something unknown.
        RobotError: If the file, or a model it names, cannot be used.
    """
    path = named_file("robot", name_or_path, _shipped()).resolve()
    where = f"robot file '{path}'"
    content = _content(path)
    robot = checked(content, RobotFile, where, RobotError, also_known=(BASED_ON,))
    check_robot(robot, where=where)
    return robot


def _content(path: Path, above: tuple[Path, ...] = ()) -> dict[str, Any]:
    """Return what a file says, with what it takes over; `above` are the files based on it."""
    where = f"robot file '{path}'"
    content = read_mapping(path, where, RobotError, known=(*RobotFile.model_fields, BASED_ON))
    for key in _FILES:
        value = content.get(key)
        if isinstance(value, str) and not value.startswith("package://"):
            content[key] = str((path.parent / Path(value).expanduser()).resolve())
    base = content.pop(BASED_ON, None)
    if base is None:
        return content
    chain = (*above, path)
    field = f"{where}, field '{BASED_ON}'"
    file = named_file("robot", str(base), _shipped(), beside=path.parent, where=field).resolve()
    if file in chain:
        raise RobotError(f"{field}: '{base}' is based on this file in turn. Name another one.")
    return {**_content(file, chain), **content}


def _shipped() -> dict[str, Path]:
    return shipped_files("models/robots/*.yaml")

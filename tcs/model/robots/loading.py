"""Load robot files, shipped or by the user, each merged over the file that it is based on."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from tcs.errors import RobotError
from tcs.files.documents import checked, read_mapping
from tcs.files.paths import DataFiles, expanded, is_path
from tcs.model.robots.checks import check_robot
from tcs.model.robots.robot_file import RobotFile

ROBOTS = DataFiles("robot", "models/robots/*.yaml")
BASED_ON = "based_on"
"""Key that names another robot file, which supplies the fields that this file lacks."""
_PATH_FIELDS = ("urdf", "primitives", "distances")
"""Fields with a path relative to the robot file."""


def robot_names() -> tuple[str, ...]:
    """Return the names of the robots that ship with `tcs`, sorted."""
    return ROBOTS.names()


def load_robot(name_or_path: str | Path) -> RobotFile:
    """Return a robot, checked against its URDF; the paths in it are absolute.

    Args:
        name_or_path: One of `robot_names()`, or the path of a file: a text that ends in `.yaml` or
            contains a path separator.

    Raises:
        UnknownNameError: If no robot has that name, or the file names something unknown.
        RobotError: If the file, or a model it names, cannot be used.
    """
    path = ROBOTS.path(name_or_path)
    where = f"robot file '{path}'"
    robot = checked(_content(path), RobotFile, where, RobotError, also_known=(BASED_ON,))
    check_robot(robot, where=where)
    return robot


def _content(path: Path, based_on_it: tuple[Path, ...] = ()) -> dict[str, Any]:
    """Return the fields of a file, merged over those of the file that it is based on.

    Args:
        path: The file.
        based_on_it: Files that are based on this one, resolved.
    """
    where = f"robot file '{path}'"
    content = read_mapping(path, where, RobotError, known=(*RobotFile.model_fields, BASED_ON))
    file = Path(os.path.realpath(path))
    for key in _PATH_FIELDS:
        value = content.get(key)
        if isinstance(value, str) and not value.startswith("package://"):
            own = expanded(value, f"{where}, field '{key}'", RobotError)
            content[key] = os.path.realpath(file.parent / own)
    if isinstance(content.get("packages"), list):
        content["packages"] = [
            os.path.realpath(
                file.parent / expanded(folder, f"{where}, field 'packages'", RobotError)
            )
            if isinstance(folder, str)
            else folder
            for folder in content["packages"]
        ]
    if isinstance(content.get("arms"), dict):
        content["arms"] = {
            arm: os.path.realpath(file.parent / name)
            if isinstance(name, str) and is_path(name)
            else name
            for arm, name in content["arms"].items()
        }
    base = content.pop(BASED_ON, None)
    if base is None:
        return content
    chain = (*based_on_it, file)
    field = f"{where}, field '{BASED_ON}'"
    base_file = ROBOTS.path(str(base), beside=path.parent, where=field)
    if Path(os.path.realpath(base_file)) in chain:
        raise RobotError(f"{field}: '{base}' is based on this file in turn. Name another one.")
    return {**_content(base_file, chain), **content}

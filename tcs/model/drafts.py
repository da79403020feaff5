"""Drafts of files of one's own: an environment and a task, to be completed in an editor."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tcs.errors import OutputError
from tcs.files.writing import check_writable, whole_file
from tcs.model.scene import load_environment

_ENVIRONMENT = """\
# {title}, with a table. Every key that is not given here is that of '{based_on}'.
# Check it with: tcs check {file}
based_on: {based_on}
name: {name}
title: {title}, with a table
# Boxes by their full sizes [m], placed by their centres in the environment frame [m]; rpy_deg
# turns them.
obstacles:
  - {{name: table, box: [0.6, 1.2, 0.04], xyz: [1.2, 0, 0.72]}}
"""

_TASK = """\
# A task of your own. Check it with: tcs check {file}
name: {name}
title: {title}
source: who measured or chose the goals, and how
environments: [{environment}]
# What serves as well as the exact pose, in the tool frame at the goal: here any rotation about x,
# out of the fingers, and a tilt of x by up to 20 degrees. Leave it out for exact poses.
free:
  rotation_about: [1, 0, 0]
  cone: {{axis: [1, 0, 0], half_angle_deg: 20}}
# Poses of the tool in a body frame: x points forward out of the fingers, here at the body.
# Body frames: {frames}
goals:
  - name: first place
    body_frame: {frame}
    position: [0.2, 0, 0]
    quaternion_wxyz: [0, 0, 0, 1]
    weight: 1
"""


def draft_environment(path: Path, based_on: str | Path) -> dict[str, Any]:
    """Write the draft of an environment file: another one, with a table.

    Args:
        path: File to write.
        based_on: Name of an environment, or path of its file.

    Returns:
        The file, and what it is based on, as plain containers.

    Raises:
        UnknownNameError: If there is no such environment.
        DataFileError: If its file cannot be used.
        OutputError: If the file exists or cannot be written.
    """
    given = load_environment(based_on)
    text = _ENVIRONMENT.format(based_on=based_on, name=path.stem, title=given.title, file=path.name)
    return _written(path, text, {"based_on": str(based_on)})


def draft_task(path: Path, environment: str | Path) -> dict[str, Any]:
    """Write the draft of a task file: one goal on the body of the person of an environment.

    Args:
        path: File to write.
        environment: Name of an environment, or path of its file.

    Returns:
        The file, and the environment, as plain containers.

    Raises:
        UnknownNameError: If there is no such environment.
        DataFileError: If its file cannot be used.
        OutputError: If the file exists or cannot be written.
    """
    given = load_environment(environment)
    frames = list(given.body_frames)
    text = _TASK.format(
        name=path.stem,
        title=path.stem.replace("_", " ").capitalize(),
        environment=given.name,
        frames=", ".join(frames),
        frame=next((name for name in frames if name == "head"), frames[0] if frames else "head"),
        file=path.name,
    )
    return _written(path, text, {"environment": given.name})


def _written(path: Path, text: str, about: dict[str, Any]) -> dict[str, Any]:
    """Write a draft to a new file."""
    if path.exists():
        raise OutputError(f"'{path}' exists, and would be replaced. Name a new file.")
    check_writable(path)
    with whole_file(path, "Draft") as file:
        file.write(text.encode())
    return {"file": str(path), **about}

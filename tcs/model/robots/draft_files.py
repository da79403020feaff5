"""Write a drafted robot file and its primitives."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from tcs.errors import OutputError
from tcs.files.writing import check_writable, whole_file
from tcs.model.robots.draft import USUAL, Draft, DraftOptions, draft_robot
from tcs.model.robots.primitives import write_primitives

_HEADER = """\
# Drafted by `tcs robot new`; review these choices:
{remarks}
"""


def write_draft(draft: Draft, path: Path) -> Path:
    """Write a draft as a YAML file with its primitives in a CSV file beside it; both or neither.

    Args:
        draft: The draft.
        path: The YAML file; it must not exist yet.

    Returns:
        Path of the CSV file.

    Raises:
        OutputError: If one of the files exists or cannot be written.
    """
    shapes = check_free(path)
    content = draft.robot.model_dump(mode="json", exclude_defaults=True)
    content["primitives"] = shapes.name
    if not draft.robot.urdf.startswith("package://"):
        # Relative, so that the folder of both files can be moved.
        content["urdf"] = Path(
            os.path.relpath(draft.robot.urdf, os.path.dirname(os.path.realpath(path)))
        ).as_posix()
    if draft.robot.packages:
        content["packages"] = [
            Path(os.path.relpath(folder, os.path.dirname(os.path.realpath(path)))).as_posix()
            for folder in draft.robot.packages
        ]
    text = _HEADER.format(remarks="\n".join(f"# - {remark}" for remark in draft.remarks))
    text += yaml.safe_dump(
        content, sort_keys=False, width=95, default_flow_style=None, allow_unicode=True
    )
    write_primitives(shapes, draft.primitives)
    try:
        with whole_file(path, "Robot file") as stream:
            stream.write(text.encode())
    except BaseException:
        shapes.unlink()
        raise
    return shapes


def draft_to_files(
    urdf: str | Path,
    tool: str,
    path: Path,
    options: DraftOptions = USUAL,
    *,
    on_progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Draft a robot file, write it with its primitives, and return a summary as plain containers.

    Args:
        urdf: Path of the URDF, or its `package://` address.
        tool: T, the link that moves to the goals.
        path: The YAML file; it must not exist yet. Its stem is the name of the robot.
        options: Arm, and closeness of the primitives.
        on_progress: Called with the number of steps done and of all.

    Raises:
        OutputError: If one of the files exists or cannot be written.
        UnknownNameError: As `draft_robot`.
        RobotError: As `draft_robot`.
    """
    check_writable(check_free(path))
    draft = draft_robot(urdf, tool, options, name=path.stem, on_progress=on_progress)
    shapes = write_draft(draft, path)
    robot = draft.robot
    return {
        "file": str(path),
        "primitives": str(shapes),
        "arm_base": robot.arm_base,
        "arm_joints": list(robot.arm_joints),
        "torso_joint": robot.torso_joint,
        "tool_frame": robot.tool_frame,
        "disabled_pairs": len(robot.disabled_pairs),
        "remarks": list(draft.remarks),
    }


def check_free(path: Path) -> Path:
    """Return the path of the CSV file for a YAML file, if neither of them exists.

    Raises:
        OutputError: If one exists, or the name of the YAML file does not end in `.yaml`.
    """
    if path.suffix != ".yaml":
        raise OutputError(
            f"robot file '{path}': its name must end in .yaml, which distinguishes a path from the "
            "name of a robot."
        )
    shapes = path.with_name(f"{path.stem}_primitives.csv")
    for file in (path, shapes):
        if os.path.lexists(file):
            raise OutputError(f"'{file}' already exists. Remove it, or name another file.")
    return shapes

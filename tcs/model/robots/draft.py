"""Draft a robot file from a URDF: arm, torso, posture, primitives and disabled pairs."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tcs.errors import OutputError, RobotError, UnknownNameError
from tcs.files.writing import check_writable, scratch_folder, whole_file
from tcs.files.xml_documents import read_xml
from tcs.model.robots.checks import check_robot
from tcs.model.robots.fitting import fit_robot
from tcs.model.robots.primitives import Primitive, write_primitives
from tcs.model.robots.robot_file import LEAST_JOINTS, MOST_JOINTS, RobotFile
from tcs.model.robots.self_collision import (
    DRAWS,
    blocked_at_boxes,
    blocked_by_shapes,
    free_posture,
    propose_disabled_pairs,
)
from tcs.model.robots.urdf import Joint, Urdf, read_urdf
from tcs.model.robots.urdf.packages import resolve_uri
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import body_triangles

_VERTICAL = 0.99
"""Cosine to the vertical above which a prismatic joint counts as torso joint."""
_ON_FLOOR = 0.02
"""Bodies that reach down to this height [m] stand on the floor."""

_HEADER = """\
# Drafted by `tcs robot new`; review these choices:
{remarks}
"""


@dataclass(frozen=True, slots=True)
class Draft:
    """A robot file drafted from a URDF, to be reviewed by the user.

    Attributes:
        robot: Content of the file; its URDF is an absolute path or a `package://` address.
        primitives: The collision primitives.
        remarks: The choices made, one line each.
    """

    robot: RobotFile
    primitives: tuple[Primitive, ...]
    remarks: tuple[str, ...]


def draft_robot(
    urdf: str | Path,
    tool: str,
    *,
    base: str | None = None,
    name: str | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> Draft:
    """Return a robot file for a URDF.

    The arm consists of the seven revolute joints nearest the tool, or of six if only six in a row
    lead there. The torso is a vertical
    prismatic joint between root and arm. Every other joint is at 0 if its range includes values on
    both sides of 0, else in the middle of its range. `fit_robot` gives the primitives and
    `propose_disabled_pairs` the pairs that need no check.

    Args:
        urdf: Path of the URDF, or its `package://` address.
        tool: T, the link that moves to the goals.
        base: Link at or beyond which the arm starts; None is the root.
        name: Name of the robot; None is the file name of the URDF.
        on_progress: Called with the number of bodies fitted and of all bodies.

    Raises:
        UnknownNameError: If tool or base is not a link of the URDF.
        RobotError: If the URDF or a mesh cannot be used, the base does not carry the tool, or fewer
            than six revolute joints lead to it.
    """
    path = Path(os.path.realpath(resolve_uri(str(urdf), Path())))
    model = read_urdf(path)
    arm, arm_base, torso = _arm(model, tool, base)
    if not body_triangles(model):
        raise RobotError(
            f"URDF '{path}': no link has a visual or collision geometry, so there is nothing to "
            "check for collisions. Add geometry to its links."
        )
    address = str(urdf) if str(urdf).startswith("package://") else str(path)
    posture, gripper = _positions(model, arm, torso)
    remarks = [
        f"arm: the {len(arm)} revolute joints nearest '{tool}', from '{arm_base}' on: "
        f"{', '.join(joint.name for joint in arm)}",
        f"torso: {f'{torso.name!r}' if torso else 'no vertical prismatic joint below the arm'}",
    ]
    # The search for disabled pairs reads the primitives from their file.
    with scratch_folder() as folder:
        shapes = folder / "primitives.csv"
        write_primitives(shapes, ())
        robot = RobotFile(
            name=name or path.stem,
            title=f"{path.stem}, tool {tool}",
            urdf=address,
            root_body=model.root,
            arm_base=arm_base,
            arm_joints=tuple(joint.name for joint in arm),
            tool_frame=tool,
            torso_joint=torso.name if torso else None,
            limits="soft" if any(joint.soft != joint.hard for joint in arm) else "hard",
            posture="drafted" if posture else None,
            postures={"drafted": posture} if posture else {},
            gripper="drafted" if gripper else None,
            grippers={"drafted": gripper} if gripper else {},
            standing_bodies=_standing(model, posture, arm, torso),
            primitives=str(shapes),
            source=_source(path, address),
        )
        check_robot(robot, where=f"robot drafted from '{path}'")
        fits = fit_robot(robot, on_progress)
        primitives = tuple(shape for found in fits for shape in found.fit.primitives)
        write_primitives(shapes, primitives)
        robot = robot.model_copy(update={"disabled_groups": propose_disabled_pairs(robot)})
        rest = free_posture(robot)
        if rest is None:
            remarks.append(f"rest: all of {DRAWS} postures of the arm are in self-collision")
        robot = robot.model_copy(update={"rest": rest or {}})
        blocked, at_boxes = blocked_by_shapes(robot), blocked_at_boxes(robot)
    worst = max(fits, key=lambda found: found.fit.excess)
    remarks += [
        f"primitives: {len(primitives)}; those of '{worst.body}' exceed its hull most, "
        f"{worst.fit.excess:.2f} times",
        f"self-collision: {blocked.text()}",
        f"obstacles: {at_boxes.text()}",
        "posture: 0 if the range of a joint includes both signs, else the middle of its range; "
        "check that the gripper is open and a second arm out of the way",
        f"root: '{model.root}' must be on the floor, z up, x forward",
    ]
    return Draft(robot=robot, primitives=primitives, remarks=tuple(remarks))


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
    *,
    base: str | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Draft a robot file, write it with its primitives, and return a summary as plain containers.

    Args:
        urdf: Path of the URDF, or its `package://` address.
        tool: T, the link that moves to the goals.
        path: The YAML file; it must not exist yet. Its stem is the name of the robot.
        base: Link at or beyond which the arm starts; None is the root.
        on_progress: Called with the number of bodies fitted and of all bodies.

    Raises:
        OutputError: If one of the files exists or cannot be written.
        UnknownNameError: As `draft_robot`.
        RobotError: As `draft_robot`.
    """
    check_writable(check_free(path))
    draft = draft_robot(urdf, tool, base=base, name=path.stem, on_progress=on_progress)
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


def _arm(model: Urdf, tool: str, base: str | None) -> tuple[list[Joint], str, Joint | None]:
    """Return the joints of the arm, the link that carries the first one, and the torso joint."""
    where = f"URDF '{model.path}'"
    for what, link in (("tool frame", tool), ("base", base)):
        if link is not None and link not in model.links:
            raise UnknownNameError("link", link, model.links, where=f"{where}, {what}")
    chain = model.chain(base or model.root, tool)
    if chain is None:
        raise RobotError(f"{where}: base '{base}' does not carry tool frame '{tool}'.")
    movable = [joint for joint in chain if joint.is_movable]
    arm: list[Joint] = []
    end = ""
    for joint in reversed(movable):
        if joint.type == "prismatic" or joint.mimic is not None:
            obstacle = "mimics another" if joint.mimic else "is prismatic"
            end = f"; '{joint.name}' before them {obstacle}"
        if end or len(arm) == MOST_JOINTS:
            break
        arm.insert(0, joint)
    if len(arm) < LEAST_JOINTS:
        found = ", ".join(joint.name for joint in arm) or "none"
        raise RobotError(
            f"{where}: an arm of six or seven revolute joints is needed, but from "
            f"'{base or model.root}' to tool frame '{tool}' only {len(arm)} in a row lead there "
            f"({found}{end}). Name another tool frame or base."
        )
    exact = base is not None and movable == arm
    arm_base = str(base) if exact else arm[0].parent
    return arm, arm_base, _torso(model, arm[0].parent)


def _torso(model: Urdf, arm_base: str) -> Joint | None:
    """Return the vertical prismatic joint of the greatest travel between root and arm, if any."""
    vertical = []
    for joint in model.chain(model.root, arm_base) or ():
        if joint.type != "prismatic" or joint.mimic is not None:
            continue
        R, _ = pose_in_root(model, joint.child, {})
        axis = R @ np.array(joint.axis) / np.linalg.norm(joint.axis)
        if axis[2] > _VERTICAL:
            vertical.append(joint)
    return max(vertical, key=lambda joint: joint.soft[1] - joint.soft[0], default=None)


def _positions(
    model: Urdf, arm: list[Joint], torso: Joint | None
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the positions of the other joints, and of those in the hand [rad or m]."""
    held = model.links_moved_by(arm[-1].name)
    posture: dict[str, float] = {}
    gripper: dict[str, float] = {}
    for joint in model.joints.values():
        scored = joint in arm or joint == torso
        if not joint.is_movable or joint.mimic is not None or scored:
            continue
        lower, upper = joint.soft
        value = 0.0 if lower < 0.0 < upper else round((lower + upper) / 2, 6)
        (gripper if joint.child in held else posture)[joint.name] = value
    return posture, gripper


def _standing(
    model: Urdf, posture: dict[str, float], arm: list[Joint], torso: Joint | None
) -> tuple[str, ...]:
    """Return the bodies that reach down to the floor and that neither arm nor torso moves."""
    first = [joint.name for joint in (arm[0], torso) if joint is not None]
    moved = frozenset[str]().union(*map(model.links_moved_by, first))
    found = []
    for body, triangles in body_triangles(model).items():
        R, p = pose_in_root(model, body, posture)
        if body not in moved and (triangles @ R.T + p)[..., 2].min() <= _ON_FLOOR:
            found.append(body)
    return tuple(found)


def _source(path: Path, address: str) -> str:
    """Return the source of the numbers, and what is known about their licence."""
    licence = "no package.xml in a folder above it: look up its licence before passing it on"
    for folder in path.parents:
        package = folder / "package.xml"
        if os.path.isfile(package):
            licence = f"its package is licensed {_licence(package)}; its meshes may not be"
            break
    shown = path.name if address == str(path) else address
    figures = f"Kinematics, limits and meshes: {shown}; {licence}. No mesh is copied."
    return f"{figures} Primitives: fitted to the meshes by `tcs robot new`."


def _licence(package: Path) -> str:
    try:
        found = read_xml(package, f"package '{package}'", RobotError).findtext("license")
    except RobotError:
        found = None
    return f"'{' '.join(found.split())}'" if found else "in terms its package.xml does not name"

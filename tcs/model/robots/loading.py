"""Load robot files, shipped or by the user, each merged over the file that it is based on."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from tcs.errors import RobotError, UnknownNameError
from tcs.files.documents import checked, read_mapping
from tcs.files.paths import DataFiles, expanded, is_path
from tcs.model.robots.primitives import Primitive
from tcs.model.robots.robot_file import REST, RobotFile
from tcs.model.robots.urdf import WORLD, Joint, Urdf
from tcs.model.robots.urdf.model import DRIVE

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


def check_robot(robot: RobotFile, where: str) -> None:
    """Raise an error if a robot file contradicts its URDF.

    Args:
        robot: The robot.
        where: Name of the file in messages.

    Raises:
        UnknownNameError: If the file names an unknown link, joint or frame.
        RobotError: If the URDF or the primitives cannot be used, the arm is not a chain of
            revolute and prismatic joints from its base to the tool, a posture exceeds the hard
            limits, or an extra frame or body has the name of a link.
    """
    try:
        model = robot.model()
    except RobotError as error:
        raise RobotError(f"{where}, field 'urdf': {error}") from None
    links = _all_links(robot, model, where)
    _check_links(robot, links, model, where)
    _check_arm(robot, model, where)
    if robot.torso_joint is not None:
        torso = model.joint(robot.torso_joint, f"{where}, field 'torso_joint'")
        if torso.type != "prismatic":
            raise RobotError(
                f"{where}, field 'torso_joint': '{torso.name}' is {torso.type}, but must be "
                "prismatic."
            )
    _check_ranges(robot, model, where)
    _check_rest(robot, model, where)
    _check_rates(robot, where)
    for field, choices in (("postures", robot.postures), ("grippers", robot.grippers)):
        for name, positions in choices.items():
            _check_positions(robot, model, positions, f"{where}, field '{field}.{name}'")


def _all_links(robot: RobotFile, model: Urdf, where: str) -> Mapping[str, str]:
    """Return the parent of every link, extra frame and extra body."""
    parents = {link: "" for link in model.links}
    parents |= {joint.child: joint.parent for joint in model.joints.values()}
    extras = (*robot.frames, *robot.bodies)
    for extra in extras:
        if extra.name in (*parents, WORLD):
            raise RobotError(
                f"{where}, frame or body '{extra.name}': the name is taken. Choose another."
            )
        parents[extra.name] = extra.parent
    for extra in extras:
        at = f"{where}, frame or body '{extra.name}', parent"
        _check_known(extra.parent, parents, at)
    for extra in extras:
        # An extra body may carry an extra frame: a tool, and the frame at its tip.
        link = extra.name
        for _ in extras:
            link = link if link in model.links else parents[link]
        if link not in model.links:
            raise RobotError(
                f"{where}, frame or body '{extra.name}': its parents lead back to itself, but must "
                "lead to a link of the URDF."
            )
    return parents


def _check_links(robot: RobotFile, links: Mapping[str, str], model: Urdf, where: str) -> None:
    for field, name in (
        ("root_body", robot.root_body),
        ("arm_base", robot.arm_base),
        ("tool_frame", robot.tool_frame),
        *(("standing_bodies", body) for body in robot.standing_bodies),
        *(("ignored_links", body) for body in robot.ignored_links),
        *(("disabled_groups", body) for pair in robot.disabled_pairs for body in pair),
        *(("primitives", shape.body) for shape in _primitives(robot, where)),
    ):
        _check_known(name, links, f"{where}, field '{field}'")
    if robot.root_body != model.root:
        raise RobotError(
            f"{where}, field 'root_body': '{robot.root_body}' has a parent link, but must be the "
            f"root link of the URDF, '{model.root}'."
        )
    for first, second in robot.disabled_pairs:
        if first == second:
            raise RobotError(f"{where}, field 'disabled_groups': '{first}' is paired with itself.")


def _primitives(robot: RobotFile, where: str) -> tuple[Primitive, ...]:
    try:
        return robot.load_primitives()
    except RobotError as error:
        raise RobotError(f"{where}, field 'primitives': {error}") from None


def _check_arm(robot: RobotFile, model: Urdf, where: str) -> None:
    """Check that the arm is a chain of joints from arm base to tool."""
    at = f"{where}, field 'arm_joints'"
    for name in robot.arm_joints:
        joint = model.joint(name, at)
        if not joint.is_movable:
            raise RobotError(
                f"{at}: '{name}' is {joint.type}, but must be revolute, continuous or prismatic."
            )
        if joint.type == "prismatic" and not all(map(math.isfinite, joint.hard)):
            raise RobotError(
                f"{at}: '{name}' is prismatic and has no limits. Add them to the URDF."
            )
    _check_coupled(robot, model, where)
    extras = {extra.name: extra.parent for extra in (*robot.frames, *robot.bodies)}
    tip = robot.tool_frame
    while tip in extras:
        tip = extras[tip]
    chain = model.chain(robot.arm_base, tip)
    coupled = {name for names in robot.followers().values() for name in names}
    movable = [joint.name for joint in chain or () if joint.is_movable]
    moving = [name for name in movable if name not in coupled]
    if tuple(moving) != robot.arm_joints:
        found = ", ".join(moving) if chain is not None else "no chain of joints"
        raise RobotError(
            f"{at}: from '{robot.arm_base}' to '{robot.tool_frame}' the URDF has {found}, "
            f"but the file lists {', '.join(robot.arm_joints)}."
        )


def _check_coupled(robot: RobotFile, model: Urdf, where: str) -> None:
    """Check that joints coupled to one of the arm are prismatic, parallel and move as much."""
    at = f"{where}, field 'coupled'"
    for name, leader in robot.coupled.items():
        if leader not in robot.arm_joints:
            raise UnknownNameError("joint of the arm", leader, robot.arm_joints, where=at)
        if name in robot.arm_joints:
            raise RobotError(f"{at}: '{name}' is a joint of the arm itself. Leave it out there.")
    for leader, names in robot.followers().items():
        for joint in (model.joints[leader], *(model.joints[name] for name in names)):
            mimic = joint.mimic
            if joint.type != "prismatic" or (mimic and (mimic.multiplier, mimic.offset) != (1, 0)):
                raise RobotError(
                    f"{at}: {', '.join(map(repr, names))} and '{leader}' of the arm are coupled, "
                    "but only prismatic joints that move by the same distance can be. If "
                    f"'{leader}' moves fingers, name a frame of the hand as tool frame."
                )


def _check_positions(
    robot: RobotFile, model: Urdf, positions: Mapping[str, float], where: str
) -> None:
    """Check that positions are of known, movable, not scored joints, and within hard limits."""
    for name, value in positions.items():
        joint = model.joint(name, where)
        if name in robot.arm_joints or name == robot.torso_joint:
            raise RobotError(
                f"{where}: '{name}' is scored (arm or torso), so a posture cannot set it."
            )
        if not joint.is_movable:
            limits = "" if joint.locked is None else ": its limits are one value"
            raise RobotError(f"{where}: '{name}' is fixed{limits}, and has no position. Remove it.")
        _check_within(joint, value, where)


def _check_ranges(robot: RobotFile, model: Urdf, where: str) -> None:
    """Check that the ranges of disabled groups are of joints of the arm, and leave them a range."""
    for i, group in enumerate(robot.disabled_groups):
        at = f"{where}, field 'disabled_groups[{i}].ranges'"
        for name in group.ranges:
            _check_known_joint(name, robot, at)
            limits = model.joints[name].hard
            lower, upper = group.ranges[name]
            if not max(lower, limits[0]) < min(upper, limits[1]):
                raise RobotError(
                    f"{at}: '{name}' has [{lower:g}, {upper:g}], which must overlap its limits "
                    f"[{limits[0]:g}, {limits[1]:g}]."
                )


def _check_known_joint(name: str, robot: RobotFile, where: str) -> None:
    if name not in robot.arm_joints:
        raise UnknownNameError("joint of the arm", name, robot.arm_joints, where=where)


def _check_rest(robot: RobotFile, model: Urdf, where: str) -> None:
    """Check that rest postures have only joints of the arm, within hard limits."""
    if REST in robot.other_rests:
        raise RobotError(
            f"{where}, field 'other_rests': '{REST}' is the name of the first one. Choose another."
        )
    drives = robot.mount is not None and robot.mount.drive is not None
    others = {f"other_rests', '{name}": rest for name, rest in robot.other_rests.items()}
    for field, posture in {REST: robot.rest, **others}.items():
        at = f"{where}, field '{field}'"
        for name, value in posture.items():
            _check_known_joint(name, robot, at)
            _check_within(model.joints[name], value, at)
            if drives and name == DRIVE and value != 0.0:
                raise RobotError(f"{at}: '{name}' is {value:g}, but must be 0 at a stop.")


def _check_rates(robot: RobotFile, where: str) -> None:
    """Check that limits of velocity, acceleration and jerk are of joints of the arm."""
    for field in ("velocity_limits", "acceleration_limits", "jerk_limits"):
        for name in getattr(robot, field):
            _check_known_joint(name, robot, f"{where}, field '{field}'")


def _check_within(joint: Joint, value: float, where: str) -> None:
    lower, upper = joint.hard
    if not lower <= value <= upper:
        raise RobotError(
            f"{where}: '{joint.name}' is {value:g}, but must be in [{lower:g}, {upper:g}]."
        )


def _check_known(name: str, known: Iterable[str], where: str) -> None:
    known = tuple(known)
    if name not in known:
        raise UnknownNameError("link or frame", name, known, where=where)

"""The robot that scores the goals of one hand: an arm with a tool, alone or beside the other."""

from __future__ import annotations

from pathlib import Path

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots.held_tool import HELD, held_parts, holding, load_robot, load_tool, with_tool
from tcs.model.robots.loading import load_robot as load_bare_robot
from tcs.model.robots.robot_file import RobotFile

Reference = str | Path | RobotFile
BOTH = "both"
"""Name of all arms together."""


def robot_of_hand(robot: Reference, arm: str, tool: str, *, where: str) -> RobotFile:
    """Return the robot with one of its arms scored and a tool in that hand.

    Args:
        robot: Name of a robot, path of its file, or a robot; "ROBOT+TOOL" holds that tool unless
            another one is given.
        arm: Name of the arm, "" for the one that the robot file scores.
        tool: Name of a tool that ships, or path of its file; "" for none.
        where: Who needs the hand, for messages.

    Raises:
        RobotError: If an arm is named of a robot that names none, a tool is to be held beside
            another one, or a file cannot be used.
        UnknownNameError: If there is no such arm or tool.
    """
    bare, held = robot, ""
    if not isinstance(robot, RobotFile):
        bare, held = held_parts(robot)
    elif tool and HELD in robot.name:
        raise RobotError(
            f"{where}: robot '{robot.name}' holds a tool already, so it cannot hold '{tool}'. Give "
            "the robot without its tool."
        )
    if arm:
        bare = _of_arm(bare, arm, where)
    tool = tool or held
    if isinstance(bare, RobotFile):
        if not tool:
            return bare
        return with_tool(bare, load_tool(tool), name=HELD.join((bare.name, tool)))
    return load_robot(holding(bare, tool) if tool else bare)


def _of_arm(robot: Reference, arm: str, where: str) -> Reference:
    """Return the robot that scores an arm, by name or path where it is not `robot` itself."""
    file = robot if isinstance(robot, RobotFile) else load_robot(robot)
    if not file.arms:
        raise RobotError(
            f"{where}: it names the arm '{arm}', but robot '{file.name}' names no arms. Leave "
            "'arm' out of the goals, or take a robot whose file has the field 'arms', e.g. 'pr2'."
        )
    if arm not in file.arms:
        raise UnknownNameError("arm", arm, file.arms, where=f"{where}, robot '{file.name}'")
    return arm_references(robot, arm)[arm]


def beside(robot: RobotFile, other: RobotFile) -> RobotFile:
    """Return a robot whose other arm works at the same time, with its tool and its open gripper.

    Contact between the two arms is always checked: what a file exempts holds for a parked arm.

    Args:
        robot: The robot with the arm that is scored.
        other: The same robot with the other arm scored.
    """
    own = {extra.name for extra in (*robot.bodies, *robot.frames)}
    bodies = tuple(
        body.model_copy(update={"name": f"{body.name}_beside"}) if body.name in own else body
        for body in other.bodies
        if body not in robot.bodies
    )
    opening = {} if other.gripper is None else other.grippers[other.gripper]
    name = robot.posture or "beside"
    held = robot.model_copy(
        update={
            "name": f"{robot.name} beside {other.name}",
            "bodies": (*robot.bodies, *bodies),
            "frames": (*robot.frames, *(f for f in other.frames if f.name not in own)),
            "posture": name,
            "postures": {**robot.postures, name: {**robot.postures.get(name, {}), **opening}},
            "arms": {},
        }
    )
    left, right = (links_of_arm(held, one.arm_joints[0]) for one in (robot, other))
    groups = tuple(
        group.model_copy(
            update={
                "pairs": tuple(
                    (a, b)
                    for a, b in group.pairs
                    if not ((a in left and b in right) or (a in right and b in left))
                )
            }
        )
        for group in held.disabled_groups
    )
    return held.model_copy(update={"disabled_groups": groups})


def links_of_arm(robot: RobotFile, first: str) -> frozenset[str]:
    """Return the links that a joint moves, with extra frames and bodies.

    Args:
        robot: The robot.
        first: Name of the joint, the first one of an arm.
    """
    joints = robot.model().joints
    below: dict[str, list[str]] = {}
    for joint in joints.values():
        below.setdefault(joint.parent, []).append(joint.child)
    for extra in (*robot.frames, *robot.bodies):
        below.setdefault(extra.parent, []).append(extra.name)
    found, todo = set(), [joints[first].child]
    while todo:
        link = todo.pop()
        found.add(link)
        todo += below.get(link, [])
    return frozenset(found)


def arm_references(robot: str | Path | RobotFile, arms: str) -> dict[str, str | Path | RobotFile]:
    """Return the robot that scores each requested arm, by name of the arm.

    Args:
        robot: Name of a robot, path of its file, or a robot.
        arms: `BOTH`, or the name of one arm.

    Returns:
        `robot` as given for the arm that it scores itself; for others, the name or path of a file.

    Raises:
        RobotError: If the robot file names no arms, or does not name itself among them.
        UnknownNameError: If the robot has no arm of that name.
    """
    file = robot if isinstance(robot, RobotFile) else load_bare_robot(robot)
    where = f"robot '{file.name}'"
    if not file.arms:
        raise RobotError(
            f"{where} names no arms, so there is none to choose. Leave '--arms' out, or add the "
            "field 'arms' to its file: {left: NAME, right: NAME}."
        )
    own = [arm for arm, name in file.arms.items() if load_bare_robot(name).name == file.name]
    if len(own) != 1:
        raise RobotError(
            f"{where}, field 'arms': names {', '.join(file.arms.values())}, but must name "
            f"'{file.name}' itself once. Add the arm that this file scores."
        )
    if arms != BOTH and arms not in file.arms:
        raise UnknownNameError("arm", arms, (*file.arms, BOTH), where=where)
    return {
        arm: robot if arm == own[0] else name
        for arm, name in file.arms.items()
        if arms in (BOTH, arm)
    }

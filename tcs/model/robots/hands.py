"""The robot that scores the goals of one hand: one of its arms, with a tool."""

from __future__ import annotations

from pathlib import Path

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots.arms import arm_references
from tcs.model.robots.held_tool import HELD, held_parts, holding, load_robot, load_tool, with_tool
from tcs.model.robots.robot_file import RobotFile

Reference = str | Path | RobotFile


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

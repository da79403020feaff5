"""The arms of a robot: the robot file that scores each."""

from __future__ import annotations

from pathlib import Path

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots.loading import load_robot
from tcs.model.robots.robot_file import RobotFile

BOTH = "both"
"""Name of all arms together."""


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
    file = robot if isinstance(robot, RobotFile) else load_robot(robot)
    where = f"robot '{file.name}'"
    if not file.arms:
        raise RobotError(
            f"{where} names no arms, so there is none to choose. Leave '--arms' out, or add the "
            "field 'arms' to its file: {left: NAME, right: NAME}."
        )
    own = [arm for arm, name in file.arms.items() if load_robot(name).name == file.name]
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

"""Which joints before a tool are its arm."""

from __future__ import annotations

from collections.abc import Sequence

from tcs.errors import RobotError
from tcs.model.robots.robot_file import LEAST_JOINTS, MOST_JOINTS
from tcs.model.robots.urdf import Joint

SLIDES = 3
"""Number of prismatic joints of an arm that has any: with three, five or six joints are solved."""
SIX = 6


def nearest_joints(movable: Sequence[Joint], where: str) -> list[Joint]:
    """Return the joints of the arm among all that move a tool.

    These are up to seven revolute joints in a row, those nearest the tool. If fewer than five lead
    there, they are the last six joints or the last five, if three of them are prismatic; a joint
    that mimics one of them, as in a telescope, is not counted.

    Args:
        movable: The joints from the root to the tool that are not fixed.
        where: From where to where they lead, for messages.

    Raises:
        RobotError: If no such arm leads to the tool.
    """
    arm: list[Joint] = []
    end = ""
    for joint in reversed(movable):
        if joint.type == "prismatic" or joint.mimic is not None:
            obstacle = "mimics another" if joint.mimic else "is prismatic"
            end = f"; '{joint.name}' before them {obstacle}"
        if end or len(arm) == MOST_JOINTS:
            break
        arm.insert(0, joint)
    if len(arm) >= LEAST_JOINTS:
        return arm
    own = _own_joints(movable)
    for count in (SIX, LEAST_JOINTS):
        last = own[-count:]
        if len(last) == count and _slides(last) == SLIDES:
            return last
    found = ", ".join(joint.name for joint in arm) or "none"
    raise RobotError(
        f"{where} only {len(arm)} revolute joints in a row lead ({found}{end}), and an arm needs "
        f"five to seven: {SIX - len(arm)} of the six freedoms of a goal would be missing, and a "
        f"free rotation of the tool makes up for one.{_said_of_slides(own)} "
        "Name another tool frame or base."
    )


def _own_joints(movable: Sequence[Joint]) -> list[Joint]:
    """Return the joints that mimic none of the others, the last ones up to one that does."""
    names = {joint.name for joint in movable}
    own: list[Joint] = []
    for joint in reversed(movable):
        if joint.mimic is None:
            own.insert(0, joint)
        elif joint.mimic.leader not in names:
            break
    return own


def _slides(joints: Sequence[Joint]) -> int:
    """Return the number of prismatic joints."""
    return sum(joint.type == "prismatic" for joint in joints)


def _said_of_slides(own: Sequence[Joint]) -> str:
    """Return a sentence about the prismatic joints among the last six, empty if there are none."""
    slides = _slides(own[-SIX:])
    if not slides:
        return ""
    return (
        f" Of the last {min(len(own), SIX)} joints {slides} are prismatic: with prismatic joints, "
        "an arm has three, and two or three revolute ones."
    )

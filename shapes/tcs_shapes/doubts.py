"""What of a robot is doubtful although it can be used: units, fingers in the arm, bare links."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable

from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.tool_frame import tool_place
from tcs.model.robots.urdf import Joint, Urdf
from tcs.model.robots.urdf.model import DRIVE
from tcs.model.robots.urdf.surfaces import surface_geometries

TURNS = 4.0 * math.pi
"""Angle beyond which a limit is rather in degrees: two turns [rad]."""
_FASTEST = 60.0
"""Speed beyond which a limit is rather in degrees [rad/s]: motors of humanoids reach 49."""
_SLIDE = 5.0
"""Position of a prismatic joint [m] beyond which a limit is rather in millimetres."""
_LONGEST = 4.0
"""Length of an arm [m] beyond which lengths are rather in another unit."""
_LEAST_RANGE = 0.02
"""Range of a joint of the arm [rad or m] below which it hardly moves."""
_FINGER = re.compile("finger|grip|jaw|thumb|knuckle|index|middle|pinky|claw")
_GAP = 0.1
"""Length of a link without a surface that is worth a remark [m]."""


def doubts(robot: RobotFile) -> tuple[str, ...]:
    """Return what is doubtful in the URDF and the choice of the arm, one sentence each.

    Args:
        robot: The robot, with its primitives.

    Raises:
        RobotError: If a model or the primitives cannot be used.
    """
    model = robot.model()
    arm = [model.joints[name] for name in robot.arm_joints]
    place = tool_place(robot)
    found = [
        _of_limits(model),
        _of_speeds(arm),
        _of_length(arm),
        _of_ranges(robot),
        _of_joints_before(robot, model),
        _of_fingers(arm),
        _of_branches(model, arm),
        _of_gaps(robot, model),
        _of_drawing(model),
        None if place is None else place.doubt,
    ]
    return tuple(line for line in found if line)


def _of_limits(model: Urdf) -> str | None:
    """Return which limits are rather degrees or millimetres than radians or metres."""
    odd = []
    for joint in model.joints.values():
        most = _SLIDE if joint.type == "prismatic" else TURNS
        if joint.is_movable and most < max(map(abs, joint.hard)) < math.inf:
            odd.append("'{}' [{:g}, {:g}]".format(joint.name, *joint.hard))
    if not odd:
        return None
    return (
        f"limits of {_listed(odd)} are rad or m in a URDF: if these are degrees or millimetres, "
        "convert them; joints that turn without end are 'continuous'."
    )


def _of_speeds(arm: Iterable[Joint]) -> str | None:
    """Return which speed limits are rather degrees per second."""
    odd = [f"'{j.name}' {j.velocity:g}" for j in arm if _FASTEST < j.velocity < math.inf]
    if not odd:
        return None
    return (
        f"speed limits of {_listed(odd)} are rad/s or m/s in a URDF: if these are other units, "
        "correct them, or give 'velocity_limits' in the robot file."
    )


def _of_length(arm: list[Joint]) -> str | None:
    """Return that an arm is longer than any."""
    length = sum(math.hypot(*joint.xyz) for joint in arm[1:])
    if length <= _LONGEST:
        return None
    return f"the arm is {length:.1f} m long: lengths of a URDF are metres."


def _of_ranges(robot: RobotFile) -> str | None:
    """Return which joints of the arm hardly move."""
    limits = robot.joint_limits()
    odd = [
        "'{}' [{:g}, {:g}]".format(name, *limits[name])
        for name in robot.arm_joints
        if limits[name][1] - limits[name][0] < _LEAST_RANGE
    ]
    if not odd:
        return None
    return f"{_listed(odd)} hardly move: goals may count as out of reach for that."


def _of_joints_before(robot: RobotFile, model: Urdf) -> str | None:
    """Return which joints lead to the tool too, but are not moved."""
    chain = model.chain(model.root, model.joints[robot.arm_joints[0]].parent) or ()
    still = [j.name for j in chain if j.is_movable and j.mimic is None]
    still = [f"'{name}'" for name in still if name not in (robot.torso_joint, DRIVE)]
    if not still:
        return None
    return f"{_listed(still)} before the arm stay where they are, and could move the tool as well."


def _of_fingers(arm: list[Joint]) -> str | None:
    """Return that the last joint is a finger by its name."""
    last = arm[-1]
    if not _FINGER.search(f"{last.name} {last.child}".lower()):
        return None
    return (
        f"the last joint of the arm, '{last.name}' of '{last.child}', is a finger by its name: if "
        "it opens the hand, name a frame of the hand as tool."
    )


def _of_branches(model: Urdf, arm: list[Joint]) -> str | None:
    """Return which joints of the arm branch off a link that carries other joints too.

    A finger does so, and so does the first joint of an arm behind the waist of a robot with two.
    """
    for before, joint in itertools.pairwise(arm):
        within = _welded(model, before.child)
        beside = [
            other.name
            for other in model.joints.values()
            if other.is_movable
            and other.parent in within
            and other.name != joint.name
            and not (other.mimic is not None and other.mimic.leader == before.name)
        ]
        if beside:
            return (
                f"'{before.child}' carries {_listed([f'{name!r}' for name in beside])} beside "
                f"'{joint.name}' of the arm: if '{joint.name}' is a finger, name a frame of the "
                f"hand as tool; if '{before.name}' also moves a head or another arm, --base "
                f"{before.child} leaves it out."
            )
    return None


def _of_gaps(robot: RobotFile, model: Urdf) -> str | None:
    """Return which long links of the arm have no surface, so that nothing is checked there."""
    moved = model.links_moved_by(robot.arm_joints[0])
    chain = model.chain(model.joints[robot.arm_joints[0]].child, _link_of_tool(robot, model)) or ()
    bare: list[str] = []
    length = 0.0
    for joint in chain:
        if joint.parent in moved and not surface_geometries(model, joint.parent):
            length = math.hypot(*joint.xyz)
            if length > _GAP and joint.parent not in robot.ignored_links:
                bare.append(f"'{joint.parent}' ({length:.2f} m)")
    if not bare:
        return None
    return f"no geometry on {_listed(bare)}: nothing is checked along it."


def _of_drawing(model: Urdf) -> str | None:
    """Return which meshes that are only drawn were not found."""
    missing = [
        f"'{link}'"
        for link, geometries in model.links.items()
        if any(g.fault and not g.is_surface for g in geometries)
    ]
    if not missing:
        return None
    return f"visual meshes of {_listed(missing)} were not found, so pictures lack them."


def _link_of_tool(robot: RobotFile, model: Urdf) -> str:
    """Return the link of the URDF that carries the tool frame."""
    parents = {extra.name: extra.parent for extra in (*robot.frames, *robot.bodies)}
    link = robot.tool_frame
    while link not in model.links:
        link = parents[link]
    return link


def _welded(model: Urdf, link: str) -> set[str]:
    """Return a link and all that fixed joints weld to it, away from the root."""
    found = {link}
    while True:
        more = {
            j.child for j in model.joints.values() if not j.is_movable and j.parent in found
        } - found
        if not more:
            return found
        found |= more


def _listed(names: list[str]) -> str:
    """Return names in a line, at most six of them."""
    shown = ", ".join(names[:6])
    return shown if len(names) <= 6 else f"{shown} and {len(names) - 6} more"

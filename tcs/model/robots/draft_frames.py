"""Root and tool frame of a drafted robot: on the floor, and with the axes that goals need."""

from __future__ import annotations

import math
from collections.abc import Mapping

from tcs.model.robots.hand import hand_axes
from tcs.model.robots.robot_file import ExtraFrame, Mount, RobotFile
from tcs.model.robots.urdf import Urdf
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import body_triangles

_ON_FLOOR = 0.02
"""Bodies that reach down to this height [m] stand on the floor."""
_ABOVE = 0.1
"""Height of the lowest surface above the root from which on the robot seems to hover [m]."""


def on_floor(robot: RobotFile) -> tuple[RobotFile, str]:
    """Return a robot whose root is on the floor, and what was chosen.

    A root above the lowest surface, such as the pelvis of a humanoid, gets a mount. The arm does
    not count: bolted down, it may reach below its base.
    """
    model, positions = robot.model(), robot.with_mimics(robot.joint_positions())
    arm, lows = model.links_moved_by(robot.arm_joints[0]), [(0.0, model.root)]
    for body, triangles in body_triangles(model).items():
        if body in arm:
            continue
        R, p = pose_in_root(model, body, positions)
        lows.append((float((triangles @ R[2] + p[2]).min()), body))
    lowest, lowest_body = min(lows[1:] or lows)
    if lowest >= -_ON_FLOOR:
        above = f"; its lowest surface, of '{lowest_body}', is {lowest:g} m above it"
        return robot, (
            f"'{model.root}' must be on the floor, z up, x forward"
            f"{above if lowest > _ABOVE else ''}"
        )
    link = "floor_link"
    while link in model.links:
        link += "_"
    height = math.ceil(-lowest * 1e3) / 1e3
    mount = Mount(link=link, xyz=(0.0, 0.0, height))
    change = {"mount": mount, "root_body": link}
    mounted = robot.model_copy(update=change)
    return (
        mounted.model_copy(update={"standing_bodies": standing_bodies(mounted)}),
        f"'{model.root}' is {height:g} m above the lowest surface, that of '{lowest_body}'"
        f"{_moved_there(model, positions, lowest_body)}: '{link}' on the floor carries it; z must "
        "be up, x forward",
    )


def _moved_there(model: Urdf, positions: Mapping[str, float], body: str) -> str:
    """Return which joints carry a body, and at which values, empty if none does."""
    chain = [j.name for j in model.chain(model.root, body) or () if j.is_movable]
    at = [f"{name} at {positions[name]:.3g}" for name in chain if positions[name]]
    return f" with {', '.join(at)}" if at else f" with {', '.join(chain)} at 0" if chain else ""


def with_goal_axes(robot: RobotFile) -> tuple[RobotFile, str]:
    """Return a robot whose tool frame points along its hand, and what was chosen."""
    hand, tool = hand_axes(robot), robot.tool_frame
    if hand is None:
        return robot, f"the shapes of the hand do not show where it points; x of '{tool}' must"
    part = "the fingers point" if hand.fingers else "the last link points"
    if hand.is_forward_x:
        return robot, f"{part} along +x of '{tool}', as goals need"
    taken = {*robot.model().links}
    name = next(
        n for n in (f"{tool}_goal{i or ''}" for i in range(len(taken) + 1)) if n not in taken
    )
    frame = ExtraFrame(name=name, parent=tool, rpy_deg=hand.goal_axes())
    opening = "" if hand.opening is None else " and y in the direction in which they open"
    return (
        robot.model_copy(update={"frames": (frame,), "tool_frame": name}),
        f"{part} along {hand.forward_axis} of '{tool}', and goals need +x: frame '{name}' was "
        f"added with x forward{opening}",
    )


def standing_bodies(robot: RobotFile) -> tuple[str, ...]:
    """Return the bodies that reach down to the floor and that neither arm nor torso moves."""
    model = robot.model()
    first = [robot.arm_joints[0], *([robot.torso_joint] if robot.torso_joint else [])]
    moved = frozenset[str]().union(*map(model.links_moved_by, first))
    positions = robot.with_mimics(robot.joint_positions())
    found = []
    for body, triangles in body_triangles(model).items():
        R, p = pose_in_root(model, body, positions)
        if body not in moved and (triangles @ R.T + p)[..., 2].min() <= _ON_FLOOR:
            found.append(body)
    return tuple(found)

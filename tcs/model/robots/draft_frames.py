"""Root and tool frame of a drafted robot: on the floor, and with the axes that goals need."""

from __future__ import annotations

import math

from tcs.model.robots.hand import hand_axes
from tcs.model.robots.robot_file import ExtraFrame, Mount, RobotFile
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import body_triangles

_ON_FLOOR = 0.02
"""Bodies that reach down to this height [m] stand on the floor."""


def on_floor(robot: RobotFile) -> tuple[RobotFile, str]:
    """Return a robot whose root is on the floor, and what was chosen.

    A root above the lowest surface, such as the pelvis of a humanoid, gets a mount.
    """
    model, positions = robot.model(), robot.with_mimics(robot.joint_positions())
    lowest = 0.0
    for body, triangles in body_triangles(model).items():
        R, p = pose_in_root(model, body, positions)
        lowest = min(lowest, float((triangles @ R[2] + p[2]).min()))
    if lowest >= -_ON_FLOOR:
        return robot, f"'{model.root}' must be on the floor, z up, x forward"
    link = "floor_link"
    while link in model.links:
        link += "_"
    height = math.ceil(-lowest * 1e3) / 1e3
    mount = Mount(link=link, xyz=(0.0, 0.0, height))
    change = {"mount": mount, "root_body": link}
    mounted = robot.model_copy(update=change)
    return (
        mounted.model_copy(update={"standing_bodies": standing_bodies(mounted)}),
        f"'{model.root}' is {height:g} m above the lowest surface: '{link}' on the floor carries "
        "it; z must be up, x forward",
    )


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

"""Faults of a robot file that are found without its meshes, in milliseconds."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tcs.files.paths import is_path
from tcs.model.robots import RobotFile, load_robot
from tcs.model.robots.tool_frame import HandAxes, hand_axes, tool_place
from tcs.model.robots.urdf.pose import pose_in_root

SUNK = 0.1
"""Depth of a primitive below the root that shows a root above the floor [m]: those of a large base
protrude from it by up to 6 cm (Baxter's pedestal)."""


def quick_problems(robot: str | Path) -> tuple[str, ...]:
    """Return problems of a robot file of one's own that a check-up would find, one sentence each.

    Only those that need no mesh: the axes of the tool frame and where it lies, and a root above the
    floor.

    Args:
        robot: Name of a robot, for which nothing is checked, or path of its file.

    Raises:
        UnknownNameError: If no robot has that name, or its file names something unknown.
        RobotError: If the file, or a model it names, cannot be used.
    """
    if not is_path(str(robot)):
        return ()
    loaded = load_robot(robot)
    found = []
    axis = fingers_off_axis(loaded)
    if axis is not None:
        found.append(tool_axes_problem(loaded, axis))
    place = tool_place(loaded)
    if place is not None and place.doubt:
        found.append(place.doubt)
    model, positions = loaded.model(), loaded.with_mimics(loaded.joint_positions())
    lowest, arm = 0.0, model.links_moved_by(loaded.arm_joints[0])
    for shape in loaded.load_primitives():
        if shape.body in model.links and shape.body not in arm:
            R, p = pose_in_root(model, shape.body, positions)
            lowest = min(lowest, float(p[2] + R[2] @ np.array(shape.xyz)) - shape.reach(R[2]))
    if lowest < -SUNK:
        found.append(
            f"its primitives reach {-lowest:.2f} m below '{loaded.root_body}', but the root must "
            "be on the floor: add a mount."
        )
    return tuple(found)


def fingers_off_axis(robot: RobotFile) -> str | None:
    """Return the tool axis along which the fingers point, None if it is x or there are no fingers.

    Args:
        robot: The robot.

    Returns:
        Sign and name of an axis, such as "+z".

    Raises:
        RobotError: If a model or the primitives cannot be used.
    """
    hand = hand_axes(robot)
    return (
        hand.forward_axis if hand is not None and hand.fingers and not hand.is_forward_x else None
    )


def tool_axes_problem(robot: RobotFile, axis: str) -> str:
    """Return the sentence that says which axis of the tool frame is not as goals need it."""
    return (
        f"the fingers point along {axis} of tool frame '{robot.tool_frame}', but goals need x "
        "forward out of the hand: add a frame with these axes under 'frames', and name it as "
        "'tool_frame'."
    )


def flange_note(robot: RobotFile, hand: HandAxes | None) -> str | None:
    """Return what to review in the tool frame of a hand without fingers, None if nothing."""
    if hand is None or hand.fingers or hand.is_forward_x:
        return None
    return (
        f"the last link points along {hand.forward_axis} of tool frame '{robot.tool_frame}'; goals "
        "need x forward out of the hand."
    )

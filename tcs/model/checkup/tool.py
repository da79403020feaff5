"""The axes of the tool frame against the fingers of the hand."""

from __future__ import annotations

import numpy as np

from tcs.model.robots import RobotFile
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.urdf import Urdf
from tcs.model.robots.urdf.pose import pose_in_root

AHEAD = 0.7
"""Least cosine between x of the tool frame and the direction of the fingers: 45 degrees."""


def fingers_off_axis(robot: RobotFile) -> str | None:
    """Return the tool axis along which the fingers point, None if it is x or there are no fingers.

    Fingers are what joints beyond the arm move. Their direction is that of the centre of their
    primitives, seen from the last joint of the arm.

    Args:
        robot: The robot.

    Returns:
        Sign and name of an axis, such as "+z".

    Raises:
        RobotError: If a model or the primitives cannot be used.
    """
    model = model_with_extras(robot)
    fingers = _fingers(model, robot.arm_joints[-1])
    positions = robot.with_mimics({**robot.joint_positions(), **robot.rest})
    centres = []
    for shape in robot.load_primitives():
        if shape.body in fingers:
            R, p = pose_in_root(model, shape.body, positions)
            centres.append(p + R @ np.array(shape.xyz))
    if not centres:
        return None
    last = model.joints[robot.arm_joints[-1]].child
    R_T, _ = pose_in_root(model, robot.tool_frame, positions)
    _, p_last = pose_in_root(model, last, positions)
    ahead = R_T.T @ (np.mean(centres, axis=0) - p_last)
    if ahead[0] >= AHEAD * np.linalg.norm(ahead):
        return None
    largest = int(np.argmax(np.abs(ahead)))
    return f"{'+' if ahead[largest] > 0 else '-'}{'xyz'[largest]}"


def _fingers(model: Urdf, last: str) -> frozenset[str]:
    """Return the links that movable joints beyond the last joint of the arm move."""
    hand = model.links_moved_by(last)
    moving = [j.name for j in model.joints.values() if j.is_movable and j.parent in hand]
    return frozenset[str]().union(*map(model.links_moved_by, moving))

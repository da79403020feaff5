"""Where the tool frame lies, seen from the shapes of the hand."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf import Urdf
from tcs.model.robots.urdf.pose import pose_in_root

BEYOND = 0.04
"""Greatest length of the hand beyond the tool frame that is usual [m]: goals lie 4 to 10 cm off the
skin, and tool frames of robots that ship up to 2 cm behind the fingertips."""
AHEAD = 0.1
"""Greatest distance of the tool frame ahead of the hand that is usual [m]."""
FloatArray = NDArray[np.float64]

FORWARD = 0.7
"""Least cosine between an axis of the tool frame and a direction that it is said to have: 45
degrees."""
_APART = 0.02
"""Distance of a joint from the tool frame that counts as another place [m]."""
_SHORTEST = 0.005
"""Least distance between the hand and the tool frame that gives a direction [m]."""


@dataclass(frozen=True, slots=True)
class ToolPlace:
    """Where the tool frame T lies along its x axis, seen from the shapes of the hand.

    Attributes:
        tool: Name of T.
        beyond: How far the shapes reach beyond T, along x [m]; negative if they end behind it.
        body: The body that reaches farthest.
    """

    tool: str
    beyond: float
    body: str

    @property
    def text(self) -> str:
        """Where it lies, without a full stop."""
        if self.beyond >= 0.0:
            return f"the hand ('{self.body}') reaches {self.beyond:.3f} m beyond '{self.tool}'"
        return f"'{self.tool}' lies {-self.beyond:.3f} m ahead of the hand ('{self.body}')"

    @property
    def doubt(self) -> str | None:
        """What to review, one sentence; None if nothing."""
        if self.beyond > BEYOND:
            return (
                f"{self.text}: with it at a goal 4 to 10 cm off the skin, the hand touches the "
                "person. Name a frame nearer to its tip, or add one under 'frames', as "
                "'tool_frame'."
            )
        if -self.beyond > AHEAD:
            return f"{self.text}: goals are reached by a point in the air, unless it holds a tool."
        return None


def tool_place(robot: RobotFile) -> ToolPlace | None:
    """Return where the tool frame lies; None if the hand has no shapes.

    The hand is everything that the last joint of the arm moves.

    Args:
        robot: The robot, at rest.

    Raises:
        RobotError: If a model or the primitives cannot be used.
    """
    model = model_with_extras(robot)
    positions = robot.with_mimics({**robot.joint_positions(), **robot.rest})
    hand = model.links_moved_by(robot.arm_joints[-1])
    R_T, p_T = pose_in_root(model, robot.tool_frame, positions)
    forward = R_T[:, 0]
    found = []
    for shape in robot.load_primitives():
        if shape.body in hand:
            R, p = pose_in_root(model, shape.body, positions)
            ahead = float((p + R @ np.array(shape.xyz) - p_T) @ forward)
            found.append((ahead + shape.reach(R.T @ forward), shape.body))
    if not found:
        return None
    beyond, body = max(found)
    return ToolPlace(robot.tool_frame, beyond, body)


@dataclass(frozen=True)
class HandAxes:
    """Directions of a hand in the tool frame.

    Attributes:
        forward: Direction in which it points, shape (3,), of length 1.
        opening: Direction in which its fingers open, shape (3,), of length 1; None if fewer than
            two fingers move.
        fingers: Whether there are fingers.
    """

    forward: FloatArray
    opening: FloatArray | None
    fingers: bool

    @property
    def is_forward_x(self) -> bool:
        """Whether x of the tool frame points forward."""
        return bool(self.forward[0] >= FORWARD)

    @property
    def forward_axis(self) -> str:
        """The tool axis nearest to `forward`: sign and name, such as "+z"."""
        return _axis_name(_nearest_axis(self.forward))

    def goal_axes(self) -> tuple[float, float, float]:
        """Return the frame that goals need, in the tool frame: x forward, y along the opening.

        Its axes are axes of the tool frame.

        Returns:
            Roll, pitch, yaw about the fixed axes [deg].
        """
        x = _nearest_axis(self.forward)
        aside = np.eye(3)[1] if self.opening is None else self.opening
        across = aside - (aside @ x) * x
        # Without fingers y stays y, or becomes the next axis if that is forward.
        y = _nearest_axis(across) if np.linalg.norm(across) > 0.5 else np.roll(np.abs(x), 1)
        y = np.abs(y) if self.opening is not None else y
        R = np.stack([x, y, np.cross(x, y)], axis=1)
        if abs(R[2, 0]) > 0.5:
            angles = math.atan2(-R[1, 2], R[1, 1]), -R[2, 0] * math.pi / 2, 0.0
        else:
            angles = math.atan2(R[2, 1], R[2, 2]), 0.0, math.atan2(R[1, 0], R[0, 0])
        roll, pitch, yaw = (float(round(math.degrees(angle))) for angle in angles)
        return roll, pitch, yaw


def hand_axes(robot: RobotFile) -> HandAxes | None:
    """Return where the hand of a robot points, None if its shapes do not tell.

    Fingers are what joints beyond the arm move. Their direction is that of the centre of their
    primitives, seen from the last joint of the arm. Without fingers it is that from the centre of
    the last link's primitives to the tool frame, or, where the tool frame lies behind them, that of
    the centre, seen from the last joint that is not at the tool frame itself.

    Args:
        robot: The robot, at rest.

    Raises:
        RobotError: If a model or the primitives cannot be used.
    """
    model = model_with_extras(robot)
    positions = robot.with_mimics({**robot.joint_positions(), **robot.rest})
    last = model.joints[robot.arm_joints[-1]].child
    R_T, p_T = pose_in_root(model, robot.tool_frame, positions)
    fingers = _fingers(model, robot.arm_joints[-1])
    centres = [_centre(robot, model, finger, positions) for finger in fingers]
    found = [centre for centre in centres if centre is not None]
    if found:
        _, start = pose_in_root(model, last, positions)
        ahead = np.mean(found, axis=0) - start
        opening = _widest(np.array(found), ahead)
    else:
        hand = _centre(robot, model, model.links_moved_by(robot.arm_joints[-1]), positions)
        if hand is None:
            return None
        start = _joint_before(robot, model, positions, p_T)
        is_behind = np.linalg.norm(p_T - start) < np.linalg.norm(hand - start)
        ahead, opening = hand - start if is_behind else p_T - hand, None
    length = float(np.linalg.norm(ahead))
    if length < _SHORTEST:
        return None
    return HandAxes(
        forward=R_T.T @ ahead / length,
        opening=None if opening is None else R_T.T @ opening,
        fingers=bool(found),
    )


def _joint_before(
    robot: RobotFile, model: Urdf, positions: Mapping[str, float], p_T: FloatArray
) -> FloatArray:
    """Return the last joint of the arm that is not where the tool frame is, in the root [m]."""
    start = p_T
    for name in reversed(robot.arm_joints):
        _, start = pose_in_root(model, model.joints[name].child, positions)
        if np.linalg.norm(p_T - start) > _APART:
            break
    return start


def _fingers(model: Urdf, last: str) -> list[frozenset[str]]:
    """Return the links of each finger: what a joint beyond the last one of the arm moves."""
    hand = model.links_moved_by(last)
    moving = [j.name for j in model.joints.values() if j.is_movable and j.parent in hand]
    found = {name: model.links_moved_by(name) for name in moving}
    # A joint that another one of them carries belongs to the same finger.
    return [
        links
        for name, links in found.items()
        if not any(links < other for o, other in found.items() if o != name)
    ]


def _centre(
    robot: RobotFile, model: Urdf, links: frozenset[str], positions: Mapping[str, float]
) -> FloatArray | None:
    """Return the mean centre of the primitives of links in the root [m], None without any."""
    centres = []
    for shape in robot.load_primitives():
        if shape.body in links:
            R, p = pose_in_root(model, shape.body, positions)
            centres.append(p + R @ np.array(shape.xyz))
    return np.mean(centres, axis=0) if centres else None


def _widest(centres: FloatArray, ahead: FloatArray) -> FloatArray | None:
    """Return the direction across `ahead` along which points are spread most, None for one."""
    along = ahead / max(float(np.linalg.norm(ahead)), 1e-12)
    spread = centres - centres.mean(axis=0)
    spread -= np.outer(spread @ along, along)
    if len(centres) < 2 or not np.any(np.linalg.norm(spread, axis=1) > 1e-3):
        return None
    return np.asarray(np.linalg.svd(spread)[2][0])


def _nearest_axis(direction: FloatArray) -> FloatArray:
    """Return the axis nearest to a direction, with its sign, shape (3,)."""
    largest = int(np.argmax(np.abs(direction)))
    return np.asarray(np.sign(direction[largest]) * np.eye(3)[largest])


def _axis_name(axis: FloatArray) -> str:
    largest = int(np.argmax(np.abs(axis)))
    return f"{'+' if axis[largest] > 0 else '-'}{'xyz'[largest]}"

"""Where the tool frame lies, seen from the shapes of the hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf.pose import pose_in_root

BEYOND = 0.04
"""Greatest length of the hand beyond the tool frame that is usual [m]: goals lie 4 to 10 cm off the
skin, and tool frames of robots that ship up to 2 cm behind the fingertips."""
AHEAD = 0.1
"""Greatest distance of the tool frame ahead of the hand that is usual [m]."""


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

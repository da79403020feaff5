"""The axes of the tool frame against the hand."""

from __future__ import annotations

from tcs.model.robots import RobotFile
from tcs.model.robots.hand import HandAxes, hand_axes


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

"""Numbers and findings in words."""

from __future__ import annotations

from tcs.placement.robustness import Evaluation, Loss
from tcs.placement.tables import Reason

REASONS = {
    Reason.TOO_FAR: "too far for the arm",
    Reason.JOINT_LIMITS: "joint limits",
    Reason.BODY_BLOCKED: "the robot's body would touch something",
    Reason.GRIPPER_BLOCKED: "the gripper would touch something at the goal",
    Reason.ARM_BLOCKED: "every arm posture would touch something",
}


def percent(share: float, digits: int = 1) -> str:
    """Return a share as a percentage, without its sign.

    >>> percent(0.98407)
    '98.4'
    """
    return f"{100.0 * share:.{digits}f}"


def mean_and_std(evaluation: Evaluation) -> str:
    """Return mean and standard deviation as the paper prints them."""
    return f"{percent(evaluation.summary.mean)} ({percent(evaluation.summary.std)})"


def signed(points: float) -> str:
    """Return percentage points with their sign.

    >>> signed(0.04), signed(-1.25), signed(-0.01)
    ('0.0', '-1.2', '0.0')
    """
    text = f"{points:+.1f}"
    return "0.0" if float(text) == 0.0 else text


def p_value(p: float) -> str:
    """Return a p for a table.

    >>> p_value(3e-7), p_value(0.0312), p_value(1.0)
    ('< 0.0001', '0.031', '1')
    """
    if p < 1e-4:
        return "< 0.0001"
    return f"{p:.2g}"


def body(name: str) -> str:
    """Return the name of a body for a person.

    >>> body("l_gripper_r_finger_link"), body("bed::pillow")
    ('l gripper r finger', 'pillow')
    """
    return name.split("::")[-1].removesuffix("_link").replace("_", " ")


def lost_goal(loss: Loss) -> str:
    """Return in a sentence why a goal is lost."""
    return (
        f"Goal {loss.goal} ({loss.body_frame.replace('_', ' ')}) is reached in "
        f"{percent(loss.success)} % of the samples; in the others: {stopped_by(loss)}."
    )


def stopped_by(loss: Loss) -> str:
    """Return what stops the arm where a goal is lost, the most frequent reason first."""
    said = ", ".join(
        f"{REASONS[reason]} ({percent(share, 0)} %)"
        for reason, share in loss.reasons.items()
        if share >= 0.05
    )
    if loss.pair is not None and loss.pair_fraction >= 0.2:
        said += f"; most often {body(loss.pair[0])} and {body(loss.pair[1])}"
    return said


def goes_with(loss: Loss) -> str:
    """Return which error losses go with, as a mean in standard deviations."""
    return f"{loss.joint.replace('_', ' ')} {loss.standardized_error:+.1f}"

"""Why a goal is or is not reached: the sentence, name and colour of each reason, and of bodies."""

from __future__ import annotations

from tcs.placement.tables import Reason


def body_name(name: str) -> str:
    """Return the name of a body without the scope of its model and the suffix "_link".

    >>> body_name("l_gripper_r_finger_link"), body_name("bed::pillow")
    ('l gripper r finger', 'pillow')
    """
    return frame_name(name.split("::")[-1].removesuffix("_link"))


def frame_name(name: str) -> str:
    """Return the name of a frame or joint in words.

    >>> frame_name("forearm_left")
    'forearm left'
    """
    return name.replace("_", " ")


def pair_text(pair: tuple[str, str] | list[str]) -> str:
    """Return two bodies in contact.

    >>> pair_text(("l_forearm_link", "bed::pillow"))
    'l forearm against pillow'
    """
    first, second = pair
    return f"{body_name(first)} against {body_name(second)}"


REASON_TEXTS = {
    Reason.REACHED: "reached",
    Reason.TOO_FAR: "too far for the arm",
    Reason.JOINT_LIMITS: "no arm posture within the joint limits",
    Reason.BODY_BLOCKED: "the robot's body would touch something",
    Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT: (
        "the gripper at the goal would touch the environment or the person, wherever the robot is"
    ),
    Reason.GRIPPER_BLOCKED_BY_ROBOT: "the gripper at the goal would touch the robot's own body",
    Reason.ARM_BLOCKED: "every arm posture would touch something",
    Reason.EXCLUDED: "excluded by a constraint when scoring",
    Reason.APPROACH_LIMITS: "no posture at the goal can be approached within the joint limits",
    Reason.APPROACH_BLOCKED: "the arm would touch something on its way straight to the goal",
    Reason.OTHER_GOAL_UNREACHED: "the other arm does not reach the other goal of the pair",
    Reason.ARMS_BLOCKED: "the two arms would touch each other",
}
"""Each reason as part of a sentence."""
REASON_NAMES = {
    Reason.REACHED: "reached",
    Reason.TOO_FAR: "too far",
    Reason.JOINT_LIMITS: "joint limits",
    Reason.BODY_BLOCKED: "body blocked",
    Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT: "gripper blocked by environment",
    Reason.GRIPPER_BLOCKED_BY_ROBOT: "gripper blocked by robot",
    Reason.ARM_BLOCKED: "arm blocked",
    Reason.EXCLUDED: "excluded by a constraint",
    Reason.APPROACH_LIMITS: "approach beyond joint limits",
    Reason.APPROACH_BLOCKED: "approach blocked",
    Reason.OTHER_GOAL_UNREACHED: "other goal unreached",
    Reason.ARMS_BLOCKED: "arms blocked",
}
"""Each reason as the title of a column or in a legend."""
REASON_COLOURS = {
    Reason.REACHED: "#009e73",
    Reason.TOO_FAR: "#56b4e9",
    Reason.JOINT_LIMITS: "#f0e442",
    Reason.BODY_BLOCKED: "#4d4d4d",
    Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT: "#e69f00",
    Reason.GRIPPER_BLOCKED_BY_ROBOT: "#cc79a7",
    Reason.ARM_BLOCKED: "#d55e00",
    Reason.EXCLUDED: "#d9d9d9",
    Reason.APPROACH_LIMITS: "#0072b2",
    Reason.APPROACH_BLOCKED: "#8c510a",
    Reason.OTHER_GOAL_UNREACHED: "#b2abd2",
    Reason.ARMS_BLOCKED: "#762a83",
}
"""The palette of Okabe and Ito, distinct under colour vision deficiency, and further colours."""
COLOUR_NAMES = {
    Reason.REACHED: "green",
    Reason.TOO_FAR: "light blue",
    Reason.JOINT_LIMITS: "yellow",
    Reason.BODY_BLOCKED: "dark grey",
    Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT: "light orange",
    Reason.GRIPPER_BLOCKED_BY_ROBOT: "pink",
    Reason.ARM_BLOCKED: "dark orange",
    Reason.EXCLUDED: "light grey",
    Reason.APPROACH_LIMITS: "dark blue",
    Reason.APPROACH_BLOCKED: "brown",
    Reason.OTHER_GOAL_UNREACHED: "lilac",
    Reason.ARMS_BLOCKED: "purple",
}
"""Names of the colours, for text without colour."""


def reason_of(name: str) -> Reason:
    """Return the reason with this name in JSON.

    >>> reason_of("too_far")
    <Reason.TOO_FAR: 1>
    """
    return Reason[name.upper()]


def colour_legend() -> str:
    """Return the meaning of each colour in one line."""
    return ", ".join(f"{COLOUR_NAMES[reason]}: {REASON_NAMES[reason]}" for reason in Reason)

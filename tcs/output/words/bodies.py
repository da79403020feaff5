"""Names of bodies and frames for readers."""

from __future__ import annotations


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

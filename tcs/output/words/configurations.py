"""Base poses, configurations and settings of the environment.

Values are given under the keys of `InitialConfiguration.to_json`: metres, and degrees where the
key ends in `_deg`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tcs.output.words.reasons import frame_name
from tcs.placement.tables import window_text

HAND = "hand"
"""Key of the names of the hands that serve the goals, in files of several."""
WINDOW = "window"
"""Key of the parking window of a stop."""


def axis_name(key: str) -> str:
    """Return the name of an axis.

    >>> axis_name("base_x"), axis_name("base_yaw_deg"), axis_name("bed_height")
    ('base x', 'heading', 'bed height')
    """
    name = key.removesuffix("_deg")
    return "heading" if name == "base_yaw" else frame_name(name)


def axis_unit(key: str) -> str:
    """Return the unit of the values under a key: "m" or "deg"."""
    return "deg" if key.endswith("_deg") else "m"


def axis_title(key: str) -> str:
    """Return the name of an axis with its unit, as the title of a column, slider or plot axis.

    >>> axis_title("head_rest_deg")
    'head rest [deg]'
    """
    return "hands" if key == HAND else f"{axis_name(key)} [{axis_unit(key)}]"


def axis_value(key: str, value: float | Sequence[str | None]) -> str:
    """Return a value without its unit: lengths in centimetres, angles in tenths of a degree.

    The names of hands are those of `hands_text`.

    >>> axis_value("torso", 0.30000000000000004), axis_value("base_yaw_deg", -90.0)
    ('0.30', '270')
    """
    if isinstance(value, Sequence):
        return hands_text(value)
    if axis_unit(key) == "m":
        return f"{value:.2f}"
    if key == "base_yaw_deg":
        value = round(value, 1) % 360.0
    return f"{round(value, 1) + 0.0:g}"


def quantity(key: str, value: float) -> str:
    """Return a value with its unit.

    >>> quantity("bed_height", 0.2), quantity("head_rest_deg", 35.0)
    ('0.20 m', '35 deg')
    """
    return f"{axis_value(key, value)} {axis_unit(key)}"


def base_pose_text(member: Mapping[str, Any]) -> str:
    """Return the pose of the base in the environment frame.

    Args:
        member: A configuration, as `InitialConfiguration.to_json` returns it.

    >>> base_pose_text({"base_x": 1.4, "base_y": -1.2, "base_yaw_deg": 0.0, "torso": 0.1})
    'x 1.40 m, y -1.20 m, heading 0 deg'
    """
    return ", ".join(
        f"{name} {quantity(key, member[key])}"
        for name, key in (("x", "base_x"), ("y", "base_y"), ("heading", "base_yaw_deg"))
    )


def hands_text(names: Iterable[str | None]) -> str:
    """Return the names of hands in words, each once; "" without any.

    >>> hands_text(["left", None, "left"]), hands_text(["left", "right+spoon"])
    ('left hand', 'left and right+spoon hands')
    """
    used = list(dict.fromkeys(name for name in names if name))
    return f"{' and '.join(used)} hand{'s' * (len(used) > 1)}" if used else ""


def member_text(member: Mapping[str, Any]) -> str:
    """Return the base pose, the torso height, the settings of the environment, and the hands.

    Args:
        member: A member, as `tcs select --json` prints it.

    >>> member_text({"base_x": 1.4, "base_y": -1.2, "base_yaw_deg": 0.0, "torso": 0.1})
    'x 1.40 m, y -1.20 m, heading 0 deg, torso 0.10 m'
    """
    rest: list[str]
    rest = [
        f"{axis_name(key)} {quantity(key, value)}"
        for key, value in member.items()
        if not key.startswith("base_") and key not in (HAND, WINDOW)
    ]
    if HAND in member:
        rest.append(hands_text(member[HAND]))
    return ", ".join([base_pose_text(member), *rest])


def stop_windows(members: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a sentence for each stop of a set whose parking window is known.

    Args:
        members: The members, as `tcs select --json` prints them.

    >>> stop_windows([{"base_x": 1.4, "window": {"x": 0.04, "y": 0.06, "yaw_deg": 5.0}}])
    ['Stop 1 may stand up to 4 cm off in x, 6 cm in y, 5 degrees in heading.']
    """
    return [
        f"Stop {number} may stand {'up to ' * any(member[WINDOW].values())}"
        f"{window_text(member[WINDOW])}."
        for number, member in enumerate(members, start=1)
        if WINDOW in member
    ]


def setting_text(key: str, value: float) -> str:
    """Return the value of one axis, with all its digits.

    >>> setting_text("person_y", 0.025), setting_text("head_tilt_deg", 5.0)
    ('person y 0.025 m', 'head tilt 5 deg')
    """
    return f"{axis_name(key)} {value:g} {axis_unit(key)}"


def settings_text(values: Mapping[str, float]) -> str:
    """Return the values of several axes, with all their digits.

    >>> settings_text({"person_y": 0.025, "head_tilt_deg": 5.0})
    'person y 0.025 m, head tilt 5 deg'
    """
    return ", ".join(setting_text(key, value) for key, value in values.items())


def deviation_text(key: str, value: float) -> str:
    """Return the difference between an observed value and the scored one.

    >>> deviation_text("person_y", -0.02), deviation_text("person_y", -0.0)
    ('observed person y differs by -0.02 m', 'observed person y is the scored one')
    """
    if not value:
        return f"observed {axis_name(key)} is the scored one"
    return f"observed {axis_name(key)} differs by {value:+g} {axis_unit(key)}"

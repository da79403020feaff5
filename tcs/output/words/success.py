"""Words for what is done: under error, with motions, and for the people of a population."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tcs.output.words.reasons import pair_text

BODY_COLLISIONS = {
    "all": "of the robot's body count, those of the base with the furniture too",
    "paper": "of the robot's body count, except those of the base with the furniture",
    "none": "of the robot's body are ignored",
}
"""What the collisions of base, torso, head and other arm mean for a sample."""


DONE_BY = {
    "motion": "a goal is done if a posture there is approached by a motion from rest, and back",
    "approach": "a goal is done if a posture there can be approached",
    "posture": "a goal is done if a posture reaches it",
}
"""By what a goal is done in a sample."""


def success_text(success: str, *, of_rooms: bool) -> str:
    """Return what a success under error means.

    >>> success_text("95 %", of_rooms=True)
    'all goals done in 95 % of rooms'
    """
    return f"all goals done in {success} of rooms" if of_rooms else f"{success} of the goals"


def error_width(error: Mapping[str, Any]) -> str:
    """Return the width of the distribution of an error.

    >>> error_width({"distribution": "normal", "std": 0.05})
    'standard deviation 0.05 m'
    >>> error_width({"distribution": "uniform", "half_width_deg": 5.0})
    'uniform ±5 deg'
    """
    (key, width) = next((k, v) for k, v in error.items() if k != "distribution")
    unit = "deg" if key.endswith("_deg") else "m"
    sign = "standard deviation " if error["distribution"] == "normal" else "uniform ±"
    return f"{sign}{width:g} {unit}"


NOT_DONE_TEXTS = {
    "unreached": "no posture reaches it",
    "rest_blocked": "something touches the robot while its arm rests",
    "approach_limits": "joint or velocity limits prevent its approach",
    "approach_blocked": "its approach is blocked",
    "no_path": "no path was found",
}
"""Why a goal is not done, by the reason in plans and motion files."""


def place_text(place: str | int) -> str:
    """Return the begin or end of a segment, as plans have it in JSON.

    >>> place_text("rest"), place_text(3)
    ('rest', 'goal 4')
    """
    return place if isinstance(place, str) else f"goal {place + 1}"


def not_done_text(goal: Mapping[str, Any]) -> str:
    """Return why a goal is not done, as one line.

    Args:
        goal: The result of a goal that is not done, as plans have it in JSON.
    """
    text = f"goal {goal['goal'] + 1}: {NOT_DONE_TEXTS[goal['reason']]}"
    if goal["segment"]:
        text += f" ({goal['segment']}, tried for {goal['seconds']:.2f} s)"
    if goal["pair"] is not None:
        text += f"; most often {pair_text(goal['pair'])}"
    return text


MEASURES: Mapping[str, str] = {
    "abdominalextensiondepthsitting": "abdominal depth, seated",
    "biacromialbreadth": "shoulder breadth",
    "bicepscircumferenceflexed": "girth of the upper arm",
    "buttockdepth": "buttock depth",
    "buttockkneelength": "buttock to knee",
    "calfcircumference": "girth of the calf",
    "chestdepth": "chest depth",
    "footbreadthhorizontal": "foot breadth",
    "footlength": "foot length",
    "forearmcircumferenceflexed": "girth of the forearm",
    "forearmhandlength": "elbow to fingertip",
    "handbreadth": "hand breadth",
    "handlength": "hand length",
    "headbreadth": "head breadth",
    "headlength": "head length",
    "hipbreadthsitting": "hip breadth, seated",
    "kneeheightsitting": "knee height, seated",
    "lateralmalleolusheight": "ankle height",
    "neckcircumference": "girth of the neck",
    "shoulderelbowlength": "shoulder to elbow",
    "sittingheight": "seated height",
    "thighclearance": "thigh height, seated",
    "tragiontopofhead": "ear to top of the head",
    "waistbreadth": "waist breadth",
}
"""Names of the measures that sizes of the person's model depend on."""


def measure_name(measure: str) -> str:
    """Return the name of a measure in words.

    >>> measure_name("hipbreadthsitting"), measure_name("stature")
    ('hip breadth, seated', 'stature')
    """
    return MEASURES.get(measure, measure)


def part_text(part: Mapping[str, Any]) -> str:
    """Return the people between limits in words.

    Args:
        part: An entry of `parts` of the JSON of `tcs population`.

    >>> part_text({"conditions": [{"measure": "chestdepth", "is": ">", "limit": 0.31}]})
    'chest depth above 0.310 m'
    >>> part_text({"conditions": []})
    'everybody'
    """
    texts = [
        f"{measure_name(one['measure'])} {'above' if one['is'] == '>' else 'up to'} "
        f"{one['limit']:.3f} m"
        for one in part["conditions"]
    ]
    return ", ".join(texts) or "everybody"

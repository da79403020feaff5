"""Words for the parts of a population."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

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

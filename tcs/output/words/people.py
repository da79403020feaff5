"""Words for the person for whom something was scored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

NOUNS = {"female": "a woman", "male": "a man"}
CHILDREN = {"female": "a girl", "male": "a boy"}


def person_text(entry: Mapping[str, Any]) -> str:
    """Return for whom a file was scored, in a few words.

    Args:
        entry: The entry `person` of a score file's metadata.

    >>> person_text({"sex": "female", "stature": 1.525, "stature_percentile": 5.0, "mass": 58.2,
    ...              "mass_percentile": 18.8})
    'a woman of 1.525 m (5th percentile) and 58.2 kg (19th percentile)'
    >>> person_text({"sex": "male", "age": 6, "stature": 1.16, "stature_percentile": 50,
    ...              "mass": 20.8, "mass_percentile": 50})
    'a boy of 6 years, 1.160 m (50th percentile) and 20.8 kg (50th percentile)'
    """
    who = "the average man"
    if "sex" in entry:
        stature, mass = (_ordinal(entry[f"{key}_percentile"]) for key in ("stature", "mass"))
        who = f"{NOUNS[entry['sex']]} of "
        if "age" in entry:
            who = f"{CHILDREN[entry['sex']]} of {entry['age']:g} years, "
        who += (
            f"{entry['stature']:.3f} m ({stature} percentile) and "
            f"{entry['mass']:.1f} kg ({mass} percentile)"
        )
    posture = entry.get("posture")
    return who if posture is None else f"{who}, {posture_text(posture)}"


def posture_text(posture: Mapping[str, Any]) -> str:
    """Return a posture in a few words.

    Args:
        posture: The entry `posture` of a person.

    >>> posture_text({"name": None, "angles_deg": {"head_turn": 30.0, "head_tilt": -5.0}})
    'head turn 30 deg, head tilt -5 deg'
    >>> posture_text({"name": "arms_apart", "angles_deg": {}})
    'posture arms apart'
    """
    name = posture["name"]
    angles = ", ".join(
        f"{joint.replace('_', ' ')} {angle:g} deg" for joint, angle in posture["angles_deg"].items()
    )
    if name is None:
        return angles
    in_words = f"posture {name.replace('_', ' ')}"
    return f"{in_words} ({angles})" if angles else in_words


def _ordinal(percentile: float) -> str:
    """Return a percentile as an ordinal number.

    >>> [_ordinal(p) for p in (1, 2.4, 12, 43, 99.97)]
    ['1st', '2nd', '12th', '43rd', '99.97th']
    """
    if not 0.5 <= percentile <= 99.5:
        return f"{percentile:g}th"
    number = round(percentile)
    ending = "th" if number in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"

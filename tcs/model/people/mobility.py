"""Mobility: the fraction of the normal range of motion that a joint of the person has left."""

from __future__ import annotations

from collections.abc import Mapping

from tcs.errors import DataFileError, UnknownNameError
from tcs.model.people.joints import JOINTS, SIDES

MOBILITY = "_mobility"
"""Ending of a key whose value is the fraction of its range that a joint has left."""
RANGE_ENDS = ("_least_deg", "_greatest_deg")
"""Endings of keys whose values are the ends of the range of a joint [deg]."""
_REGIONS = {"head": "neck"}
"""Regions of the body that are not the first word of the names of their joints."""


def names_of(joint: str) -> tuple[str, ...]:
    """Return the names under which the mobility of a joint may be given, the closest first.

    >>> names_of("shoulder_flexion_left")
    ('shoulder_flexion_left', 'shoulder_flexion', 'shoulder_left', 'shoulder')
    >>> names_of("head_turn")
    ('head_turn', 'neck')
    """
    word = joint.partition("_")[0]
    region = _REGIONS.get(word, word)
    for side in SIDES:
        if joint.endswith(f"_{side}"):
            return joint, joint.removesuffix(f"_{side}"), f"{region}_{side}", region
    return joint, region


def mobility_of(joint: str, given: Mapping[str, float]) -> float:
    """Return the mobility of a joint, 1 where nothing is given.

    Args:
        joint: Name of the joint.
        given: Numbers of a person by key.
    """
    for name in names_of(joint):
        if name + MOBILITY in given:
            return float(given[name + MOBILITY])
    return 1.0


def check_mobility(key: str, value: float, where: str) -> None:
    """Check a key that ends in MOBILITY.

    Raises:
        UnknownNameError: If no joint has that name.
        DataFileError: If the value is not 0 to 1.
    """
    known = {name for joint in JOINTS for name in names_of(joint)}
    if (name := key.removesuffix(MOBILITY)) not in known:
        raise UnknownNameError("joint of the person", name, known, where=where)
    if not 0.0 <= value <= 1.0:
        raise DataFileError(
            f"{where}: '{key}' is {value:g}; must be 0 to 1, the fraction of the normal range of "
            "motion."
        )

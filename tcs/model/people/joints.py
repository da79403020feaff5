"""Joints of the person: their names, the ranges in which people move them, and named postures.

Angles are from the anatomical position: arms and legs straight along the trunk, palms at the
thighs, the head upright. Positive angles are those that the names say: flexion, abduction, outward
rotation of the shoulder, supination of the forearm, turn and lean to the person's left, tilt of the
face upward.

Source of the ranges, `models/people/range_of_motion.csv`, means of healthy people:

- cfr: normal range of motion of the spine, 38 CFR 4.71a, general rating formula, note 2.
- boone, macedo, walker: Boone and Azen (men up to 54 years), Macedo and Magee (women of 18 to 59
  years) and Walker et al. (women and men of 65 to 85 years), as tabulated together by Norkin and
  White, Measurement of Joint Motion, table A.1.
- cdc: CDC Normal Joint Range of Motion Study (Soucie et al., Haemophilia 17, 2011).
- usual: the usual figures of clinical texts, where no measurement by age and sex was at hand.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from tcs.errors import DataFileError, UnknownNameError
from tcs.files.documents import AngleDeg, Document, checked, read_mapping
from tcs.files.paths import data_folder

SIDES = ("left", "right")
OF_HEAD_AND_TRUNK = ("head_turn", "head_tilt", "head_lean", "trunk_lean", "trunk_flexion")
"""Joints that there is one of."""
OF_LIMBS = (
    "shoulder_flexion",
    "shoulder_abduction",
    "shoulder_rotation",
    "elbow_flexion",
    "forearm_rotation",
    "hip_flexion",
    "hip_abduction",
    "knee_flexion",
)
"""Joints on either side; their names end in a side."""
JOINTS = (*OF_HEAD_AND_TRUNK, *(f"{joint}_{side}" for joint in OF_LIMBS for side in SIDES))
"""All joints of the person."""
UNSTATED_AGE = 40.0
"""Age that ranges of motion are taken at if none is given [years]."""
_UNSTATED_SEX = "male"

Range = tuple[float, float]
"""Least and greatest angle [deg]."""


class NamedPosture(Document):
    """A posture that has a name."""

    title: str
    """The posture in words."""
    joints: Mapping[str, AngleDeg]
    """Angles by joint [deg]."""
    lying: bool = False
    """Whether only a person who lies can have it."""


@dataclass(frozen=True)
class _Row:
    """A line of the table of ranges."""

    joint: str
    sex: str
    ages: Range
    angles: Range


@cache
def named_postures() -> Mapping[str, NamedPosture]:
    """Return the postures that have a name.

    >>> named_postures()["head_leaning_left"].joints["head_lean"]
    25.0
    """
    path = data_folder() / "models" / "people" / "postures.yaml"
    found = {}
    for name, content in read_mapping(path, f"'{path}'", DataFileError, known=()).items():
        found[name] = checked(content, NamedPosture, f"'{path}', '{name}'", DataFileError)
    return found


def posture_named(name: str, where: str) -> NamedPosture:
    """Return a named posture.

    Raises:
        UnknownNameError: If there is none of that name.
    """
    if name not in named_postures():
        raise UnknownNameError("posture", name, named_postures(), where=where)
    return named_postures()[name]


def range_of_motion(joint: str, sex: str | None = None, age: float | None = None) -> Range:
    """Return the mean range of motion of healthy people [deg].

    Args:
        joint: One of JOINTS.
        sex: Sex, by default male, as the papers' man.
        age: Age [years], by default UNSTATED_AGE.

    Raises:
        UnknownNameError: If there is no such joint.

    >>> range_of_motion("elbow_flexion_left", "female", 70)
    (4.0, 143.0)
    """
    if joint not in JOINTS:
        raise UnknownNameError("joint of the person", joint, JOINTS)
    plain = joint.removesuffix("_left").removesuffix("_right")
    years = UNSTATED_AGE if age is None else age
    for row in _table():
        lower, upper = row.ages
        # Ages are in completed years.
        if row.joint == plain and row.sex in ("any", sex or _UNSTATED_SEX):
            if lower <= years < upper + 1.0:
                return row.angles
    raise DataFileError(f"range_of_motion.csv has no line for '{plain}' at {years:g} years.")


@cache
def _table() -> tuple[_Row, ...]:
    path = data_folder() / "models" / "people" / "range_of_motion.csv"
    with path.open(newline="", encoding="utf-8") as file:
        return tuple(
            _Row(
                row["joint"],
                row["sex"],
                (float(row["age_from"]), float(row["age_to"])),
                (float(row["least_deg"]), float(row["greatest_deg"])),
            )
            for row in csv.DictReader(file)
        )

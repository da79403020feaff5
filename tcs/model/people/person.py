"""Who the person is: sex, age, known measures, posture and mobility, from files and options."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from tcs.errors import DataFileError, UnknownNameError
from tcs.files.documents import Document, Number, checked, read_mapping
from tcs.model.people.bodies import Body, body
from tcs.model.people.joints import (
    JOINTS,
    SIDES,
    UNSTATED_AGE,
    Range,
    posture_named,
    range_of_motion,
)
from tcs.model.people.survey import MASS

PERCENTILE = "_percentile"
"""Ending of a key whose value is a percentile of the measure before it."""
ANGLE = "_deg"
"""Ending of a key whose value is the angle of the joint before it [deg]."""
MODEL = "model"
WORDS = ("sex", MODEL, "posture")
"""Keys whose values are words."""
_ROUNDING = 1e-9
"""Tolerance of ranges [deg]."""
MOBILITY = "_mobility"
"""Ending of a key whose value is the fraction of its range that a joint has left."""
RANGE_ENDS = ("_least_deg", "_greatest_deg")
"""Endings of keys whose values are the ends of the range of a joint [deg]."""
_REGIONS = {"head": "neck"}
"""Regions of the body that are not the first word of the names of their joints."""


class Person(Document):
    """The person of an environment: which model it is, whose body it has, in which posture.

    Every further key is a number: a measure of the survey [m; kg for the mass], or with the ending
    `_percentile` its percentile among people of the same sex; the angle of a joint, `JOINT_deg`; or
    how far a joint moves, `JOINT_mobility`, `JOINT_least_deg` and `JOINT_greatest_deg`.

    >>> Person(sex="female", stature_percentile=5).body().stature
    1.525
    >>> Person(posture="head_leaning_left", head_tilt_deg=0).angles
    {'head_lean': 25.0, 'head_tilt': 0.0}
    """

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Number]

    model: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_ -]*$")] | None = None
    """Name of the model that is the person; by default the model named "person"."""
    sex: Literal["female", "male"] | None = None
    """Sex; without it the model keeps the sizes of its file."""
    age: Annotated[Number, Field(ge=4.0, le=120.0)] | None = None
    """Age [years], which ranges of motion depend on; below 18 years also the sizes of the body."""
    posture: str | None = None
    """Name of a posture. In a file it may also be a mapping: `name`, and angles `JOINT_deg`."""

    @model_validator(mode="before")
    @classmethod
    def _angles_at_the_top(cls, content: Any) -> Any:
        """Move the angles under `posture` to the keys of the person."""
        if not isinstance(content, Mapping) or not isinstance(content.get("posture"), Mapping):
            return content
        posture = dict(content["posture"])
        found = {key: value for key, value in content.items() if key != "posture"}
        if "name" in posture:
            found["posture"] = posture.pop("name")
        for key, value in posture.items():
            if not str(key).endswith(ANGLE):
                raise ValueError(f"posture: '{key}' must be 'name' or an angle, JOINT_deg")
            if key in found:
                raise ValueError(f"'{key}' is given twice; give it under 'posture' or beside it")
            found[key] = value
        return found

    @property
    def has_body(self) -> bool:
        """Whether the model is resized to a body."""
        return self.sex is not None or bool(self.known)

    @property
    def has_posture(self) -> bool:
        """Whether a posture other than that of the model's file is given."""
        return self.posture is not None or bool(self.angles)

    @property
    def _numbers(self) -> Mapping[str, float]:
        return self.__pydantic_extra__ or {}

    @property
    def known(self) -> Mapping[str, float]:
        """What is known of the body: values by the names of measures and their percentiles."""
        return {k: v for k, v in self._numbers.items() if not k.endswith((ANGLE, MOBILITY))}

    @property
    def angles(self) -> Mapping[str, float]:
        """Angles of joints [deg]: those of the named posture, and those given, which replace them.

        Raises:
            UnknownNameError: If there is no posture of that name.
        """
        named = {} if self.posture is None else posture_named(self.posture, "person").joints
        given = {
            key.removesuffix(ANGLE): float(value)
            for key, value in self._numbers.items()
            if key.endswith(ANGLE) and not key.endswith(RANGE_ENDS)
        }
        return {**named, **given}

    def without_body(self) -> Person:
        """Return the person in the same posture, of the size of the model's file."""
        given = self.model_dump(exclude_none=True)
        kept = {key: value for key, value in given.items() if key not in (*self.known, "sex")}
        return Person.model_validate(kept)

    def range_of(self, joint: str) -> Range:
        """Return the least and the greatest angle of a joint for this person [deg].

        It is the range of healthy people of their sex and age, times the mobility of the joint,
        unless its ends are given.

        Raises:
            UnknownNameError: If there is no such joint.
        """
        least, greatest = range_of_motion(joint, self.sex, self.age)
        factor = mobility_of(joint, self._numbers)
        ends = (factor * least, factor * greatest)
        given = (
            self._numbers.get(joint + end, at) for end, at in zip(RANGE_ENDS, ends, strict=True)
        )
        lower, upper = map(float, given)
        return lower, upper

    def check_posture(self, where: str = "person") -> None:
        """Check the names of joints, and that every angle is in the range of the person.

        Raises:
            UnknownNameError: If there is no joint or posture of a name.
            DataFileError: If an angle or a mobility is out of range.
        """
        if self.posture is not None:
            posture_named(self.posture, where)
        for key, value in self._numbers.items():
            if key.endswith(MOBILITY):
                check_mobility(key, value, where)
            elif key.endswith(ANGLE):
                ending = next((end for end in RANGE_ENDS if key.endswith(end)), ANGLE)
                if (joint := key.removesuffix(ending)) not in JOINTS:
                    raise UnknownNameError("joint of the person", joint, JOINTS, where=where)
        for joint, angle in self.angles.items():
            self.check_angle(joint, angle, f"{where}: '{joint}{ANGLE}'")

    def check_angle(self, joint: str, angle: float, where: str) -> None:
        """Check that an angle of a joint is in the range of the person [deg].

        Raises:
            DataFileError: If it is not.
        """
        lower, upper = self.range_of(joint)
        if lower - _ROUNDING <= angle <= upper + _ROUNDING:
            return
        who = f"{self.sex or 'male'}, {UNSTATED_AGE if self.age is None else self.age:g} years"
        raise DataFileError(
            f"{where} is {angle:g} deg; this person ({who}) moves it from {lower:.4g} to "
            f"{upper:.4g} deg. Choose an angle within, or give '{joint}{RANGE_ENDS[0]}' and "
            f"'{joint}{RANGE_ENDS[1]}'."
        )

    def body(self, where: str = "person") -> Body:
        """Return all measures of the person.

        Args:
            where: Location of the person for messages.

        Raises:
            UnknownNameError: If there is no measure of a name.
            DataFileError: If the sex is missing, a value is out of range or a measure is given
                twice.
        """
        if self.sex is None:
            raise DataFileError(f"{where}: 'sex' is missing. Give female or male.")
        percentiles = {
            name.removesuffix(PERCENTILE): value
            for name, value in self.known.items()
            if name.endswith(PERCENTILE)
        }
        measures = {k: v for k, v in self.known.items() if not k.endswith(PERCENTILE)}
        try:
            return body(self.sex, age=self.age, percentiles=percentiles, measures=measures)
        except UnknownNameError as error:
            known = (*error.known, MODEL, "sex")
            raise UnknownNameError(error.what, error.name, known, where=where) from None
        except DataFileError as error:
            raise DataFileError(f"{where}{str(error).removeprefix('person')}") from None

    def to_json(self) -> dict[str, Any]:
        """Return what is given of the person, and stature and mass, as plain containers."""
        found: dict[str, Any] = {"given": self.model_dump(exclude_none=True)}
        if self.has_body:
            of_body = self.body()
            found |= {
                "sex": of_body.sex,
                **({} if of_body.age is None else {"age": of_body.age}),
                "stature": round(of_body.stature, 4),
                "stature_percentile": round(of_body.percentiles["stature"], 1),
                "mass": round(of_body.mass, 2),
                "mass_percentile": round(of_body.percentiles[MASS], 1),
            }
        if self.has_posture:
            found["posture"] = {"name": self.posture, "angles_deg": dict(self.angles)}
        return found


def _of_name(value: object) -> object:
    """Return the entry of a person of whom the name of the model is given."""
    return {MODEL: value} if isinstance(value, str) else value


PersonEntry = Annotated[Person, BeforeValidator(_of_name)]
"""A person in a file; a plain text is the name of the model."""

PersonLike = Person | Mapping[str, Any] | str | Path
"""A person, its keys and values, or the path of a YAML file of them."""


def load_person(person: PersonLike, *, where: str = "person") -> Person:
    """Return a person with a body, a posture, or both.

    Args:
        person: A person, the keys and values of one, or the path of a YAML file of them.
        where: Location of the person for messages, unless it is a file.

    Raises:
        UnknownNameError: If there is no measure of a name.
        DataFileError: If the file cannot be read, the sex is missing, a value is out of range or a
            measure is given twice.

    >>> load_person({"posture": {"head_turn_deg": 30}}).angles
    {'head_turn': 30.0}
    >>> load_person({"sex": "male", "mass_percentile": 95}).body().mass
    110.695
    """
    if isinstance(person, Person):
        found = person
    else:
        if isinstance(person, str | Path):
            where = f"person file '{person}'"
            person = person_keys(person)
        found = checked(person, Person, where, DataFileError)
    found.check_posture(where)
    if found.has_body or not found.has_posture:
        found.body(where)
    return found


def person_keys(path: str | Path) -> dict[str, Any]:
    """Return the keys and values of a file that describes a person, unchecked.

    Raises:
        DataFileError: If the file cannot be read or is no mapping.
    """
    where = f"person file '{path}'"
    return read_mapping(Path(path), where, DataFileError, known=("sex", "stature", MASS, "posture"))


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

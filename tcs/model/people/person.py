"""Who the person is: sex and the measures that are known of them, from files and options."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, ConfigDict, Field

from tcs.errors import DataFileError, UnknownNameError
from tcs.files.documents import Document, Number, checked, read_mapping
from tcs.model.people.bodies import Body, body
from tcs.model.people.survey import MASS

PERCENTILE = "_percentile"
"""Ending of a key whose value is a percentile of the measure before it."""
MODEL = "model"


class Person(Document):
    """The person of an environment: which model it is, and whose body it has.

    Every further key is a measure of the survey: its value [m; kg for the mass], or with the ending
    `_percentile` its percentile among people of the same sex.

    >>> Person(sex="female", stature_percentile=5).body().stature
    1.525
    """

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Number]

    model: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_ -]*$")] | None = None
    """Name of the model that is the person; by default the model named "person"."""
    sex: Literal["female", "male"] | None = None
    """Sex; without it the model keeps the sizes of its file."""

    @property
    def has_body(self) -> bool:
        """Whether the model is resized to a body."""
        return self.sex is not None or bool(self.known)

    @property
    def known(self) -> Mapping[str, float]:
        """What is known of the body: values by the names of measures and their percentiles."""
        return self.__pydantic_extra__ or {}

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
            return body(self.sex, percentiles=percentiles, measures=measures)
        except UnknownNameError as error:
            known = (*error.known, MODEL, "sex")
            raise UnknownNameError(error.what, error.name, known, where=where) from None
        except DataFileError as error:
            raise DataFileError(f"{where}{str(error).removeprefix('person')}") from None

    def to_json(self) -> dict[str, Any]:
        """Return what is given of the person, and stature and mass, as plain containers."""
        found = self.body()
        return {
            "given": self.model_dump(exclude_none=True),
            "sex": found.sex,
            "stature": round(found.stature, 4),
            "stature_percentile": round(found.percentiles["stature"], 1),
            "mass": round(found.mass, 2),
            "mass_percentile": round(found.percentiles[MASS], 1),
        }


def _of_name(value: object) -> object:
    """Return the entry of a person of whom the name of the model is given."""
    return {MODEL: value} if isinstance(value, str) else value


PersonEntry = Annotated[Person, BeforeValidator(_of_name)]
"""A person in a file; a plain text is the name of the model."""

PersonLike = Person | Mapping[str, Any] | str | Path
"""A person, its keys and values, or the path of a YAML file of them."""


def load_person(person: PersonLike, *, where: str = "person") -> Person:
    """Return a person with a body.

    Args:
        person: A person, the keys and values of one, or the path of a YAML file of them.
        where: Location of the person for messages, unless it is a file.

    Raises:
        UnknownNameError: If there is no measure of a name.
        DataFileError: If the file cannot be read, the sex is missing, a value is out of range or a
            measure is given twice.

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
    found.body(where)
    return found


def person_keys(path: str | Path) -> dict[str, Any]:
    """Return the keys and values of a file that describes a person, unchecked.

    Raises:
        DataFileError: If the file cannot be read or is no mapping.
    """
    where = f"person file '{path}'"
    return read_mapping(Path(path), where, DataFileError, known=("sex", "stature", MASS))

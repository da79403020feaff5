"""Files of measured people: a CSV table with a row for each person."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

import numpy as np

from tcs.errors import DataFileError
from tcs.files.reading import read_text
from tcs.model.people.bodies import Bodies, Body
from tcs.model.people.person import load_person
from tcs.model.people.survey import SEXES, load_survey
from tcs.model.random_streams import MAX_SAMPLES

_MAX_BYTES = 64_000_000
"""Greatest size of a file: a hundred thousand people with all measures."""


def load_people(path: str | Path) -> Bodies:
    """Return the people of a CSV file.

    The first row names the columns: `sex`, `age` [years] of children, and measures or their
    percentiles as keys of a person in an environment file. What a row leaves empty is filled in as
    of a single person.

    Args:
        path: The file.

    Raises:
        UnknownNameError: If a column is no measure.
        DataFileError: If the file cannot be read, has no rows, or a value is missing or out of
            range; the message names the line.
    """
    where = f"people file '{path}'"
    text = read_text(Path(path), where, DataFileError, limit=_MAX_BYTES)
    try:
        lines = list(csv.reader(io.StringIO(text, newline="")))
    except csv.Error as error:
        raise DataFileError(f"{where} is not valid CSV: {error}.") from error
    header = [name.strip() for name in lines[0]] if lines else []
    if "sex" not in header or len(set(header)) < len(header):
        raise DataFileError(
            f"{where}: the first line must name each column once, 'sex' and measures, e.g. "
            "sex,stature,mass."
        )
    people = [
        _person(header, cells, f"{where}, line {number}")
        for number, cells in enumerate(lines[1:], 2)
        if cells
    ]
    if not 1 <= len(people) <= MAX_SAMPLES:
        raise DataFileError(f"{where} has {len(people)} people; must be 1 to {MAX_SAMPLES:,}.")
    return _bodies(people)


def _person(header: list[str], cells: list[str], where: str) -> Body:
    """Return the body of one row."""
    if len(cells) != len(header):
        raise DataFileError(f"{where} has {len(cells)} cells; must have {len(header)}.")
    given: dict[str, str | float] = {}
    for name, cell in zip(header, cells, strict=True):
        if name == "sex":
            given[name] = cell.strip()
        elif cell.strip():
            given[name] = _number(cell, f"{where}, '{name}'")
    return load_person(given, where=where).body(where)


def _number(cell: str, where: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise DataFileError(f"{where} is '{cell[:40]}'; must be a number.")
    return number


def _bodies(people: list[Body]) -> Bodies:
    measures = load_survey(SEXES[0]).measures
    return Bodies(
        measures,
        np.array([person.sex == "male" for person in people]),
        np.array([[person.measures[name] for name in measures] for person in people]),
        tuple(person.age for person in people),
    )

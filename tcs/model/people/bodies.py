"""Bodies: all measures of one person or of many, from some of them or drawn at random.

Each measure has its own distribution; the normal scores of all are jointly normal with the
correlation of the survey (a Gaussian copula). What is not known of a person is filled in by the
conditional mean of its normal scores.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import DataFileError, UnknownNameError
from tcs.kernel.arrays import FloatArray
from tcs.model.people.children import ADULT, survey_at
from tcs.model.people.survey import (
    FARTHEST_SCORE,
    MASS,
    SEXES,
    Survey,
    load_survey,
    percentile_of,
    score_of,
)
from tcs.model.random_streams import check_draws, named_generator

ANY = "any"
"""Both sexes in equal parts."""
_RANGE = (0.1, 99.9)
"""Least and greatest percentile; the survey's own end at 0.5 and 99.5."""


@dataclass(frozen=True)
class Body:
    """All measures of one person."""

    sex: str
    """One of SEXES."""
    measures: Mapping[str, float]
    """Values of all measures, by their names in the survey [m; kg for the mass]."""
    percentiles: Mapping[str, float]
    """Percentile of each among people of that sex and age, 0 to 100."""
    age: float | None = None
    """Age of a child [years]; None of an adult."""

    @property
    def stature(self) -> float:
        """Height of the person standing [m]."""
        return self.measures["stature"]

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.measures[MASS]

    def to_json(self) -> dict[str, Any]:
        """Return sex, age of a child, measures and percentiles as plain containers."""
        return {
            "sex": self.sex,
            **({} if self.age is None else {"age": self.age}),
            "measures": dict(self.measures),
            "percentiles": {name: round(p, 2) for name, p in self.percentiles.items()},
        }


@dataclass(frozen=True, eq=False)
class Bodies:
    """Measures of N people."""

    measures: tuple[str, ...]
    """Names of the M measures, in the order of the columns."""
    is_male: NDArray[np.bool_]
    """Whether each is male, shape (N,)."""
    values: FloatArray
    """Values [m; kg for the mass], shape (N, M)."""
    ages: tuple[float | None, ...] | None = None
    """Age of each child [years], None of an adult; None if all are adults."""

    def __len__(self) -> int:
        """Return the number of people."""
        return len(self.values)

    def __getitem__(self, number: int) -> Body:
        """Return one of them."""
        age = None if self.ages is None else self.ages[number]
        survey = survey_at("male" if self.is_male[number] else "female", age)
        values = self.values[number]
        scores = [survey.score(i, float(values[i])) for i in range(len(values))]
        return _body(survey, values, np.array(scores), age)


def body(
    sex: str,
    *,
    age: float | None = None,
    percentiles: Mapping[str, float] | None = None,
    measures: Mapping[str, float] | None = None,
) -> Body:
    """Return all measures of a person of whom some are known.

    The normal scores z of the others are their conditional mean, with R their correlation,

        z_u = R_uk R_kk^-1 z_k,

    so that with nothing known every measure is at its median.

    >>> tall = body("male", percentiles={"stature": 95})
    >>> tall.stature, tall.percentiles["headbreadth"] < 60
    (1.87, True)

    Args:
        sex: One of SEXES.
        age: Age [years]; by default that of an adult.
        percentiles: Percentile of each known measure, 0.1 to 99.9, among people of that age.
        measures: Measured values [m; kg for the mass]. A name is in one of the two only.

    Raises:
        UnknownNameError: If there is no such sex or measure.
        DataFileError: If a value or percentile is out of range, a measure is given twice, or the
            age is below that of the youngest.
    """
    age = age if age is not None and age < ADULT else None
    survey = survey_at(sex, age)
    known: dict[int, float] = {}
    for name, percentile in (percentiles or {}).items():
        _once(known, survey.index(name), name)
        known[survey.index(name)] = float(score_of(np.array(_checked(name, percentile))))
    exact = {}
    for name, value in (measures or {}).items():
        number = survey.index(name)
        _once(known, number, name)
        known[number] = _measured(survey, number, value, age)
        exact[number] = float(value)
    scores = _filled_in(survey, known)
    values = survey.values(scores)
    # A measure as it was given, not as it comes back from its percentile.
    for number, value in exact.items():
        values[number] = value
    return _body(survey, values, scores, age)


def draw_bodies(number: int, *, sex: str = ANY, age: float | None = None, seed: int = 0) -> Bodies:
    """Return people drawn at random.

    The first hundred of a thousand are a hundred of the same seed.

    Args:
        number: Number of people.
        sex: One of SEXES, or "any": women and men in turn.
        age: Age of all [years]; by default that of an adult.
        seed: Seed of the random numbers.

    Raises:
        UnknownNameError: If the sex is unknown.
        TcsError: If the number, the age or the seed is out of range.
    """
    check_draws(number, seed)
    if sex not in (*SEXES, ANY):
        raise UnknownNameError("sex", sex, (*SEXES, ANY))
    is_male = np.arange(number) % 2 == 1 if sex == ANY else np.full(number, sex == "male")
    values = np.empty((number, len(load_survey(SEXES[0]).measures)))
    for one, chosen in (("female", ~is_male), ("male", is_male)):
        survey = survey_at(one, age)
        normal = named_generator(seed, f"bodies/{one}").standard_normal(
            (int(chosen.sum()), len(survey.measures))
        )
        values[chosen] = survey.values(normal @ np.linalg.cholesky(survey.correlation).T)
    ages = (age,) * number if age is not None and age < ADULT else None
    return Bodies(load_survey(SEXES[0]).measures, is_male, values, ages)


def _body(survey: Survey, values: FloatArray, scores: FloatArray, age: float | None) -> Body:
    percentiles = percentile_of(scores).tolist()
    return Body(
        survey.sex,
        dict(zip(survey.measures, values.tolist(), strict=True)),
        dict(zip(survey.measures, percentiles, strict=True)),
        age,
    )


def _filled_in(survey: Survey, known: Mapping[int, float]) -> FloatArray:
    """Return the normal scores of all measures: those known, and the conditional mean of others."""
    numbers, z = list(known), np.array(list(known.values()))
    if not numbers:
        return np.zeros(len(survey.measures))
    R = survey.correlation
    among = R[np.ix_(numbers, numbers)]
    scores = np.asarray(R[:, numbers] @ np.linalg.solve(among, z))
    scores[numbers] = z
    return np.clip(scores, -FARTHEST_SCORE, FARTHEST_SCORE)


def _once(known: Mapping[int, float], number: int, name: str) -> None:
    if number in known:
        raise DataFileError(f"person: '{name}' is given twice. Give its percentile or its value.")


def _checked(name: str, percentile: float) -> float:
    """Return a percentile in range."""
    lower, upper = _RANGE
    if not (math.isfinite(percentile) and lower <= percentile <= upper):
        raise DataFileError(
            f"person: percentile of '{name}' is {percentile:g}; must be {lower:g} to {upper:g}."
        )
    return float(percentile)


def _measured(survey: Survey, number: int, value: float, age: float | None) -> float:
    """Return the normal score of a measured value in range."""
    lower, upper = survey.range_of(number)
    name = survey.measures[number]
    if not (math.isfinite(value) and lower <= value <= upper):
        unit = "kg" if name == MASS else "m"
        who = "an adult" if age is None else f"a child of {age:g} years"
        raise DataFileError(
            f"person: '{name}' is {value:g} {unit}; must be {lower:.3g} to {upper:.3g} {unit} for "
            f"{who} who is {survey.sex}."
        )
    return survey.score(number, value)

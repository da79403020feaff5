"""Distributions of body measures of children from 4 years, derived from two published sources.

Stature and mass are those of the CDC growth charts (Kuczmarski et al., 2000 CDC Growth Charts for
the United States, Vital Health Stat 11(246), 2002; public domain), given by L, M and S: at a normal
score z the value is

    M (1 + L S z)^(1/L).

No survey of children has the other measures. Each is that of an adult at the same percentile, times

    f (s / s_a) k,    k = sqrt((m / m_a) / (v s / s_a)^3) for girths, breadths and depths, else 1,

with s, m the median stature and mass of the children and s_a, m_a of the adults. The proportion f
is how much more of the stature the measure is than of an adult, and v that of the cube root of the
volume, both of the Anny body model (Bregier et al., Human Mesh Modeling for Anny Body,
arXiv:2511.03589, on MakeHuman data, CC0) at average weight, measured by `scripts/growth.py`. The
factor k makes them as heavy as the charts say. Correlations are those of adults.
"""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tcs.errors import DataFileError
from tcs.files.paths import data_folder
from tcs.kernel.arrays import FloatArray
from tcs.model.people.survey import MASS, Survey, load_survey

YOUNGEST = 4.0
"""Least age [years]."""
ADULT = 18.0
"""Age from which the measures are those of the survey of adults [years]."""
_FROM_UNIT = {"stature": 0.01, MASS: 1.0}
"""Metres and kilograms in a unit of the growth charts."""


class _Proportion(NamedTuple):
    """How a measure grows."""

    is_soft: bool
    """Whether it is greater of heavier people of the same stature."""
    ages: FloatArray
    """Ages, ascending [years], shape (n,)."""
    factors: FloatArray
    """f at these ages, shape (n,)."""


@cache
def survey_at(sex: str, age: float | None = None) -> Survey:
    """Return the distributions of one sex at an age.

    >>> survey_at("female", 6).values(np.zeros(58))[0].round(3)
    np.float64(1.15)

    Args:
        sex: One of SEXES.
        age: Age [years], by default that of an adult.

    Raises:
        UnknownNameError: If the sex is none of SEXES.
        DataFileError: If the age is below YOUNGEST.
    """
    adults = load_survey(sex)
    if age is None or age >= ADULT:
        return adults
    if not age >= YOUNGEST:
        raise DataFileError(f"person: 'age' is {age:g} years; must be {YOUNGEST:g} or more.")
    median = np.flatnonzero(adults.scores == 0.0)[0]
    grown = {name: _growth(sex, name, age, adults.scores) for name in _FROM_UNIT}
    taller, heavier = (
        grown[name][median] / adults.quantiles[adults.index(name), median] for name in _FROM_UNIT
    )
    proportions = _proportions()
    of_volume = _factor(proportions[sex, MASS], age)
    softer = np.sqrt(heavier / (of_volume * taller) ** 3)
    rows = []
    for name, of_adults in zip(adults.measures, adults.quantiles, strict=True):
        if name in grown:
            rows.append(grown[name])
            continue
        proportion = proportions[sex, name]
        factor = _factor(proportion, age) * taller * (softer if proportion.is_soft else 1.0)
        rows.append(factor * of_adults)
    quantiles = np.array(rows)
    quantiles.flags.writeable = False
    return Survey(sex, adults.measures, adults.scores, quantiles, adults.correlation)


def _growth(sex: str, measure: str, age: float, scores: FloatArray) -> FloatArray:
    """Return stature [m] or mass [kg] at normal scores, shape (K,)."""
    rows = [
        row for row in _rows("cdc_growth.csv") if (row["sex"], row["measure"]) == (sex, measure)
    ]
    ages = [float(row["age"]) for row in rows]
    L, M, S = (np.interp(age, ages, [float(row[key]) for row in rows]) for key in "LMS")
    return np.asarray(_FROM_UNIT[measure] * M * (1.0 + L * S * scores) ** (1.0 / L))


def _factor(proportion: _Proportion, age: float) -> float:
    return float(np.interp(age, proportion.ages, proportion.factors))


@cache
def _proportions() -> dict[tuple[str, str], _Proportion]:
    """Return how each measure grows, by sex and name."""
    found = {}
    for row in _rows("child_proportions.csv"):
        ages = [key for key in row if key.startswith("age_")]
        found[row["sex"], row["measure"]] = _Proportion(
            row["is_soft"] == "1",
            np.array([float(key.removeprefix("age_")) for key in ages]),
            np.array([float(row[key]) for key in ages]),
        )
    return found


@cache
def _rows(name: str) -> tuple[dict[str, str], ...]:
    path: Path = data_folder() / "models" / "people" / name
    with path.open(newline="", encoding="utf-8") as file:
        return tuple(csv.DictReader(file))

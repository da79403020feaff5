"""Distributions of body measures: percentiles of each, and the correlation of their normal scores.

Source: the 2012 Anthropometric Survey of U.S. Army Personnel (ANSUR II; Gordon et al.,
NATICK/TR-15/007, public release): 58 measures of 4,082 men and 1,986 women from 17 to 58 years old.
`models/people` holds statistics of its public table, and no row of it.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import ndtr, ndtri

from tcs.errors import DataFileError, UnknownNameError
from tcs.files.paths import data_folder
from tcs.kernel.arrays import FloatArray

SEXES = ("female", "male")
"""Sexes of the survey."""
MASS = "weightkg"
"""The one measure that is no length: the mass [kg]."""
FARTHEST_SCORE = 4.0
"""Greatest magnitude of a normal score; beyond the survey's 99.5th percentile (2.58) the values
are extrapolated."""


@dataclass(frozen=True, eq=False)
class Survey:
    """Distributions of all measures for one sex."""

    sex: str
    """One of SEXES."""
    measures: tuple[str, ...]
    """Names of the M measures, the survey's own, in the order of all arrays."""
    scores: FloatArray
    """Normal scores of K percentiles, ascending, shape (K,)."""
    quantiles: FloatArray
    """Values at these percentiles [m; kg for the mass], shape (M, K)."""
    correlation: FloatArray
    """Correlation of the normal scores, positive definite, shape (M, M)."""

    def index(self, name: str, *, where: str = "") -> int:
        """Return the number of a measure.

        Args:
            name: Name as in the survey, also with "_", "-" or spaces between its words; `mass` is
                `weightkg`.
            where: Location of the name for the message.

        Raises:
            UnknownNameError: If there is no such measure.
        """
        plain = "".join(c for c in name.lower() if c.isalnum())
        plain = MASS if plain == "mass" else plain
        if plain not in self.measures:
            raise UnknownNameError("body measure", name, (*self.measures, "mass"), where=where)
        return self.measures.index(plain)

    def values(self, scores: FloatArray, measures: Iterable[int] | None = None) -> FloatArray:
        """Return the values of measures with given normal scores.

        Args:
            scores: Normal scores, shape (..., m).
            measures: Numbers of the m measures, by default all M.

        Returns:
            Values [m; kg for the mass], shape (..., m), never decreasing with the score.
        """
        numbers = range(len(self.measures)) if measures is None else tuple(measures)
        columns = [self._value(scores[..., i], number) for i, number in enumerate(numbers)]
        return np.stack(columns, axis=-1)

    def score(self, measure: int, value: float) -> float:
        """Return the normal score of a value of one measure, the inverse of `values`.

        Where several scores have the value, their middle is returned.
        """
        z, x = self._knots(measure)
        lower, upper = (np.searchsorted(x, value, side) for side in ("left", "right"))
        if upper - lower > 1:
            return float(0.5 * (z[lower] + z[upper - 1]))
        return float(np.interp(value, x, z))

    def range_of(self, measure: int) -> tuple[float, float]:
        """Return the least and the greatest value of a measure [m; kg for the mass]."""
        _, x = self._knots(measure)
        return float(x[0]), float(x[-1])

    def _value(self, scores: FloatArray, measure: int) -> FloatArray:
        z, x = self._knots(measure)
        return np.asarray(np.interp(scores, z, x))

    def _knots(self, measure: int) -> tuple[FloatArray, FloatArray]:
        """Return normal scores and values, extrapolated to FARTHEST_SCORE at both ends."""
        z, x = self.scores, self.quantiles[measure]
        # The slope over the outermost two intervals; that of one alone depends on few people.
        below = x[0] - (FARTHEST_SCORE + z[0]) * (x[2] - x[0]) / (z[2] - z[0])
        above = x[-1] + (FARTHEST_SCORE - z[-1]) * (x[-1] - x[-3]) / (z[-1] - z[-3])
        ends = np.array([-FARTHEST_SCORE]), np.array([FARTHEST_SCORE])
        # No body is thinner than half of the thinnest in the survey.
        low = max(float(below), 0.5 * float(x[0]))
        return np.concatenate([ends[0], z, ends[1]]), np.concatenate([[low], x, [above]])


def percentile_of(scores: FloatArray) -> FloatArray:
    """Return the percentiles of normal scores, 0 to 100."""
    return np.asarray(100.0 * ndtr(scores))


def score_of(percentiles: FloatArray) -> FloatArray:
    """Return the normal scores of percentiles, 0 to 100."""
    return np.asarray(ndtri(np.asarray(percentiles) / 100.0))


@cache
def load_survey(sex: str) -> Survey:
    """Return the distributions of one sex.

    Raises:
        UnknownNameError: If the sex is none of SEXES.
        DataFileError: If the data do not fit together.
    """
    if sex not in SEXES:
        raise UnknownNameError("sex", sex, SEXES)
    folder = data_folder() / "models" / "people"
    with (folder / "ansur2_percentiles.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["sex"] == sex]
    keys = [key for key in rows[0] if key.startswith("p")]
    measures = tuple(row["measure"] for row in rows)
    quantiles = np.array([[float(row[key]) for key in keys] for row in rows])
    table = folder / f"ansur2_correlation_{sex}.csv"
    with table.open(newline="", encoding="utf-8") as file:
        header, *lines = csv.reader(file)
    correlation = np.array([[float(cell) for cell in line[1:]] for line in lines])
    if tuple(header[1:]) != measures or tuple(line[0] for line in lines) != measures:
        raise DataFileError(f"'{table}' has other measures than ansur2_percentiles.csv.")
    scores = score_of(np.array([float(key[1:]) for key in keys]))
    for array in (scores, quantiles, correlation):
        array.flags.writeable = False
    return Survey(sex, measures, scores, quantiles, correlation)

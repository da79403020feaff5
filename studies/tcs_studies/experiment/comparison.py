"""Comparison of conditions over the same operators: the tables of both papers, as values.

An operator may lack a value: a trial failed, or a questionnaire was not filled in. A statistic of
one condition takes the operators with a value in it; a test takes those with a value in each
condition that it compares.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tcs.errors import DataFileError
from tcs.kernel.arrays import FloatArray
from tcs_studies.experiment.statistics import (
    GroupStatistics,
    RepeatedMeasures,
    SignedRankTest,
    Tail,
    group_statistics,
    repeated_measures,
    signed_rank_test,
)
from tcs_studies.experiment.trial import END_EFFECTOR, NOVEL

LEAST = 3
"""Least number of operators of a statistic."""
HYPOTHESES: dict[str, Tail] = {
    "accuracy": "greater",
    "time": "two-sided",
    "effort": "greater",
    "usefulness": "less",
    "satisfaction": "less",
}
"""Alternative hypothesis on end-effector control against the novel controller, by measure
(null-space paper, section II.C.6)."""
ANOVA_MEASURES: dict[str, Tail] = {
    "time": "greater",
    "workload": "two-sided",
    "steering_angle": "greater",
    "steering_translation": "greater",
    "arc_length": "two-sided",
}
"""Measures of the ITCM thesis, compared over all conditions, and the alternative hypothesis of the
t tests about each condition against those after it. The thesis has one-tailed tests of time and
steering, and none of workload and arc length."""


def hypothesis(measure: str, first: str, second: str) -> Tail:
    """Return the alternative hypothesis about a condition against another one.

    The null-space paper has hypotheses about its two controllers only; other pairs are compared by
    two-sided tests.
    """
    if (first, second) == (END_EFFECTOR.name, NOVEL.name):
        return HYPOTHESES[measure]
    return "two-sided"


@dataclass(frozen=True, eq=False)
class Comparison:
    """Values of measures by condition, over the same operators."""

    titles: Mapping[str, str]
    """Title of each condition, by name."""
    values: Mapping[str, Mapping[str, FloatArray]]
    """Value of each operator by measure and condition, shape (n,); NaN where there is none."""
    operators: str
    """Who they are, for the captions of tables, e.g. "scripted operators, not people"."""
    learning: Mapping[str, Mapping[str, FloatArray]]
    """Value of each trial by measure and condition, shape (n, trials); NaN where there is none."""
    training: int
    """Number of the first trials that are for training."""

    @property
    def hypotheses(self) -> tuple[str, ...]:
        """Measures with a hypothesis of the null-space paper that were taken."""
        return tuple(name for name in HYPOTHESES if name in self.values)

    @property
    def anova_measures(self) -> tuple[str, ...]:
        """Measures of the ITCM thesis that were taken."""
        return tuple(name for name in ANOVA_MEASURES if name in self.values)

    def sample(self, condition: str, measure: str) -> FloatArray:
        """Return the values of the operators that have one, shape (m,)."""
        values = self.values[measure][condition]
        return values[~np.isnan(values)]

    def paired(self, measure: str, conditions: Sequence[str]) -> list[FloatArray]:
        """Return the values of the operators that have one in each condition, shapes (m,)."""
        table = np.stack([self.values[measure][condition] for condition in conditions])
        return list(table[:, ~np.isnan(table).any(axis=0)])

    def described(self, condition: str, measure: str) -> GroupStatistics | None:
        """Return the statistics of a sample: a row of the null-space paper's Table II.

        Returns:
            The statistics; None of fewer than `LEAST` operators.
        """
        sample = self.sample(condition, measure)
        return group_statistics(sample) if len(sample) >= LEAST else None

    def compared(self, measure: str, first: str, second: str) -> SignedRankTest | None:
        """Return the comparison of two conditions: a row of the null-space paper's Table III.

        Returns:
            The test; None of fewer than `LEAST` operators.
        """
        one, other = self.paired(measure, (first, second))
        if len(one) < LEAST:
            return None
        return signed_rank_test(one, other, tail=hypothesis(measure, first, second))

    def varied(self, measure: str) -> RepeatedMeasures | None:
        """Return the analysis of variance over all conditions, as in the ITCM thesis.

        Returns:
            The analysis; None of fewer than `LEAST` operators or two conditions, and where the
            conditions differ equally for every operator, so that it is undefined.
        """
        samples = dict(zip(self.titles, self.paired(measure, list(self.titles)), strict=True))
        if len(samples) < 2 or min(len(sample) for sample in samples.values()) < LEAST:
            return None
        try:
            return repeated_measures(samples, tail=ANOVA_MEASURES[measure])
        except DataFileError:
            return None

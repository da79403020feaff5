"""Statistical tests: normality, equal variance, signed ranks, repeated measures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any, Literal

import numpy as np

from tcs.errors import DataFileError
from tcs.kernel.arrays import FloatArray

Tail = Literal["greater", "less", "two-sided"]
"""Alternative hypothesis about the first sample against the second."""


@dataclass(frozen=True, slots=True)
class GroupStatistics:
    """Statistics of the sample of one condition: a row of the paper's Table II, and normality."""

    count: int
    median: float
    mean: float
    std: float
    """Standard deviation with n - 1 degrees of freedom."""
    shapiro_w: float
    """Statistic of the Shapiro-Wilk test of normality."""
    shapiro_p: float
    """Its p value; 1 if all values are equal."""
    francia_w: float
    """Statistic of the Shapiro-Francia test of normality."""
    francia_p: float
    """Its p value; 1 if all values are equal, NaN for a sample of fewer than five values."""


def group_statistics(sample: FloatArray) -> GroupStatistics:
    """Return the statistics of a sample.

    Args:
        sample: The values, shape (n,), n >= 3.

    Raises:
        DataFileError: If there are fewer than three values, or one is not finite.
    """
    from scipy import stats

    values = _checked(sample)
    # The statistic is undefined for equal values.
    w, p = (1.0, 1.0) if np.ptp(values) == 0.0 else stats.shapiro(values)
    francia_w, francia_p = shapiro_francia(values)
    return GroupStatistics(
        len(values),
        float(np.median(values)),
        float(values.mean()),
        float(values.std(ddof=1)),
        float(w),
        float(p),
        francia_w,
        francia_p,
    )


FRANCIA_SIZES = (5, 5000)
"""Sizes of the samples for which the p value of the Shapiro-Francia test is approximated."""


def shapiro_francia(sample: FloatArray) -> tuple[float, float]:
    """Return statistic and p value of the Shapiro-Francia test of normality.

    Args:
        sample: The values, shape (n,), n >= 3.

    Returns:
        W' in [0, 1], 1 for a sample in proportion to the normal scores, and the probability of a
        smaller W' in a normal sample: NaN for sizes out of `FRANCIA_SIZES`. Both are 1 if all
        values are equal.

    Raises:
        DataFileError: If there are fewer than three values, or one is not finite.

    Source:
        Shapiro and Francia, J. Amer. Statist. Assoc. 67 (1972): W' is the squared correlation of
        the ordered sample with the expected values of normal order statistics, here Blom's scores.
        Royston, Statistics in Medicine 12 (1993) 181-184: log(1 - W') is nearly normal, with mean
        and standard deviation that depend on the size.

    >>> round(shapiro_francia(np.array([1.0, 2.0, 3.0, 4.0, 5.0]))[0], 4)
    0.9958
    """
    from scipy import stats

    values = np.sort(_checked(sample))
    n = len(values)
    if np.ptp(values) == 0.0:
        return 1.0, 1.0
    scores = stats.norm.ppf((np.arange(1, n + 1) - 0.375) / (n + 0.25))
    w = min(1.0, float(np.corrcoef(values, scores)[0, 1] ** 2))
    if not FRANCIA_SIZES[0] <= n <= FRANCIA_SIZES[1]:
        return w, math.nan
    if w == 1.0:
        return w, 1.0
    log_n = math.log(n)
    mean = -1.2725 + 1.0521 * (math.log(log_n) - log_n)
    std = 1.0308 - 0.26758 * (math.log(log_n) + 2.0 / log_n)
    return w, float(stats.norm.sf((math.log1p(-w) - mean) / std))


def kolmogorov_smirnov(sample: FloatArray) -> float:
    """Return the p value of the Kolmogorov-Smirnov test of normality; 1 if all values are equal.

    Args:
        sample: The values, shape (n,), n >= 3.

    Raises:
        DataFileError: If there are fewer than three values, or one is not finite.

    Source:
        ITCM thesis, III.C.5: the sample is standardised by its own mean and standard deviation.
        The p value is therefore too large (Lilliefors 1967); `group_statistics` has Shapiro-Wilk.

    >>> kolmogorov_smirnov(np.array([1.0, 1.0, 1.0]))
    1.0
    """
    from scipy import stats

    values = _checked(sample)
    if np.ptp(values) == 0.0:
        return 1.0
    return float(stats.kstest((values - values.mean()) / values.std(ddof=1), "norm").pvalue)


@dataclass(frozen=True, slots=True)
class SignedRankTest:
    """Comparison of two conditions over the same operators: a row of the paper's Table III."""

    count: int
    """Number of operators."""
    tail: Tail
    levene_f: float
    """Statistic of Levene's test of equal variances."""
    levene_p: float
    """Its p value."""
    statistic: float
    """Sum T of the ranks of positive differences, first less second."""
    z: float
    """Normal approximation of T."""
    p: float
    """p value of the signed-rank test."""
    effect: float
    """Effect size r = z / sqrt(2 N)."""

    def to_json(self) -> dict[str, Any]:
        """Return the test as plain containers."""
        return asdict(self)


def signed_rank_test(first: FloatArray, second: FloatArray, *, tail: Tail) -> SignedRankTest:
    """Return the comparison of two conditions over the same operators.

    Args:
        first: Values of the first condition, shape (n,), n >= 3.
        second: Values of the second condition for the same operators, shape (n,).
        tail: Alternative hypothesis about the first against the second.

    Raises:
        DataFileError: If the sizes differ, or a value is not finite.

    Source:
        Null-space paper, section II.C.7 and Table III: Levene's test, about the mean; Wilcoxon's
        signed ranks in the normal approximation, zero differences left out. Its z values are those
        of MATLAB's `signrank`: with half a rank of continuity correction for one-tailed
        tests, without for two-tailed ones.
    """
    from scipy import stats

    one, other = _checked(first), _checked(second)
    if len(one) != len(other):
        raise DataFileError(
            f"{len(one)} values against {len(other)}: the test needs pairs of values."
        )
    levene_f, levene_p = 0.0, 1.0
    if np.ptp(one) > 0.0 or np.ptp(other) > 0.0:
        levene_f, levene_p = (float(x) for x in stats.levene(one, other, center="mean"))
    off = one - other
    off = off[off != 0.0]
    n = len(off)
    if not n:
        return SignedRankTest(len(one), tail, levene_f, levene_p, 0.0, 0.0, 1.0, 0.0)
    ranks = stats.rankdata(np.abs(off))
    total = float(ranks[off > 0.0].sum())
    _, tied = np.unique(ranks, return_counts=True)
    variance = n * (n + 1) * (2 * n + 1) / 24.0 - float((tied**3 - tied).sum()) / 48.0
    shift = {"greater": -0.5, "less": 0.5, "two-sided": 0.0}[tail]
    z = (total - n * (n + 1) / 4.0 + shift) / math.sqrt(variance)
    p = {
        "greater": float(stats.norm.sf(z)),
        "less": float(stats.norm.cdf(z)),
        "two-sided": min(1.0, 2.0 * float(stats.norm.sf(abs(z)))),
    }[tail]
    effect = effect_size(z, len(one))
    return SignedRankTest(len(one), tail, levene_f, levene_p, total, z, p, effect)


def effect_size(z: float, pairs: int) -> float:
    """Return r = z / sqrt(2 N) of a signed-rank test on N pairs.

    Source:
        Null-space paper, Table III.

    >>> round(effect_size(3.8351, 26), 4)
    0.5318
    """
    return z / math.sqrt(2.0 * pairs)


@dataclass(frozen=True, slots=True)
class PostHoc:
    """Comparison of two conditions after an analysis of variance."""

    first: str
    second: str
    difference: float
    """Mean of the first condition less that of the second."""
    t: float
    """Statistic of the paired t test."""
    tail: Tail
    """Alternative hypothesis about the first condition against the second."""
    p: float
    """p value of that test, times the number of pairs (Bonferroni), at most 1."""
    effect: float
    """Effect size r = sqrt(t^2 / (t^2 + degrees of freedom))."""


@dataclass(frozen=True, slots=True)
class RepeatedMeasures:
    """One-way analysis of variance with repeated measures."""

    f: float
    """F statistic."""
    df_between: float
    """Degrees of freedom of the numerator."""
    df_error: float
    """Degrees of freedom of the denominator."""
    p: float
    """p value."""
    post_hoc: tuple[PostHoc, ...]
    """Comparison of each pair of conditions."""

    def to_json(self) -> dict[str, Any]:
        """Return the analysis as plain containers."""
        return asdict(self)


def repeated_measures(
    samples: Mapping[str, FloatArray], *, tail: Tail = "two-sided"
) -> RepeatedMeasures:
    """Return the analysis of variance of conditions over the same operators.

    Args:
        samples: By condition, the values of all operators, shape (n,), n >= 3.
        tail: Alternative hypothesis of the t tests about each condition against those after it.

    Raises:
        DataFileError: If there are fewer than two conditions, their sizes differ, or the error sum
            of squares is zero.

    Source:
        ITCM thesis, section III.C.5: one-way repeated-measures analysis of variance, then paired t
        tests with Bonferroni's correction. Its t tests are one-tailed: the condition that is
        expected to be worse has the greater mean.
    """
    import pandas as pd
    from scipy import stats
    from statsmodels.stats.anova import AnovaRM

    values = {name: _checked(sample) for name, sample in samples.items()}
    sizes = {len(sample) for sample in values.values()}
    if len(values) < 2 or len(sizes) != 1:
        raise DataFileError(
            f"repeated measures of {len(values)} conditions with {sorted(sizes)} values; must be "
            "two conditions or more, with a value of each operator in each."
        )
    table = np.stack(list(values.values()))
    n = table.shape[1]
    left = table - table.mean(axis=0) - table.mean(axis=1, keepdims=True) + table.mean()
    # Sums of some hundred squares are accurate to 1e-13; an error sum below that is zero.
    if (left**2).sum() <= 1e-13 * (table**2).sum():
        raise DataFileError(
            "repeated measures: conditions differ equally for every operator, so the test is "
            "undefined. Compare more operators."
        )
    frame = pd.DataFrame(
        {
            "operator": np.tile(np.arange(n), len(values)),
            "condition": np.repeat(list(values), n),
            "value": table.ravel(),
        }
    )
    row = AnovaRM(frame, "value", "operator", within=["condition"]).fit().anova_table.iloc[0]
    pairs = list(combinations(values, 2))
    post_hoc = []
    for a, b in pairs:
        off = values[a] - values[b]
        if np.ptp(off) == 0.0:
            t = 0.0 if off[0] == 0.0 else math.copysign(math.inf, off[0])
        else:
            t = float(stats.ttest_1samp(off, 0.0).statistic)
        effect = 1.0 if math.isinf(t) else math.sqrt(t * t / (t * t + n - 1))
        p = min(1.0, _t_test_p(t, n - 1, tail) * len(pairs)) if off.any() else 1.0
        post_hoc.append(PostHoc(a, b, float(off.mean()), t, tail, p, effect))
    return RepeatedMeasures(
        float(row["F Value"]),
        float(row["Num DF"]),
        float(row["Den DF"]),
        float(row["Pr > F"]),
        tuple(post_hoc),
    )


def _t_test_p(t: float, freedom: int, tail: Tail) -> float:
    """Return the p value of a t statistic."""
    from scipy import stats

    return {
        "greater": float(stats.t.sf(t, freedom)),
        "less": float(stats.t.cdf(t, freedom)),
        "two-sided": 2.0 * float(stats.t.sf(abs(t), freedom)),
    }[tail]


def _checked(sample: FloatArray) -> FloatArray:
    values = np.asarray(sample, dtype=np.float64)
    if values.ndim != 1 or len(values) < 3 or not np.isfinite(values).all():
        raise DataFileError(
            f"a sample of shape {values.shape}; must be three finite numbers or more in a row."
        )
    return values

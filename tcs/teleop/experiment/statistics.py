"""Tests of the experiment: normality, equal variance, signed ranks, repeated measures."""

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
    """One condition's sample: a row of the paper's Table II, and its test of normality."""

    count: int
    median: float
    mean: float
    std: float
    """Of n - 1 degrees of freedom."""
    shapiro_w: float
    shapiro_p: float
    """That a normal population gives such a sample; 1 where all values are equal."""


def group_statistics(sample: FloatArray) -> GroupStatistics:
    """Return what a sample is like.

    Args:
        sample: Shape (n,), n >= 3.

    Raises:
        DataFileError: If there are fewer than three values, or one is not finite.
    """
    from scipy import stats

    values = _checked(sample)
    # The statistic is not defined where nothing varies.
    w, p = (1.0, 1.0) if np.ptp(values) == 0.0 else stats.shapiro(values)
    return GroupStatistics(
        len(values),
        float(np.median(values)),
        float(values.mean()),
        float(values.std(ddof=1)),
        float(w),
        float(p),
    )


@dataclass(frozen=True, slots=True)
class SignedRankTest:
    """Two conditions on the same operators: a row of the paper's Table III."""

    count: int
    tail: Tail
    levene_f: float
    levene_p: float
    statistic: float
    """Sum T of the ranks of positive differences, first less second."""
    z: float
    p: float
    effect: float
    """r = z / sqrt(2 N)."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return asdict(self)


def signed_rank_test(first: FloatArray, second: FloatArray, *, tail: Tail) -> SignedRankTest:
    """Return how two conditions differ on the same operators.

    Args:
        first: Shape (n,), n >= 3.
        second: Of the same operators in the same order, shape (n,).
        tail: Alternative hypothesis about the first against the second.

    Raises:
        DataFileError: If they do not match, or a value is not finite.

    Source:
        Null-space paper, section II.C.7 and Table III: Levene's test, about the mean; Wilcoxon's
        signed ranks in the normal approximation, zero differences left out. Its z values are those
        of MATLAB's `signrank`: with half a rank of continuity correction for one-tailed
        tests, without for two-tailed ones.
    """
    from scipy import stats

    one, other = _checked(first), _checked(second)
    if len(one) != len(other):
        raise DataFileError(f"{len(one)} values against {len(other)}: no pairs.")
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
    """Two conditions after an analysis of variance."""

    first: str
    second: str
    difference: float
    """Mean of the first less that of the second."""
    t: float
    p: float
    """Two-sided, of a paired t test, times the number of pairs (Bonferroni), at most 1."""
    effect: float
    """r = sqrt(t^2 / (t^2 + degrees of freedom))."""


@dataclass(frozen=True, slots=True)
class RepeatedMeasures:
    """A one-way analysis of variance with repeated measures."""

    f: float
    df_between: float
    df_error: float
    p: float
    post_hoc: tuple[PostHoc, ...]

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return asdict(self)


def repeated_measures(samples: Mapping[str, FloatArray]) -> RepeatedMeasures:
    """Return whether conditions differ on the same operators, and which of them.

    Args:
        samples: Values of each condition by operator, shapes (n,), n >= 3.

    Raises:
        DataFileError: If there are fewer than two conditions, they do not match, or nothing varies
            within the operators.

    Source:
        ITCM thesis, section III.C.5: one-way repeated-measures analysis of variance, then paired t
        tests with Bonferroni's correction. Its t tests are one-tailed; here no direction is
        hypothesised beforehand, so they are two-tailed.
    """
    import pandas as pd
    from scipy import stats
    from statsmodels.stats.anova import AnovaRM

    values = {name: _checked(sample) for name, sample in samples.items()}
    sizes = {len(sample) for sample in values.values()}
    if len(values) < 2 or len(sizes) != 1:
        raise DataFileError(
            f"repeated measures of {len(values)} conditions with {sorted(sizes)} values; it takes "
            "two conditions or more, and a value of each operator in each."
        )
    table = np.stack(list(values.values()))
    n = table.shape[1]
    left = table - table.mean(axis=0) - table.mean(axis=1, keepdims=True) + table.mean()
    # Sums of some hundred squares are good to 1e-13; beneath, nothing is left to divide by.
    if (left**2).sum() <= 1e-13 * (table**2).sum():
        raise DataFileError("the conditions differ alike for each operator: no error to test with.")
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
            t, p = (0.0, 1.0) if off[0] == 0.0 else (math.copysign(math.inf, off[0]), 0.0)
        else:
            t, p = (float(x) for x in stats.ttest_1samp(off, 0.0))
        effect = 1.0 if math.isinf(t) else math.sqrt(t * t / (t * t + n - 1))
        post_hoc.append(PostHoc(a, b, float(off.mean()), t, min(1.0, p * len(pairs)), effect))
    return RepeatedMeasures(
        float(row["F Value"]),
        float(row["Num DF"]),
        float(row["Den DF"]),
        float(row["Pr > F"]),
        tuple(post_hoc),
    )


def _checked(sample: FloatArray) -> FloatArray:
    values = np.asarray(sample, dtype=np.float64)
    if values.ndim != 1 or len(values) < 3 or not np.isfinite(values).all():
        raise DataFileError(
            f"a sample of shape {values.shape}; must be three finite numbers or more in a row."
        )
    return values

"""Differences between the samples of two methods, with Wilcoxon's tests."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.placement.robustness.statistics import CONFIDENCE


@dataclass(frozen=True, slots=True)
class Difference:
    """Difference between the samples of two methods, with a test of its significance."""

    mean: float
    """Mean of the first minus mean of the second."""
    ci95: tuple[float, float] | None
    """95 % confidence interval of that: Student's t of the paired differences, Welch's t otherwise;
    None for a single sample."""
    p: float
    """Two-sided p-value of the Wilcoxon test: rank sum of independent samples, signed rank of
    paired ones; 1 if no two samples differ."""
    test: str
    """Name of the test, "rank sum" or "signed rank"."""

    def to_json(self) -> dict[str, Any]:
        """Return the difference as plain containers."""
        interval = None if self.ci95 is None else list(self.ci95)
        return {"mean": self.mean, "ci95": interval, "p": self.p, "test": self.test}


def rank_sum(first: FloatArray, second: FloatArray) -> Difference:
    """Return the difference between independent samples, with the Wilcoxon rank sum test.

    Source:
        TCS section V. With ties this is the Mann-Whitney test in its normal approximation.
    """
    from scipy import stats

    mean = float(np.mean(first) - np.mean(second))
    first, second = _rounded(first), _rounded(second)
    both = np.concatenate([first, second])
    if np.all(both == both[0]):
        return Difference(mean, _no_width(0.0, both.size // 2), 1.0, "rank sum")
    found = stats.mannwhitneyu(first, second, alternative="two-sided", method="asymptotic")
    return Difference(mean, _welch_interval(first, second), float(found.pvalue), "rank sum")


def signed_rank(first: FloatArray, second: FloatArray) -> Difference:
    """Return the difference between paired samples, with the Wilcoxon signed rank test.

    Zero differences are treated after Pratt.
    """
    from scipy import stats

    difference = _rounded(first - second)
    count, mean = difference.size, float(np.mean(difference))
    if not np.any(difference):
        return Difference(0.0, _no_width(0.0, count), 1.0, "signed rank")
    found = stats.wilcoxon(difference, zero_method="pratt", method="asymptotic")
    interval = _no_width(mean, count)
    if interval is not None and np.ptp(difference) > 0.0:
        half = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, count - 1))
        half *= float(np.std(difference, ddof=1)) / math.sqrt(count)
        interval = (mean - half, mean + half)
    return Difference(mean, interval, float(found.pvalue), "signed rank")


def _rounded(values: FloatArray) -> FloatArray:
    """Return fractions or their differences with rounding errors removed, so that ties are equal.

    Six sevenths minus five is not five sevenths minus four in the last bit, which would give the
    two different ranks. Sums of some tens of weights are accurate to 1e-14, and distinct fractions
    differ by more than 1e-9.
    """
    return np.round(values, 9)


def _no_width(mean: float, count: int) -> tuple[float, float] | None:
    """Return the interval of equal differences, None if there are fewer than two."""
    return None if count < 2 else (mean, mean)


def _welch_interval(first: FloatArray, second: FloatArray) -> tuple[float, float] | None:
    """Return Welch's interval of the difference between two means, None for single samples."""
    from scipy import stats

    if min(first.size, second.size) < 2:
        return None
    mean = float(np.mean(first) - np.mean(second))
    variances = [float(np.var(x, ddof=1)) / x.size for x in (first, second)]
    error = math.sqrt(sum(variances))
    # SciPy warns of lost precision for samples without spread, whose interval has no width.
    if np.ptp(first) == 0.0 and np.ptp(second) == 0.0:
        return mean, mean
    freedom = sum(variances) ** 2 / sum(
        v**2 / (x.size - 1) for v, x in zip(variances, (first, second), strict=True)
    )
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, freedom)) * error
    return mean - half, mean + half

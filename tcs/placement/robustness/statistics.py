"""What samples say: means with their intervals, and tests of differences."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Mean:
    """A mean of samples between 0 and 1, and what is known of it."""

    mean: float
    std: float
    """Standard deviation of the samples, of n - 1 degrees of freedom; 0 of a single one."""
    ci95: tuple[float, float]
    """95 % interval of the mean."""


def mean_of(samples: ArrayLike) -> Mean:
    """Return the mean of samples between 0 and 1, with its 95 % interval.

    Args:
        samples: Shape (n,), n >= 1.

    Returns:
        The interval is that of `intervals_of`.

    >>> mean_of([0.5, 1.0, 1.0]).mean
    0.8333333333333334
    """
    values = np.asarray(samples, dtype=np.float64)
    mean, low, high = (float(found[0]) for found in intervals_of(values[None]))
    std = float(np.std(values, ddof=1)) if values.size > 1 else 0.0
    return Mean(mean, std, (low, high))


def intervals_of(
    samples: NDArray[np.float64] | NDArray[np.float32],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return means of samples between 0 and 1, and both ends of their 95 % intervals.

    Args:
        samples: Shape (k, n), n >= 1.

    Returns:
        Shapes (k,). The intervals are Student's t of the samples and two more, a 0 and a 1, cut to
        [0, 1]. Without the two, samples that are all equal would claim certainty, and one failure
        among a thousand would look surer than none.

    Source:
        The two added samples: Agresti and Coull, The American Statistician 52 (1998), for shares.
    """
    # Imported where it is needed: much of this room does without.
    from scipy.special import stdtrit

    values = samples.astype(np.float64)
    k, n = values.shape
    mean = values.mean(axis=1)
    more = np.concatenate([values, np.zeros((k, 1)), np.ones((k, 1))], axis=1)
    half = float(stdtrit(n + 1, (1.0 + CONFIDENCE) / 2.0)) / math.sqrt(n + 2)
    half = half * more.std(axis=1, ddof=1)
    middle = more.mean(axis=1)
    # The two samples move the middle by less than half the width; rounding must not undo that.
    low = np.clip(middle - half, 0.0, mean)
    return mean, low, np.maximum(np.minimum(middle + half, 1.0), mean)


@dataclass(frozen=True, slots=True)
class Difference:
    """How samples of two methods differ, and how likely that is by chance."""

    mean: float
    """Mean of the first less mean of the second."""
    ci95: tuple[float, float]
    """95 % interval of that: Student's t of the paired differences, Welch's t otherwise."""
    p: float
    """Two-sided p of the Wilcoxon test: rank sum of independent samples, signed rank of paired
    ones; 1 where no two samples differ."""
    test: str
    """Which of the two tests."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {"mean": self.mean, "ci95": list(self.ci95), "p": self.p, "test": self.test}


def rank_sum(first: NDArray[np.float64], second: NDArray[np.float64]) -> Difference:
    """Return how two independent samples differ: Wilcoxon rank sum, ties corrected.

    Source:
        TCS section V. With ties this is the Mann-Whitney test in its normal approximation.
    """
    from scipy import stats

    mean = float(np.mean(first) - np.mean(second))
    first, second = _tied(first), _tied(second)
    both = np.concatenate([first, second])
    if np.all(both == both[0]):
        return Difference(mean, (0.0, 0.0), 1.0, "rank sum")
    found = stats.mannwhitneyu(first, second, alternative="two-sided", method="asymptotic")
    welch = _welch_interval(first, second)
    return Difference(mean, welch, float(found.pvalue), "rank sum")


def signed_rank(first: NDArray[np.float64], second: NDArray[np.float64]) -> Difference:
    """Return how paired samples differ: Wilcoxon signed rank, zero differences after Pratt."""
    from scipy import stats

    off = _tied(first - second)
    if not np.any(off):
        return Difference(0.0, (0.0, 0.0), 1.0, "signed rank")
    found = stats.wilcoxon(off, zero_method="pratt", method="asymptotic")
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, off.size - 1))
    half *= float(np.std(off, ddof=1)) / math.sqrt(off.size)
    mean = float(np.mean(off))
    return Difference(mean, (mean - half, mean + half), float(found.pvalue), "signed rank")


def _tied(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return shares or their differences such that what is equal but for rounding is equal.

    Six sevenths less five is not five sevenths less four, by a last bit; ranks must not see that.
    Sums of some tens of weights are good to 1e-14, and no two shares lie 1e-9 apart.
    """
    return np.round(values, 9)


def _welch_interval(first: NDArray[np.float64], second: NDArray[np.float64]) -> tuple[float, float]:
    from scipy import stats

    interval = stats.ttest_ind(first, second, equal_var=False).confidence_interval(CONFIDENCE)
    return float(interval.low), float(interval.high)

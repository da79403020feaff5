"""Statistics of samples: means with confidence intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

CONFIDENCE = 0.95
"""Confidence level of every interval."""


@dataclass(frozen=True, slots=True)
class Mean:
    """Mean of samples between 0 and 1, with its spread and confidence interval."""

    mean: float
    """The mean."""
    std: float
    """Standard deviation of the samples with n - 1 degrees of freedom; 0 for a single sample."""
    ci95: tuple[float, float] | None
    """95 % confidence interval of the mean; None for a single sample."""


def mean_of(samples: ArrayLike) -> Mean:
    """Return the mean of samples between 0 and 1, with its 95 % interval.

    Args:
        samples: Shape (n,), n >= 1.

    Returns:
        Mean, standard deviation and the interval of `intervals_of`; a single sample, which says
        nothing about the spread, has no interval.

    >>> mean_of([0.5, 1.0, 1.0]).mean
    0.8333333333333334
    """
    values = np.asarray(samples, dtype=np.float64)
    mean, low, high = (float(found[0]) for found in intervals_of(values[None]))
    if values.size < 2:
        return Mean(mean, 0.0, None)
    return Mean(mean, float(np.std(values, ddof=1)), (low, high))


def intervals_of(
    samples: NDArray[np.float64] | NDArray[np.float32],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return means of samples between 0 and 1, and both ends of their 95 % intervals.

    Args:
        samples: Shape (k, n), n >= 1.

    Returns:
        Shapes (k,). The intervals are Student's t of the samples and two more, a 0 and a 1, clipped
        to [0, 1]. Without these two, equal samples would imply certainty, and one failure in a
        thousand would look more certain than none.

    Source:
        The two added samples: Agresti and Coull, The American Statistician 52 (1998), for
        proportions.
    """
    # Imported here because selection with estimates must not load SciPy.
    from scipy.special import stdtrit

    values = samples.astype(np.float64)
    k, n = values.shape
    mean = values.mean(axis=1)
    more = np.concatenate([values, np.zeros((k, 1)), np.ones((k, 1))], axis=1)
    factor = float(stdtrit(n + 1, (1.0 + CONFIDENCE) / 2.0)) / math.sqrt(n + 2)
    half = factor * more.std(axis=1, ddof=1)
    middle = more.mean(axis=1)
    # The two samples move the middle by less than half the width; rounding must not undo that.
    low = np.clip(middle - half, 0.0, mean)
    return mean, low, np.maximum(np.minimum(middle + half, 1.0), mean)


def binomial_interval(successes: int, trials: int) -> tuple[float, float]:
    """Return the exact 95 % interval of a probability, by Clopper and Pearson.

    Args:
        successes: Number of successes, 0 to `trials`.
        trials: Number of independent trials, 1 or more.

    >>> low, high = binomial_interval(0, 100)
    >>> low, round(high, 4)
    (0.0, 0.0362)
    """
    from scipy.special import betaincinv

    tail, failures = (1.0 - CONFIDENCE) / 2.0, trials - successes
    low = float(betaincinv(successes, failures + 1, tail)) if successes else 0.0
    high = float(betaincinv(successes + 1, failures, 1.0 - tail)) if failures else 1.0
    return low, high

"""Successive halving: many samples for the sets that may be the best, few for the others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.placement.robustness.statistics import CONFIDENCE, intervals_of
from tcs.placement.tables import tc_reachability

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FIRST_ROUND = 64
"""Samples of the first round; each round doubles their number."""
CHUNK = 256
"""Sets evaluated together: some ten megabytes."""

Attempt = Callable[[IntArray, int, int], NDArray[np.bool_]]
"""Function of numbers of members and a range of samples, start <= s < stop. It returns which goals
they reach, shape (members, stop - start, goals)."""


@dataclass(frozen=True, eq=False)
class Estimates:
    """Estimated success of K sets, shapes (K,)."""

    mean: FloatArray
    """Mean over the samples of each set."""
    low: FloatArray
    """Lower end of its 95 % interval."""
    high: FloatArray
    """Upper end."""
    samples: IntArray
    """Number of samples of each set."""
    survivors: IntArray
    """Numbers of the sets that no round rejected."""


def round_sizes(samples: int) -> tuple[int, ...]:
    """Return the number of samples after each round.

    >>> round_sizes(1000)
    (64, 128, 256, 512, 1000)
    """
    sizes = []
    size = FIRST_ROUND
    while size < samples:
        sizes.append(size)
        size *= 2
    return (*sizes, samples)


def successive_halving(
    sets: IntArray,
    weights: FloatArray,
    samples: int,
    attempt: Attempt,
    on_round: Callable[[], None] = lambda: None,
) -> Estimates:
    """Return estimates of the success of sets, with the most samples for the best of them.

    All sets are evaluated on the same samples, so that the variance of their differences is much
    smaller than that of their means. Each round rejects the sets that are significantly worse than
    the leader: the upper confidence bound of their mean paired difference is negative. The bounds
    hold for all sets and rounds jointly with 95 % confidence (Bonferroni), as far as means of that
    many differences are normally distributed. The better half of the others continues; ties go to
    the first.

    Args:
        sets: Numbers of the members of each set, shape (K, m).
        weights: Weights of the goals, sum 1, shape (goals,).
        samples: Number of samples of the sets that are never rejected.
        attempt: Evaluates members.
        on_round: Called after each round.
    """
    # Imported here because it takes a second.
    from scipy.special import ndtri

    sizes = round_sizes(samples)
    count = len(sets)
    # float32 keeps seven digits of the fraction of goals reached.
    fractions = np.zeros((count, samples), dtype=np.float32)
    counts = np.zeros(count, dtype=np.int64)
    alive = np.arange(count)
    bound = float(ndtri(1.0 - (1.0 - CONFIDENCE) / max(1, count * len(sizes))))
    done = 0
    for size in sizes:
        if alive.size:
            _fill(fractions, sets, alive, weights, attempt, done, size)
            counts[alive] = size
            alive = _best_half(alive, fractions[alive, :size], bound)
        done = size
        on_round()
    mean, low, high = np.zeros(count), np.zeros(count), np.ones(count)
    for size in sizes:
        rows = np.flatnonzero(counts == size)
        if rows.size:
            mean[rows], low[rows], high[rows] = intervals_of(fractions[rows, :size])
    return Estimates(mean, low, high, counts, alive)


def _fill(
    fractions: NDArray[np.float32],
    sets: IntArray,
    rows: IntArray,
    weights: FloatArray,
    attempt: Attempt,
    start: int,
    stop: int,
) -> None:
    """Compute the fractions of some sets in samples start <= s < stop."""
    members, number = np.unique(sets[rows], return_inverse=True)
    number = number.reshape(rows.size, -1)
    found = attempt(members, start, stop)
    for first in range(0, rows.size, CHUNK):
        part = slice(first, first + CHUNK)
        reached = found[number[part, 0]]
        for column in number[part, 1:].T:
            reached = reached | found[column]
        fractions[rows[part], start:stop] = tc_reachability(reached, weights)


def _best_half(alive: IntArray, fractions: NDArray[np.float32], bound: float) -> IntArray:
    """Return the sets that may be the best, at most half of them, in order."""
    mean = fractions.mean(axis=1, dtype=np.float64)
    difference = fractions.astype(np.float64) - fractions[int(np.argmax(mean))]
    n = difference.shape[1]
    error = np.full(len(difference), np.inf)
    if n > 1:
        error = difference.std(axis=1, ddof=1) / np.sqrt(n)
    mean[difference.mean(axis=1) + bound * error < 0.0] = -1.0
    half = np.argsort(-mean, kind="stable")[: (len(mean) + 1) // 2]
    return np.sort(alive[half[mean[half] >= 0.0]])

"""Successive rejection: many samples for the sets that may be the best, few for the others."""

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
"""Samples of the first round; each round doubles them."""
AT_ONCE = 256
"""Sets whose goals are looked at together: some ten megabytes."""

Try = Callable[[IntArray, int, int], NDArray[np.bool_]]
"""Given numbers of members and a range of samples start <= s < stop, returns which goals they
reach, shape (members, stop - start, goals)."""


@dataclass(frozen=True, eq=False)
class Estimates:
    """What is known of each set, shapes (K,)."""

    mean: FloatArray
    low: FloatArray
    high: FloatArray
    samples: IntArray
    """How many samples each has had."""
    survivors: IntArray
    """Numbers of the sets that none of the rounds has rejected."""


def round_sizes(samples: int) -> tuple[int, ...]:
    """Return how many samples there are after each round.

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
    attempt: Try,
    on_round: Callable[[], None] = lambda: None,
) -> Estimates:
    """Return estimates of the success of sets, the best of them with the most samples.

    All sets meet the same samples, so that what they differ by is known far better than either
    of them. After each round those sets are rejected that are behind the leader beyond doubt: even
    the upper bound of their mean paired difference is negative. The bounds hold for all sets and
    rounds together with 95 % confidence (Bonferroni), as far as means of that many differences
    are normal. Of the others the better half goes on, among equals those that come first.

    Args:
        sets: Numbers of the members of each set, shape (K, m).
        weights: Weights of the goals, sum 1, shape (goals,).
        samples: Samples of the sets that are never rejected.
        attempt: Tries members.
        on_round: Called after each round.
    """
    # Imported where it is needed: it takes a second.
    from scipy.special import ndtri

    sizes = round_sizes(samples)
    count = len(sets)
    # float32 keeps seven digits of a share of some goals.
    fractions = np.zeros((count, samples), dtype=np.float32)
    had = np.zeros(count, dtype=np.int64)
    alive = np.arange(count)
    bound = float(ndtri(1.0 - (1.0 - CONFIDENCE) / max(1, count * len(sizes))))
    done = 0
    for size in sizes:
        if alive.size:
            _fill(fractions, sets, alive, weights, attempt, done, size)
            had[alive] = size
            alive = _best_half(alive, fractions[alive, :size], bound)
        done = size
        on_round()
    mean, low, high = np.zeros(count), np.zeros(count), np.ones(count)
    for size in sizes:
        rows = np.flatnonzero(had == size)
        if rows.size:
            mean[rows], low[rows], high[rows] = intervals_of(fractions[rows, :size])
    return Estimates(mean, low, high, had, alive)


def _fill(
    fractions: NDArray[np.float32],
    sets: IntArray,
    rows: IntArray,
    weights: FloatArray,
    attempt: Try,
    start: int,
    stop: int,
) -> None:
    """Fill the fractions of some sets in samples start <= s < stop."""
    members, number = np.unique(sets[rows], return_inverse=True)
    number = number.reshape(rows.size, -1)
    found = attempt(members, start, stop)
    for first in range(0, rows.size, AT_ONCE):
        part = slice(first, first + AT_ONCE)
        reached = found[number[part, 0]]
        for column in number[part, 1:].T:
            reached = reached | found[column]
        fractions[rows[part], start:stop] = tc_reachability(reached, weights)


def _best_half(alive: IntArray, fractions: NDArray[np.float32], bound: float) -> IntArray:
    """Return the sets that may be the best, half of them at most, in order."""
    mean = fractions.mean(axis=1, dtype=np.float64)
    off = fractions.astype(np.float64) - fractions[int(np.argmax(mean))]
    n = off.shape[1]
    error = off.std(axis=1, ddof=1) / np.sqrt(n) if n > 1 else np.full(len(off), np.inf)
    mean[off.mean(axis=1) + bound * error < 0.0] = -1.0
    half = np.argsort(-mean, kind="stable")[: (len(mean) + 1) // 2]
    return np.sort(alive[half[mean[half] >= 0.0]])

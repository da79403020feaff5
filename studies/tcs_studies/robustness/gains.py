"""Gain of selecting by estimated success, and how well TC-manipulability predicts success."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, TcsError
from tcs.model.random_streams import check_draws, named_generator
from tcs.placement.robustness.evaluation import Evaluation, evaluate
from tcs.placement.robustness.kept_pairs import EQUAL_REACHABILITY, Pairs, kept_pairs
from tcs.placement.robustness.statistics import CONFIDENCE
from tcs.placement.robustness.trials import Trials
from tcs.placement.tables import tc_reachability
from tcs.placement.tables.sets import FRACTION_TOLERANCE
from tcs_studies.robustness.differences import Difference, signed_rank

STRATA = 10
"""Number of equal strata of P_M, from each of which the same number of sets is drawn."""


@dataclass(frozen=True, eq=False)
class Gain:
    """The set selected by estimated success compared with the one selected by the scores."""

    members: int
    """Greatest number of members of both sets."""
    robust: Evaluation
    """The most robust set: the greatest lower confidence bound on success."""
    scored: Evaluation
    """The set with the greatest P_R + P_M."""
    paired: Difference
    """Fraction of goals reached by the robust minus that by the scored set, signed rank test."""

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain containers."""
        return {
            "members": self.members,
            "robust": self.robust.to_json(),
            "scored": self.scored.to_json(),
            "paired": self.paired.to_json(),
        }


@dataclass(frozen=True, slots=True)
class Prediction:
    """Rank correlation between P_M and success under error."""

    members: int
    """Number of members of the sets."""
    equal_reach: bool
    """Whether only sets with P_R of at least 0.98 of the greatest of their size were drawn, among
    which P_M decides."""
    population: int
    """Number of such sets."""
    sets: int
    """Number of sets drawn, evenly from ten strata of P_M."""
    rho: float | None
    """Spearman's rank correlation of P_M and success; None if one of them does not vary."""
    ci95: tuple[float, float] | None
    """Its 95 % interval: Fisher's transformation, with the variance of Bonett and Wright."""
    p: float | None
    """Two-sided p-value of the correlation."""
    manipulability: NDArray[np.float64] = field(compare=False)
    """P_M of each drawn set, shape (sets,)."""
    success: NDArray[np.float64] = field(compare=False)
    """Mean fraction of goals reached by each drawn set, shape (sets,)."""

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain containers."""
        return {
            "members": self.members,
            "equal_reach": self.equal_reach,
            "population": self.population,
            "sets": self.sets,
            "rho": self.rho,
            "ci95": None if self.ci95 is None else list(self.ci95),
            "p": self.p,
        }


def robust_gains(
    trials: Trials, *, samples: int = 1000, seed: int = 0, jobs: int = 2
) -> tuple[Gain, ...]:
    """Return the gain of selecting by success, for sets of one and of up to two.

    Both sets are evaluated on the same fresh samples, which are independent of those that the
    estimates were made from.

    Args:
        trials: Trials of a table with estimates of success (`robustify`).
        samples: Number of samples.
        seed: Seed of the samples.
        jobs: Number of threads.

    Raises:
        SelectionError: If the table has no estimates.
    """
    success, sets = trials.scored.success, trials.scored.sets
    if success is None:
        raise SelectionError(
            "No success under error was estimated for this table. Estimate it first: "
            "tcs robustify FILE."
        )
    gains = []
    for members, scored in ((1, sets.best_single), (2, sets.best)):
        robust = success.most_robust(sets, max_members=members)
        if not robust or (members == 2 and not success.of_size(2).size):
            continue
        first, second = (
            evaluate(trials, select=chosen, samples=samples, seed=seed, jobs=jobs)
            for chosen in (robust, scored)
        )
        gains.append(Gain(members, first, second, signed_rank(first.fractions, second.fractions)))
    return tuple(gains)


def predictions(
    trials: Trials, *, sets: int = 60, samples: int = 100, seed: int = 0, jobs: int = 2
) -> tuple[Prediction, ...]:
    """Return how well P_M predicts success, for sets of one and two, of any and of equal P_R.

    Args:
        trials: Trials of a table.
        sets: Number of sets to draw for each of the four cases, evenly from ten strata of P_M.
        samples: Number of samples of each set, the same samples for all.
        seed: Seed of samples and draw.
        jobs: Number of threads.

    Raises:
        TcsError: If a number is out of range.
    """
    check_draws(samples, seed)
    if sets < STRATA:
        raise TcsError(f"sets is {sets}; must be at least {STRATA}, one for each stratum.")
    table = trials.scored.sets
    offsets = trials.errors.draw(samples, seed, stream="predictions")
    pairs = Pairs.joined(kept_pairs(table))
    alone = np.arange(len(table.candidates))[:, None]
    both = np.stack([pairs.first, pairs.second], axis=1)
    singles = (alone, table.single_reachability, table.single_manipulability)
    found = []
    for rows, reachability, manipulability in (
        singles,
        (both, pairs.reachability, pairs.manipulability),
    ):
        greatest = float(reachability.max(initial=0.0))
        for equal in (False, True):
            least = EQUAL_REACHABILITY * greatest - FRACTION_TOLERANCE if equal else 0.0
            pool = np.flatnonzero(reachability >= least)
            rng = named_generator(seed, f"strata {rows.shape[1]} {equal}")
            drawn = _stratified(rng, pool, manipulability, sets)
            members, number = np.unique(rows[drawn], return_inverse=True)
            tried = trials.reached(table.candidates[members], offsets, jobs=jobs)
            columns = number.reshape(drawn.size, rows.shape[1]).T
            reached = np.logical_or.reduce([tried[column] for column in columns], axis=0)
            success = tc_reachability(reached, trials.weights).mean(axis=1)
            correlation = _rank_correlation(manipulability[drawn], success)
            size = (rows.shape[1], equal, pool.size, drawn.size)
            found.append(Prediction(*size, *correlation, manipulability[drawn], success))
    return tuple(found)


def _stratified(
    rng: np.random.Generator,
    pool: NDArray[np.int64],
    manipulability: NDArray[np.float64],
    count: int,
) -> NDArray[np.int64]:
    """Return `count` sets of a pool, evenly from strata of P_M; all sets of a smaller pool."""
    if pool.size <= count:
        return pool
    order = pool[np.argsort(manipulability[pool], kind="stable")]
    parts = np.array_split(order, STRATA)
    counts = np.diff(np.linspace(0, count, STRATA + 1).round().astype(np.int64))
    return np.concatenate(
        [
            rng.choice(part, min(int(n), part.size), replace=False)
            for part, n in zip(parts, counts, strict=True)
        ]
    )


def _rank_correlation(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> tuple[float | None, tuple[float, float] | None, float | None]:
    """Return Spearman's rank correlation, its interval and its p-value."""
    from scipy import stats

    varies = all(values.size > 3 and np.ptp(values) > 0.0 for values in (first, second))
    if not varies:
        return None, None, None
    found = stats.spearmanr(first, second)
    rho = float(found.statistic)
    if abs(rho) >= 1.0:
        return rho, (rho, rho), float(found.pvalue)
    # Bonett and Wright, Psychometrika 65 (2000): (1 + rho^2 / 2) / (n - 3).
    half = stats.norm.ppf(0.5 + CONFIDENCE / 2.0) * math.sqrt((1 + rho**2 / 2) / (first.size - 3))
    middle = math.atanh(rho)
    return rho, (math.tanh(middle - half), math.tanh(middle + half)), float(found.pvalue)

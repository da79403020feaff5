"""What choosing by estimated success gains over TC-manipulability, and how well that predicts."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, TcsError
from tcs.placement.robustness.error_model import check_draws, named_generator
from tcs.placement.robustness.evaluation import Evaluation, evaluate
from tcs.placement.robustness.pairs import AS_GOOD, Pairs, kept_pairs
from tcs.placement.robustness.statistics import CONFIDENCE, Difference, signed_rank
from tcs.placement.robustness.trials import Trials
from tcs.placement.tables import tc_reachability
from tcs.placement.tables.rules import SHARE_TOLERANCE

STRATA = 10
"""Equal parts of the order of P_M from which as many sets are drawn each."""


@dataclass(frozen=True, eq=False)
class Gain:
    """The set chosen by estimated success against the one chosen by the scores, of one size."""

    members: int
    robust: Evaluation
    scored: Evaluation
    paired: Difference
    """Share of the goals of the first less that of the second, signed rank."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {
            "members": self.members,
            "robust": self.robust.to_json(),
            "scored": self.scored.to_json(),
            "paired": self.paired.to_json(),
        }


@dataclass(frozen=True, slots=True)
class Prediction:
    """How well P_M orders sets by their success under error."""

    members: int
    equal_reach: bool
    """Whether only sets with P_R of at least 0.98 of the greatest of their size were drawn:
    those between which P_M decides."""
    population: int
    """How many such sets there are."""
    sets: int
    """How many were drawn, evenly from ten strata of P_M."""
    rho: float | None
    """Spearman's rank correlation of P_M and success; None where one of them does not vary."""
    ci95: tuple[float, float] | None
    """Its 95 % interval: Fisher's transformation, with the variance of Bonett and Wright."""
    p: float | None
    manipulability: NDArray[np.float64] = field(compare=False)
    """P_M of each set that was drawn, shape (sets,)."""
    success: NDArray[np.float64] = field(compare=False)
    """Its mean share of goals reached, shape (sets,)."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
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
    """Return what choosing by success gains, for sets of one and of up to two.

    Both sets meet the same samples, and none that the estimates were made from: those have
    streams of their own.

    Args:
        trials: Trials of a table whose success was estimated (`robustify`).
        samples: How many samples.
        seed: Seed of the samples.
        jobs: Number of threads.

    Raises:
        SelectionError: If the table has no estimates.
    """
    success, sets = trials.scored.success, trials.scored.sets
    if success is None:
        raise SelectionError("No success was estimated for this table: see tcs robustify.")
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
    """Return how well P_M predicts success, for sets of one and two, of any and of equal reach.

    Args:
        trials: Trials of a table.
        sets: How many sets to draw for each of the four, evenly from ten strata of P_M.
        samples: Samples in which each set is tried, the same for all.
        seed: Seed of samples and drawing.
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
            least = AS_GOOD * greatest - SHARE_TOLERANCE if equal else 0.0
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
    """Return so many of the pool, evenly from strata of P_M; all of it where it is smaller."""
    if pool.size <= count:
        return pool
    order = pool[np.argsort(manipulability[pool], kind="stable")]
    parts = np.array_split(order, STRATA)
    fractions = np.diff(np.linspace(0, count, STRATA + 1).round().astype(np.int64))
    return np.concatenate(
        [
            rng.choice(part, min(n, part.size), replace=False)
            for part, n in zip(parts, fractions, strict=True)
        ]
    )


def _rank_correlation(
    first: NDArray[np.float64], second: NDArray[np.float64]
) -> tuple[float | None, tuple[float, float] | None, float | None]:
    """Return Spearman's rank correlation, its interval and its p."""
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

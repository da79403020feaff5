"""Gains of selecting by success, and how well P_M predicts it, on a small row."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy import stats

from tcs.errors import SelectionError, TcsError
from tcs.placement.robustness import Trials, robustify
from tcs.placement.robustness.estimation import ESTIMATION_STREAM
from tcs_studies.robustness.gains import _rank_correlation, _stratified, predictions, robust_gains


@pytest.fixture(scope="module")
def robust(chair_file):
    return Trials.of(robustify(chair_file, samples=128, sets=100))


def test_gains_are_paired_and_on_fresh_samples(robust):
    gains = robust_gains(robust, samples=100, seed=0)
    assert [gain.members for gain in gains] == [1, 2]
    estimation = robust.errors.draw(100, 0, stream=ESTIMATION_STREAM)
    for gain in gains:
        difference = gain.robust.fractions - gain.scored.fractions
        assert gain.paired.mean == pytest.approx(difference.mean())
        for name, values in gain.robust.offsets.items():
            assert np.array_equal(values, gain.scored.offsets[name])
            assert not np.intersect1d(values, estimation[name]).size
    success, sets = robust.scored.success, robust.scored.sets
    assert tuple(gains[1].robust.sets[0]) == success.most_robust(sets)
    assert tuple(gains[1].scored.sets[0]) == sets.best
    assert json.dumps([gain.to_json() for gain in gains])


def test_gains_need_estimates(chair_trials):
    with pytest.raises(SelectionError, match="tcs robustify"):
        robust_gains(chair_trials)


def test_predictions_of_all_four_cases(chair_trials):
    found = predictions(chair_trials, sets=20, samples=20)
    cases = [(one.members, one.equal_reach) for one in found]
    assert cases == [(1, False), (1, True), (2, False), (2, True)]
    sets = chair_trials.scored.sets
    assert found[0].population == len(sets.candidates)
    assert found[2].population == sets.kept_pairs
    for one in found:
        assert one.sets == min(20, one.population)
        if one.rho is not None:
            assert one.ci95[0] <= one.rho <= one.ci95[1]
    # Both P_M and success grow with the number of goals reached.
    assert found[0].rho > 0.5
    assert json.dumps([one.to_json() for one in found])
    again = predictions(chair_trials, sets=20, samples=20, jobs=1)
    assert [one.to_json() for one in again] == [one.to_json() for one in found]
    with pytest.raises(TcsError, match="at least 10"):
        predictions(chair_trials, sets=9)


def test_draws_are_even_over_the_strata(rng):
    values, pool = rng.uniform(size=1000), np.arange(0, 1000, 2)
    drawn = _stratified(rng, pool, values, 50)
    assert np.unique(drawn).size == 50
    assert np.all(drawn % 2 == 0)
    ranks = np.searchsorted(np.sort(values[pool]), values[drawn])
    assert np.bincount(ranks // 50).tolist() == [5] * 10
    assert np.array_equal(_stratified(rng, pool[:7], values, 50), pool[:7])


def test_the_interval_of_a_rank_correlation_by_hand():
    first = np.arange(8.0)
    second = first[[1, 0, 3, 2, 5, 4, 7, 6]]
    rho, ci95, _ = _rank_correlation(first, second)
    # Every rank differs by one: 1 - 6 * 8 / (8 * 63).
    assert rho == pytest.approx(1 - 48 / 504)
    # Fisher's transformation; Bonett and Wright's variance (1 + rho^2 / 2) / (8 - 3); 97.5 % of a
    # normal is at 1.96.
    half = 1.959964 * np.sqrt((1 + rho**2 / 2) / 5)
    assert ci95 == pytest.approx(
        (np.tanh(np.arctanh(rho) - half), np.tanh(np.arctanh(rho) + half)), abs=1e-6
    )


def test_the_rank_correlation_is_spearmans_and_its_interval_has_its_coverage(rng):
    first = rng.normal(size=60)
    rho, (low, high), p = _rank_correlation(first, first + rng.normal(size=60))
    assert low < rho < high
    assert p < 1e-3
    # Of two normal samples with correlation r, Spearman's is 6 / pi asin(r / 2).
    truth = 6 / np.pi * np.arcsin(0.5**0.5 / 2)
    held = 0
    for _ in range(300):
        first = rng.normal(size=60)
        _, (low, high), _ = _rank_correlation(first, first + rng.normal(size=60))
        held += low <= truth <= high
    # Four standard errors of a proportion of 0.95 in 300.
    assert held / 300 > 0.95 - 4 * np.sqrt(0.95 * 0.05 / 300)
    assert _rank_correlation(first, np.ones(60)) == (None, None, None)
    assert _rank_correlation(first, 3 * first)[0] == stats.spearmanr(first, first).statistic

"""Tests of differences against SciPy and closed forms on known samples."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy import stats

from tcs_studies.robustness.differences import rank_sum, signed_rank


def test_rank_sum_is_scipys_with_ties_corrected(rng):
    first, second = rng.binomial(8, 0.8, 200) / 8, rng.binomial(8, 0.7, 250) / 8
    found = rank_sum(first, second)
    assert found.test == "rank sum"
    assert found.mean == pytest.approx(first.mean() - second.mean())
    assert found.p == stats.mannwhitneyu(first, second, method="asymptotic").pvalue
    # Without ties it is the rank sum of textbooks, but for the correction for continuity.
    one, other = rng.normal(size=60), rng.normal(0.3, size=60)
    assert rank_sum(one, other).p == pytest.approx(stats.ranksums(one, other).pvalue, rel=0.02)


def test_ranks_ignore_the_rounding_of_fractions(rng):
    ones = rng.integers(0, 8, 200)
    others = np.clip(ones + rng.integers(-1, 2, 200), 0, 7)
    weights = np.full(7, 1 / 7)
    # Fractions as sums of weights in two different orders.
    first = np.array([weights[:n].sum() for n in ones])
    second = np.array([1.0 - weights[n:].sum() for n in others])
    assert len(np.unique(np.abs(first - second))) > len(np.unique(np.abs(ones - others)))
    for test in (rank_sum, signed_rank):
        assert test(first, second).p == test(ones / 7.0, others / 7.0).p
        assert test(first, second).p == pytest.approx(test(1.0 * ones, 1.0 * others).p, rel=1e-12)


def test_zero_differences_are_ranked_after_pratt(rng):
    """The normal approximation written out: zeros are ranked, then excluded from both sums."""
    first, second = rng.binomial(8, 0.8, (2, 60)) / 8
    off = first - second
    n, zeros = off.size, int((off == 0.0).sum())
    assert 5 < zeros < 40
    sizes = np.abs(off)
    ranks = np.array([(sizes < d).sum() + ((sizes == d).sum() + 1) / 2 for d in sizes])
    mean = (n * (n + 1) - zeros * (zeros + 1)) / 4
    variance = (n * (n + 1) * (2 * n + 1) - zeros * (zeros + 1) * (2 * zeros + 1)) / 24
    ties = [int((sizes == d).sum()) for d in np.unique(sizes) if d > 0.0]
    variance -= sum(t**3 - t for t in ties) / 48
    z = abs(ranks[off > 0.0].sum() - mean) / math.sqrt(variance)
    assert signed_rank(first, second).p == pytest.approx(math.erfc(z / math.sqrt(2)), rel=1e-9)


def test_signed_rank_detects_a_paired_difference(rng):
    luck = rng.normal(size=100)
    first, second = luck + 0.05, luck + rng.normal(0, 0.05, 100)
    assert signed_rank(first, second).p < 1e-6
    assert rank_sum(first, second).p > 0.1
    low, high = signed_rank(first, second).ci95
    assert low < 0.05 < high


def test_a_single_sample_has_no_interval():
    for test in (rank_sum, signed_rank):
        for second in (0.25, 0.5):
            difference = test(np.array([0.5]), np.array([second]))
            assert difference.ci95 is None
            assert difference.mean == 0.5 - second
            assert 0.0 < difference.p <= 1.0
            # Strict JSON, without NaN.
            json.dumps(difference.to_json(), allow_nan=False)


def test_different_constant_samples_have_an_interval_without_width():
    """SciPy's t-test would warn of lost precision, and warnings are errors here."""
    first, second = np.full(10, 1.0), np.full(10, 0.7)
    for test in (rank_sum, signed_rank):
        found = test(first, second)
        assert found.mean == pytest.approx(0.3)
        assert found.ci95 == pytest.approx((0.3, 0.3))
        assert found.p < 0.01


@pytest.mark.parametrize("count", [2, 7, 40])
def test_the_interval_of_independent_samples_is_welchs(rng, count):
    first, second = rng.uniform(size=30).round(3), rng.uniform(size=count).round(3)
    expected = stats.ttest_ind(first, second, equal_var=False).confidence_interval(0.95)
    assert rank_sum(first, second).ci95 == pytest.approx(tuple(expected), rel=1e-12)


def test_one_constant_sample_leaves_the_spread_of_the_other(rng):
    first, second = rng.binomial(8, 0.8, 20) / 8, np.ones(20)
    half = stats.t.ppf(0.975, 19) * first.std(ddof=1) / math.sqrt(20)
    low, high = rank_sum(first, second).ci95
    assert (high - low) / 2 == pytest.approx(half, rel=1e-6)


def test_equal_samples_do_not_differ():
    ones = np.ones(10)
    assert rank_sum(ones, ones).p == signed_rank(ones, ones).p == 1.0
    assert signed_rank(ones, ones).ci95 == (0.0, 0.0)


def test_p_is_uniform_without_a_difference(rng):
    found = [signed_rank(*rng.binomial(8, 0.8, (2, 80)) / 8).p < 0.05 for _ in range(400)]
    # Four standard errors of a proportion of 0.05 in 400.
    assert abs(np.mean(found) - 0.05) < 4 * math.sqrt(0.05 * 0.95 / 400)

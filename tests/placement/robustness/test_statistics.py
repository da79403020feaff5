"""Means and intervals against closed forms and SciPy on known samples."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tcs.placement.robustness import mean_of


def test_mean_std_and_interval_by_hand():
    found = mean_of([0.25, 0.5, 0.5, 0.75])
    assert found.mean == 0.5
    assert found.std == pytest.approx(math.sqrt(0.125 / 3))
    # With a 0 and a 1: squares about 0.5 add up to 0.125 + 0.5. Student's t at 97.5 % of five
    # degrees of freedom, from a printed table.
    half = 2.5706 * math.sqrt(0.625 / 5) / math.sqrt(6)
    assert found.ci95 == pytest.approx((0.5 - half, 0.5 + half), abs=1e-4)


def test_the_interval_stays_between_zero_and_one():
    assert mean_of([0.0, 1.0, 1.0]).ci95 == (0.0, 1.0)


@pytest.mark.parametrize("value", [0.0, 0.5, 1.0])
def test_equal_samples_imply_no_certainty(value):
    found = mean_of(np.full(1000, value))
    low, high = found.ci95
    assert found.std == 0.0
    assert low <= value <= high
    # An event absent from n samples has a probability below 3.7 / n (97.5 %).
    assert 0.5e-3 < high - low < 3.7e-3
    assert mean_of([value]).std == 0.0


@pytest.mark.parametrize("count", [10, 64, 1024])
def test_failures_lower_both_ends_of_the_interval(count):
    ends = []
    for failures in range(6):
        samples = np.ones(count)
        samples[:failures] = 0.5
        found = mean_of(samples)
        assert found.ci95[0] <= found.mean <= found.ci95[1]
        ends.append(found.ci95)
    assert ends == sorted(ends, reverse=True)
    assert len({low for low, _ in ends}) == 6


@pytest.mark.parametrize("chance", [0.95, 0.99, 0.998])
def test_the_interval_of_rare_failures_has_its_coverage(rng, chance):
    covered = 0
    for _ in range(400):
        low, high = mean_of(rng.binomial(1, chance, 500)).ci95
        covered += low <= chance <= high
    # Four standard errors of a proportion of 0.95 in 400; greater coverage is acceptable.
    assert covered / 400 > 0.95 - 4 * math.sqrt(0.95 * 0.05 / 400)


def test_the_interval_of_fractions_has_its_coverage(rng):
    # Fractions of eight goals, each reached with probability 0.8.
    covered = 0
    for _ in range(400):
        low, high = mean_of(rng.binomial(8, 0.8, 50) / 8).ci95
        covered += low <= 0.8 <= high
    # Four standard errors of a proportion of 0.95 in 400.
    assert abs(covered / 400 - 0.95) < 4 * math.sqrt(0.95 * 0.05 / 400)


def test_a_single_sample_has_no_interval():
    found = mean_of([0.5])
    assert (found.mean, found.std, found.ci95) == (0.5, 0.0, None)

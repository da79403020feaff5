"""Successive halving finds the best sets with few samples, and its intervals have coverage."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from tcs.placement.robustness.estimation import round_sizes, successive_halving
from tcs.placement.robustness.statistics import intervals_of
from tcs.placement.tables import tc_reachability

WEIGHTS = np.array([0.5, 0.25, 0.25])


class Field:
    """Members that reach goals with known probabilities, correlated within a sample."""

    def __init__(self, rng, members=60, samples=1024):
        self.chance = rng.uniform(0.1, 0.9, (members, 3))
        shared = rng.uniform(size=(1, samples, 1))
        own = rng.uniform(size=(members, samples, 3))
        # Half of the random numbers are common to the sample, so that differences vary less.
        self.reached = (
            np.where(rng.uniform(size=own.shape) < 0.5, shared, own) < (self.chance[:, None])
        )
        self.tried = np.zeros((members, samples), dtype=int)

    def attempt(self, members, start, stop):
        self.tried[members, start:stop] += 1
        return self.reached[members, start:stop]

    def fractions(self, sets, samples=1024):
        reached = np.logical_or.reduce([self.reached[c, :samples] for c in sets.T], axis=0)
        return tc_reachability(reached, WEIGHTS)


@pytest.fixture
def field(rng):
    return Field(rng)


@pytest.fixture
def sets(rng):
    pairs = rng.integers(0, 60, (300, 2))
    return pairs[pairs[:, 0] != pairs[:, 1]]


def test_rounds_double_up_to_all_samples():
    assert round_sizes(1024) == (64, 128, 256, 512, 1024)
    assert round_sizes(65) == (64, 65)
    assert round_sizes(10) == (10,)


def test_estimates_use_the_samples_of_each_set(field, sets):
    found = successive_halving(sets, WEIGHTS, 1024, field.attempt)
    for k in range(len(sets)):
        fractions = field.fractions(sets[k : k + 1], found.samples[k])
        mean, low, high = intervals_of(fractions)
        assert found.mean[k] == pytest.approx(mean[0], abs=1e-7)  # float32 in between
        assert (found.low[k], found.high[k]) == pytest.approx((low[0], high[0]), abs=1e-6)


def test_halving_needs_fewer_samples_and_finds_the_best(field, sets):
    found = successive_halving(sets, WEIGHTS, 1024, field.attempt)
    truth = field.fractions(sets).mean(axis=1)
    assert found.survivors.size
    assert np.all(found.samples[found.survivors] == 1024)
    # The better half continues, so the survivors are at most slightly worse than the best.
    assert truth.max() - truth[found.survivors].max() < 0.01
    assert field.tried.max() == 1  # no pair is evaluated twice
    assert field.tried.sum() < 0.5 * field.tried.size
    assert np.count_nonzero(found.samples == 1024) < len(sets) / 15


def test_significantly_worse_sets_are_rejected(rng):
    field = Field(rng, members=3)
    field.reached[0], field.reached[1], field.reached[2] = True, False, True
    found = successive_halving(np.array([[0], [1], [2]]), WEIGHTS, 256, field.attempt)
    assert found.samples.tolist() == [256, 64, 128]
    assert found.mean.tolist() == [1.0, 0.0, 1.0]
    assert found.survivors.tolist() == [0]
    # Ties go to the first.
    assert 0.0 < found.high[1] < 3.7 / 64


def halved_by_loops(fractions, sizes):
    """Return the samples of each set and the survivors, from all fractions (sets, samples)."""
    count = len(fractions)
    bound = stats.norm.isf(0.05 / (count * len(sizes)))
    alive, had = list(range(count)), [0] * count
    for size in sizes:
        means = {k: fractions[k, :size].mean() for k in alive}
        leader = max(alive, key=lambda k: (means[k], -k))
        left = []
        for k in alive:
            had[k] = size
            off = fractions[k, :size] - fractions[leader, :size]
            if off.mean() + bound * off.std(ddof=1) / np.sqrt(size) >= 0.0:
                left.append(k)
        half = sorted(left, key=lambda k: (-means[k], k))[: (len(alive) + 1) // 2]
        alive = sorted(half)
    return had, alive


@pytest.mark.parametrize("ahead", [0.02, 0.1, 0.2, 0.3])
def test_rejections_agree_with_plain_loops(rng, ahead):
    """A leader with different leads, so that some sets are significantly worse."""
    sets = np.arange(40)[:, None]
    field = Field(rng, members=40)
    field.chance[:] = rng.uniform(0.4, 0.6, field.chance.shape)
    field.chance[7] = 0.6 + ahead
    random = np.where(
        rng.uniform(size=field.reached.shape) < 0.5,
        rng.uniform(size=(1, 1024, 1)), rng.uniform(size=field.reached.shape),
    )  # fmt: skip
    field.reached = random < field.chance[:, None]
    found = successive_halving(sets, WEIGHTS, 1024, field.attempt)
    had, alive = halved_by_loops(field.fractions(sets), round_sizes(1024))
    assert found.samples.tolist() == had
    assert found.survivors.tolist() == alive


def test_intervals_have_their_coverage(rng):
    # The true success is known: the probability that a member reaches a goal.
    held = count = 0
    for _ in range(20):
        field = Field(rng, members=20, samples=256)
        sets = np.stack([np.arange(20)], axis=1)
        found = successive_halving(sets, WEIGHTS, 256, field.attempt)
        truth = field.chance @ WEIGHTS
        held += np.count_nonzero((found.low <= truth) & (truth <= found.high))
        count += len(sets)
    # 95 % each; sets are correlated, hence the wider tolerance.
    assert held / count > 0.88


def test_no_sets_no_estimates(field):
    found = successive_halving(np.empty((0, 2), dtype=np.int64), WEIGHTS, 100, field.attempt)
    assert found.mean.size == found.survivors.size == 0

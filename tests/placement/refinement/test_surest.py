"""The surest sets: pairs of all candidates compared with plain loops, and the search from them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import tcs
from tcs.placement.refinement import PointScorer
from tcs.placement.refinement.local_search import Evaluated, Space
from tcs.placement.refinement.success_under_error import RememberedSamples, successes
from tcs.placement.refinement.surest import (
    StagedSamples,
    SurestSearch,
    best_pairs,
    surest_pairs,
    surest_triples,
)
from tcs.placement.robustness import PerturbedPoints, Trials
from tests.beside import BESIDE

SAMPLES = 40


class Made:
    """Samples in which a configuration reaches what a table says, by its first value."""

    def __init__(self, reached, rows=None):
        self.all = reached
        self.rows = np.arange(reached.shape[1]) if rows is None else rows
        self.evaluated = []

    @property
    def samples(self):
        return self.rows.size

    @property
    def order(self):
        return np.arange(self.samples)[::-1]

    def only(self, rows):
        return Made(self.all, self.rows[rows])

    def reached(self, points):
        self.evaluated += points[:, 0].astype(int).tolist()
        return self.all[points[:, 0].astype(int)][:, self.rows]


def points(*numbers):
    return np.array(numbers, dtype=float)[:, None]


@pytest.fixture
def made(rng):
    weights = np.array([0.5, 0.3, 0.2])
    return Made(rng.uniform(size=(9, 600, 3)) < 0.6), weights


def test_stages_end_with_all_samples_and_begin_with_the_hardest(made):
    samples, weights = made
    staged = StagedSamples.of(samples, weights)
    assert [part.samples for part in staged.parts] == [32, 96, 384, 88]
    assert staged.parts[0].of.rows.tolist() == list(range(599, 567, -1))
    found = staged.successes([points(1, 2), points(3)], 3)
    reached = samples.all.astype(float)
    expected = [
        np.maximum(reached[1], reached[2]).mean(axis=0) @ weights,
        reached[3].mean(0) @ weights,
    ]
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    first = staged.successes([points(3)], 0)[0]
    assert first == pytest.approx(reached[3, 568:].mean(axis=0) @ weights)


def test_a_configuration_is_evaluated_once_in_each_part(made):
    samples, weights = made
    staged = StagedSamples.of(samples, weights)
    for _ in range(2):
        staged.features(points(4, 5), 1)
        staged.successes([points(4, 5)], 1)
    assert [len(part.of.evaluated) for part in staged.parts] == [2, 2, 0, 0]


@pytest.mark.parametrize("count", [1, 5, 100])
def test_the_best_pairs_are_those_of_a_plain_loop(made, rng, monkeypatch, count):
    monkeypatch.setattr("tcs.placement.refinement.surest.CHUNK", 4)
    samples, weights = made
    staged = StagedSamples.of(samples, weights)
    features = staged.features(points(*range(9)), 3)
    allowed = np.triu(rng.uniform(size=(9, 9)) < 0.7, 1)
    first, second = best_pairs(features, features, allowed, np.zeros((9, 9)), count)
    pairs = [(a, b) for a, b in itertools.combinations(range(9), 2) if allowed[a, b]]
    success = dict(zip(pairs, staged.successes([points(a, b) for a, b in pairs], 3), strict=True))
    found = [success[a, b] for a, b in zip(first.tolist(), second.tolist(), strict=True)]
    # Features are single precision.
    np.testing.assert_allclose(found, sorted(success.values())[::-1][:count], atol=1e-6)


class Odd:
    """A space that allows sets with an odd sum of their first values, and all single members."""

    def allowed(self, members):
        return (members[:, :, 0].sum(axis=1) % 2 == 1) | (members.shape[1] == 1)


@pytest.mark.parametrize("members", [1, 2, 3])
def test_two_members_change_together_as_in_a_plain_loop(rng, monkeypatch, members):
    monkeypatch.setattr("tcs.placement.refinement.surest.SETS", (3, 2, 2, 1))
    weights = np.array([0.5, 0.3, 0.2])
    samples = Made(rng.uniform(size=(5 * members, 30, 3)) < 0.4)
    staged = StagedSamples.of(samples, weights)
    search = SurestSearch.of(None, Odd(), staged, rng)
    nothing = np.zeros((5, 3))
    choices = [
        Evaluated(
            points(*range(5 * i, 5 * i + 5)),
            nothing > 0.0,
            nothing,
            nothing,
            nothing.astype(np.uint8),
            nothing > 0.0,
            nothing,
        )
        for i in range(members)
    ]
    found = [tuple(one.values[:, 0].astype(int) % 5) for one in search._screened(choices)]
    success = {}
    for row in itertools.product(range(5), repeat=members):
        numbers = [5 * i + k for i, k in enumerate(row)]
        if np.count_nonzero(row) <= 2 and (members == 1 or sum(numbers) % 2):
            of_set = points(*numbers)
            success[row] = staged.successes([of_set], 0)[0]
    # Features are single precision.
    best = sorted(success.values())[::-1][:3]
    np.testing.assert_allclose([success[row] for row in found], best, atol=1e-6)


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    path = tmp_path_factory.mktemp("beside") / "beside.yaml"
    path.write_text(BESIDE)
    return path


@pytest.fixture(scope="module")
def scored(environment):
    return tcs.score("shaving", environment, paper=True)


@pytest.fixture(scope="module")
def search(scored):
    trials = Trials.of(scored)
    samples = PerturbedPoints(trials, trials.errors.draw(SAMPLES, 0, stream="refinement"), 2)
    staged = StagedSamples.of(samples, trials.weights)
    space = Space.of(scored.configurations, scored.nominal.sets)
    return SurestSearch.of(PointScorer.of(scored, 0), space, staged, np.random.default_rng(0))


def test_the_first_start_is_the_surest_pair_of_all_candidates(scored, search):
    sets = scored.nominal.sets
    found = surest_pairs(search.staged, search, sets, 3, 0.3)
    at = sets.cell_xy[sets.cell]
    pairs = [
        (int(sets.candidates[a]), int(sets.candidates[b]))
        for a, b in itertools.combinations(range(len(sets.candidates)), 2)
        if np.hypot(*(at[a] - at[b])) >= sets.min_distance - 1e-9
    ]
    success = search.staged.successes([search.points_of(pair) for pair in pairs], 1)
    first = search.staged.successes([search.points_of(found[0])], 1)[0]
    assert first == pytest.approx(success.max(), abs=1e-6)
    assert len(set(found)) == len(found) > 1


@pytest.fixture(scope="module")
def of_three(environment):
    return tcs.score("shaving", environment, max_members=3, paper=True)


def test_the_third_member_recovers_most_of_what_a_pair_loses(of_three, search):
    sets = of_three.nominal.sets
    staged = search.staged
    pairs = surest_pairs(staged, search, sets, 3, 0.3)
    found = surest_triples(staged, search, sets, pairs)
    at = sets.cell_xy[sets.cell]
    assert found
    thirds = {triple[:2]: triple for triple in found}
    assert set(thirds) <= set(pairs)
    for pair in pairs:
        rows = np.searchsorted(sets.candidates, pair)
        apart = np.hypot(*(at[:, None] - at[rows]).transpose(2, 0, 1)).min(axis=1)
        others = sets.candidates[apart >= sets.min_distance - 1e-9].tolist()
        of_sets = [search.points_of([*pair, other]) for other in others]
        success = staged.successes(of_sets, staged.stages - 1)
        triple = thirds.get(pair, pair)
        chosen = staged.successes([search.points_of(triple)], staged.stages - 1)[0]
        assert chosen == pytest.approx(success.max(), abs=1e-9)


def test_sets_of_three_need_a_table_of_them(scored, search):
    sets = scored.nominal.sets
    pairs = surest_pairs(search.staged, search, sets, 1, 0.3)
    assert surest_triples(search.staged, search, sets, pairs) == []


def test_pairs_that_lose_nothing_get_no_third_member(of_three, search, monkeypatch):
    sets = of_three.nominal.sets
    pairs = surest_pairs(search.staged, search, sets, 1, 0.3)
    monkeypatch.setattr(StagedSamples, "successes", lambda self, sets, stage: np.ones(len(sets)))
    assert surest_triples(search.staged, search, sets, pairs) == []


@pytest.mark.slow
def test_walks_are_surer_in_all_samples_with_every_move(search, scored):
    sets = scored.nominal.sets
    walks, _ = search.run([sets.best_single], 2, lambda done, total: None)
    last = search.staged.stages - 1
    moved = 0
    for walk in walks:
        found = search.staged.successes([place.values for place, _ in walk.course], last)
        assert np.all(np.diff([value for _, value in walk.course]) > 0.0)
        assert np.all(np.diff(found) > -1e-3)
        moved += len(walk.passed)
    assert moved > 0


def test_a_set_that_loses_nothing_stays(search, scored, monkeypatch):
    monkeypatch.setattr(StagedSamples, "successes", lambda self, sets, stage: np.ones(len(sets)))
    walks, _ = search.run([scored.nominal.sets.best], 3, lambda done, total: None)
    assert walks[0].passed == []


def test_success_and_its_pairs_through_the_product(scored, monkeypatch):
    monkeypatch.setattr("tcs.placement.refinement.refined_file.FRESH_SAMPLES", 30)
    refined = tcs.refine(scored, objective="success", starts=1, rounds=1, samples=SAMPLES)
    sets, table = scored.nominal.sets, refined.nominal.refined
    trials = Trials.of(scored)
    # The place is chosen in samples of their own, the starts among them.
    choosing = trials.errors.draw(SAMPLES, 0, stream="refinement choice")
    samples = RememberedSamples(PerturbedPoints(trials, choosing, 2))
    values = table.values[0, : table.sizes[0]]
    chosen = values
    at = np.stack([*scored.configurations.values(np.array(sets.best)).values()], axis=1)
    best = at
    found, before = successes(samples, trials.weights, [chosen, best])
    assert found >= before


@pytest.mark.slow
def test_sets_of_three_through_the_product(of_three, monkeypatch):
    monkeypatch.setattr("tcs.placement.refinement.refined_file.FRESH_SAMPLES", 30)
    options = {"objective": "success", "starts": 1, "rounds": 1, "samples": SAMPLES}
    refined = tcs.refine(of_three, **options).nominal.refined
    assert refined.origin.shape[1] == 3
    assert refined.sizes.max() == 3

"""Estimates for a small row: equal to evaluations, and independent of the number of jobs."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import tcs
from tcs.errors import SelectionError, TcsError
from tcs.placement.robustness import Trials, estimation, evaluate, robustify, success_summary


@pytest.fixture(scope="module")
def done(chair_file):
    return robustify(chair_file, samples=128, sets=100)


def test_every_table_gets_estimates_of_singles_and_pairs(chair_file, done):
    assert chair_file.nominal.success is None
    for table in done.tables:
        sets, success = table.sets, table.success
        assert 0 < success.of_size(1).size
        assert 0 < success.of_size(2).size <= 100
        # The sets with the best scores are among them, for comparison.
        assert success.row_of(tuple(sorted(sets.best))) is not None
        assert success.row_of(sets.best_single) is not None
        assert set(success.samples.tolist()) <= {64, 128}
    (made,) = done.metadata["robustness"]
    assert (made["samples"], made["seed"], made["body_collisions"]) == (128, 0, "all")
    assert made["errors"]["person_y"] == {"distribution": "normal", "std": 0.05}
    assert made["environment_errors"]


@pytest.mark.parametrize("many", [250, 50])
def test_sets_equal_in_reachability_to_the_best_contend(rng, many):
    """All of them and no others; if they are few, the next best are added."""
    reachability = np.where(np.arange(400) < many, 1.0, 0.9)
    manipulability = rng.uniform(0.0, 0.05, 400)
    rows = np.arange(400)[:, None]
    found = estimation._contenders(rows, reachability, manipulability)[:, 0]
    best = np.argsort(-(reachability + manipulability))
    assert found.tolist() == best[: max(many, estimation.MIN_CONTENDERS)].tolist()


def test_only_configurations_of_the_best_sets_are_screened(monkeypatch):
    monkeypatch.setattr(estimation, "MOST_SCREENED", 4)
    pool = np.array([[0, 1], [2, 3], [0, 4], [1, 2], [5, 6], [0, 3]])
    tried = []

    def reached(members, offsets, *, jobs):
        tried.extend(members.tolist())
        return np.ones((len(members), estimation.SCREENED, 2), np.bool_)

    trials = SimpleNamespace(
        errors=SimpleNamespace(draw=lambda samples, seed, stream: {}),
        scored=SimpleNamespace(sets=SimpleNamespace(candidates=np.arange(7))),
        reached=reached,
        weights=np.array([0.5, 0.5]),
    )
    found = estimation._screened(trials, pool, 3, seed=0, jobs=1)
    assert tried == [0, 1, 2, 3]
    # All are equally successful, so the best scores go first.
    assert found.tolist() == [[0, 1], [2, 3], [1, 2]]


def test_estimates_are_means_of_evaluations(done):
    trials = Trials.of(done)
    success = trials.scored.success
    offsets = trials.errors.draw(128, 0, stream=estimation.ESTIMATION_STREAM)
    for row in (0, int(np.argmax(success.success)), len(success.success) - 1):
        reached = trials.reached(success.set_at(row), offsets).any(axis=0)
        complete = reached[: success.samples[row]].all(axis=1)
        assert success.success[row] == pytest.approx(complete.mean(), abs=1e-7)  # float32
        assert success.rooms_done[row] == complete.mean()


def test_by_the_rules_of_the_paper_success_is_the_mean_of_the_goals(chair_file):
    made = robustify(chair_file, samples=64, sets=20, body_collisions="paper")
    trials = Trials.of(made, body_collisions="paper")
    success = trials.scored.success
    offsets = trials.errors.draw(64, 0, stream=estimation.ESTIMATION_STREAM)
    row = int(np.argmax(success.success))
    reached = trials.reached(success.set_at(row), offsets).any(axis=0)
    fractions = reached[: success.samples[row]] @ trials.weights
    assert success.success[row] == pytest.approx(fractions.mean(), abs=1e-7)  # float32
    assert success.rooms_done[row] == reached[: success.samples[row]].all(axis=1).mean()


def test_same_numbers_for_any_number_of_jobs(chair_file, done):
    again = robustify(chair_file, samples=128, sets=100, jobs=1)
    for one, other in zip(done.tables, again.tables, strict=True):
        assert np.array_equal(one.success.members, other.success.members)
        assert np.array_equal(one.success.success, other.success.success)


def test_the_most_robust_set_does_no_worse_on_fresh_samples(done):
    robust = evaluate(done, select="robust", samples=200, seed=7)
    best = evaluate(done, select="best", samples=200, seed=7)
    difference = robust.done.all(axis=1).astype(float) - best.done.all(axis=1)
    # Four standard errors of the mean paired difference.
    assert difference.mean() > -4 * difference.std() / np.sqrt(200)


@pytest.mark.slow
def test_one_table_alone(bed_file):
    done = robustify(bed_file, samples=64, sets=20, tables=[1])
    assert done.tables[0].success is None
    assert done.tables[1].success is not None
    with pytest.raises(SelectionError, match="tcs robustify"):
        evaluate(done, select="robust", table=0)
    (table,) = success_summary(done)["tables"]
    assert table["observed"] == {"person_y": 0.05}
    # Each table keeps the settings of its estimates.
    both = robustify(done, samples=65, sets=10, body_collisions="paper", tables=[0])
    assert [made["samples"] for made in both.metadata["robustness"]] == [65, 64]
    assert [table["settings"]["body_collisions"] for table in success_summary(both)["tables"]] == [
        "paper",
        "all",
    ]


def test_selection_weighs_the_estimates(done):
    here = tcs.InitialConfiguration(base_x=0.5, base_y=-1.0, base_yaw=0.0, torso=0.0)
    weights = tcs.UtilityWeights(reachability=0, manipulability=0, travel=0, success=1)
    choice = tcs.select(done, here, weights=weights)
    assert choice.success_ci95[0] == done.nominal.success.low.max() == choice.utility
    assert done.nominal.success.row_of(choice.indices) == np.argmax(done.nominal.success.low)


def test_summary_and_progress(chair_file):
    steps = []
    done = robustify(chair_file, samples=70, sets=8, on_progress=lambda *step: steps.append(step))
    # Screening, two rounds for each size, and the motions.
    assert steps == [(i + 1, 6) for i in range(6)]
    (table,) = success_summary(done)["tables"]
    assert table["observed"] == {}
    # With the sets of the greatest P_R + P_M, for comparison.
    assert [best["sets"] for best in table["best"]] == [3, 9]
    assert [len(best["members"]) for best in table["best"]] == [1, 2]


@pytest.mark.parametrize("options", [{"sets": 0}, {"samples": 0}, {"seed": -1}], ids=str)
def test_numbers_out_of_range_are_refused(bed_file, options):
    with pytest.raises(TcsError, match="must be"):
        robustify(bed_file, **options)

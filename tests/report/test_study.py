"""The study behind the robustness report."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from tcs.report.samples import evaluations, samples_csv
from tcs.report.study import predicted, study_row, study_rows
from tcs.robustness import Trials, evaluate
from tcs.store import load_scores


@pytest.fixture(scope="module")
def table(study, lossless):
    """Every sample, read back."""
    return list(csv.DictReader(io.StringIO(samples_csv([study, lossless]).decode())))


def test_the_number_of_processes_changes_nothing(study, score_path, plan):
    (alone,) = study_rows([score_path], plan, jobs=1)
    two = study_row(score_path, plan, jobs=2)
    for other in (alone, two):
        np.testing.assert_array_equal(other.best.reached, study.best.reached)
        for found, expected in zip(other.predictions, study.predictions, strict=True):
            np.testing.assert_array_equal(found.success, expected.success)
        assert other.losses == study.losses
        assert other.map == study.map
        # Not in the paper's Table III.
        assert other.methods is None


def test_the_best_set_is_evaluated_as_anywhere_else(study, score_path, plan):
    found = evaluate(load_scores(score_path), samples=plan.samples, seed=plan.seed)
    np.testing.assert_array_equal(study.best.reached, found.reached)
    np.testing.assert_array_equal(study.methods.cells[2, True].reached, found.reached)


def test_predicted_success_is_that_of_each_set(score_path, plan):
    trials = Trials.of(load_scores(score_path))
    found = predicted(trials, replace(plan, sets=4), members=2)
    assert found.members == 2
    offsets = trials.errors.draw(plan.set_samples, plan.seed, stream="prediction")
    sets = trials.scored.sets
    for manipulability, success in zip(found.manipulability, found.success, strict=True):
        tried = [
            evaluate(trials, samples=plan.set_samples, stream="prediction", select=members)
            for members in _sets_of(trials, manipulability)
        ]
        assert any(one.summary.mean == pytest.approx(success, abs=1e-12) for one in tried)
    assert all(len(values) == plan.set_samples for values in offsets.values())
    assert sets.max_members == 2


def _sets_of(trials, manipulability):
    """Return the kept pairs with that P_M."""
    from tcs.robustness.kept import uniform_sets

    drawn = np.unique(uniform_sets(trials.scored.sets, 2, 4, 0)[0], axis=0)
    scores = [trials.scored.sets.scores_of(tuple(row))[1] for row in drawn.tolist()]
    return [
        row for row, score in zip(drawn.tolist(), scores, strict=True) if score == manipulability
    ]


def test_correlation_is_that_of_the_ranks(study):
    from scipy.stats import rankdata

    assert [found.members for found in study.predictions] == [1, 2]
    for found in study.predictions:
        if len(found.success) < 3:
            # Any two points rise or fall together: that says nothing.
            assert (found.rank_correlation, found.p) == (0.0, 1.0)
            continue
        ranks = np.corrcoef(rankdata(found.manipulability), rankdata(found.success))
        assert found.rank_correlation == pytest.approx(ranks[0, 1], abs=1e-12)
        assert 0.0 <= found.p <= 1.0


def test_every_sample_is_in_the_file(study, lossless, table, plan):
    tried = sum(found.samples for row in (study, lossless) for *_, found in evaluations(row))
    assert len(table) == tried
    # The best set, the best single, and four methods on common and on own samples.
    assert tried == 2 * 10 * plan.samples


def test_means_can_be_had_from_the_file(study, table):
    shares = [
        float(line["share"])
        for line in table
        if (line["task"], line["method"], line["draw"]) == ("shaving", "best set", "common")
    ]
    # Written with nine digits.
    assert np.mean(shares) == pytest.approx(study.best.summary.mean, abs=1e-8)
    for line in table:
        # All eight goals of shaving weigh the same.
        assert float(line["share"]) == pytest.approx(line["goals"].count("1") / 8, abs=1e-8)


def test_errors_are_those_that_were_drawn(study, table):
    first = table[0]
    assert (first["sample"], first["method"]) == ("0", "best set")
    for name, values in study.best.offsets.items():
        assert float(first[name]) == pytest.approx(values[0], rel=1e-5)
    assert first["members"] == "+".join(map(str, study.best.sets[0]))

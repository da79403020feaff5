"""The study behind the robustness report."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from tcs.output.report.samples import evaluations, samples_csv
from tcs.output.report.study import study_row, study_rows
from tcs.placement.robustness import evaluate
from tcs.placement.store import load_scores


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


def test_the_set_chosen_by_success_is_the_one_the_file_estimates_best(study, score_path):
    nominal = load_scores(score_path).nominal
    surest = nominal.success.surest(nominal.sets)
    assert set(study.gain.robust.sets[0].tolist()) == set(surest)
    assert study.gain is study.gains[-1]
    np.testing.assert_array_equal(study.gain.scored.reached, study.best.reached)


def test_points_of_a_prediction_are_those_it_ranks(study):
    from scipy.stats import rankdata

    for found in study.predictions:
        assert len(found.manipulability) == len(found.success) == found.sets
        if found.rho is not None:
            ranks = np.corrcoef(rankdata(found.manipulability), rankdata(found.success))
            assert found.rho == pytest.approx(ranks[0, 1], abs=1e-12)


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

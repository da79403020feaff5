"""Studies of a small row: the same for any number of processes, made of ordinary evaluations."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from tcs.errors import StoreMismatchError
from tcs.placement.robustness import evaluate, robustify
from tcs.placement.store import load_scores, save_scores
from tcs_studies.robustness.study import StudyPlan, check_row, study_row, study_rows
from tests.placement.store.example import score_file

PLAN = StudyPlan(samples=60, sets=12, set_samples=6)


@pytest.fixture(scope="module")
def score_path(tmp_path_factory, chair_file):
    path = tmp_path_factory.mktemp("study") / "shaving-small-chair-pr2.tcs"
    save_scores(path, robustify(chair_file, sets=12, samples=32))
    return path


@pytest.fixture(scope="module")
def study(score_path):
    """The study of that file, with the comparison of methods."""
    return study_row(score_path, dataclasses.replace(PLAN, compared=(("shaving", "small-chair"),)))


def test_the_number_of_processes_changes_nothing(study, score_path):
    (alone,) = study_rows([score_path], PLAN, jobs=1)
    two = study_row(score_path, PLAN, jobs=2)
    for other in (alone, two):
        np.testing.assert_array_equal(other.best.reached, study.best.reached)
        for found, expected in zip(other.predictions, study.predictions, strict=True):
            np.testing.assert_array_equal(found.success, expected.success)
        assert other.losses == study.losses
        assert other.path == score_path
        # The plan compares methods on no row.
        assert other.methods is None


def test_the_best_set_is_evaluated_as_anywhere_else(study, score_path):
    found = evaluate(
        load_scores(score_path), samples=PLAN.samples, seed=PLAN.seed, body_collisions="paper"
    )
    np.testing.assert_array_equal(study.best.reached, found.reached)
    np.testing.assert_array_equal(study.methods.paired[2, True].reached, found.reached)


def test_the_set_selected_by_success_is_the_most_robust_of_the_file(study, score_path):
    nominal = load_scores(score_path).nominal
    expected = nominal.success.most_robust(nominal.sets)
    assert set(study.gain.robust.sets[0].tolist()) == set(expected)
    assert study.gain is study.gains[-1]
    np.testing.assert_array_equal(study.gain.scored.reached, study.best.reached)


def test_points_of_a_prediction_are_those_it_ranks(study):
    from scipy.stats import rankdata

    for found in study.predictions:
        assert len(found.manipulability) == len(found.success) == found.sets
        if found.rho is not None:
            ranks = np.corrcoef(rankdata(found.manipulability), rankdata(found.success))
            assert found.rho == pytest.approx(ranks[0, 1], abs=1e-12)


def test_a_file_of_another_row_is_refused():
    path, file = Path("feeding-wheelchair-pr2.tcs"), score_file()
    with pytest.raises(StoreMismatchError, match="not scored as the paper scores its rows"):
        check_row(path, file, "shaving", "wheelchair", "pr2")
    file.metadata["paper"] = True
    check_row(path, file, "shaving", "wheelchair", "pr2")
    with pytest.raises(StoreMismatchError, match="has task 'shaving', not 'feeding'"):
        check_row(path, file, "feeding", "wheelchair", "pr2")

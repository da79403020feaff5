"""Results of a study: samples, who is left out, what is missing; against sums by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import DataFileError
from tcs_studies.experiment.comparison import Comparison, hypothesis
from tcs_studies.experiment.statistics import group_statistics, signed_rank_test
from tcs_studies.study.participants import new_participant
from tcs_studies.study.recording import StudyRecording
from tcs_studies.study.results import questionnaire_scores, study_results
from tests.studies.study.example import answers_to, complete, run_on, small_study


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Six participants: four complete ones with a form and a trial missing, others left out."""
    study = small_study(tmp_path_factory.mktemp("study"))
    for place in range(2):
        complete(study, place)
    complete(study, 2, omit=["novel/van-der-laan"])
    complete(study, 3, omit=["end-effector/trial-1"])
    complete(study, 4).drop("hit the table")
    StudyRecording(study, new_participant(study)).skip("late")
    return study


@pytest.fixture(scope="module")
def results(study):
    return study_results(study)


def test_complete_participants_are_included(results):
    assert [one.participant for one in results.included] == ["P01", "P02", "P03", "P04"]
    assert len(results.participants) == 6


def test_what_is_left_out_and_missing_is_reported(results):
    assert results.notes == (
        "P05 was dropped and is left out: hit the table.",
        "P06 is left out: 1 of 14 steps are recorded.",
        "P03, novel/van-der-laan is missing: omitted.",
        "P04, end-effector/trial-1 is missing: omitted.",
    )


def test_samples_are_of_who_has_a_value_and_tests_of_who_has_both(results):
    found = results.comparison
    assert len(found.sample("end-effector", "time")) == 3
    assert len(found.sample("novel", "time")) == 4
    assert found.compared("time", "end-effector", "novel").count == 3
    assert found.compared("usefulness", "end-effector", "novel").count == 3
    assert len(found.sample("end-effector", "usefulness")) == 4
    assert found.described("novel", "time").count == 4


def test_tests_are_those_of_scripted_operators(results):
    found = results.comparison
    both = [found.values["accuracy"][one][:3] for one in ("end-effector", "novel")]
    assert found.compared("accuracy", "end-effector", "novel") == signed_rank_test(
        *both, tail="greater"
    )
    sample = found.sample("novel", "workload")
    assert found.described("novel", "workload") == group_statistics(sample)


def test_means_are_over_the_trials_that_count(tmp_path):
    study = small_study(tmp_path, training=1, trials=2)
    recording = StudyRecording(study, new_participant(study))
    off = iter([0.09, 0.02, 0.04, 0.01, 0.01, 0.01])
    while (step := recording.next_step) is not None:
        if step.form is None:
            recording.record_run(run_on(study, step.condition, off=next(off), seed=step.number))
        else:
            recording.save_answers(step, answers_to(recording.form(step)))
    found = study_results(study).comparison
    assert found.values["accuracy"]["end-effector"] == pytest.approx([0.03], abs=1e-3)
    assert found.learning["accuracy"]["end-effector"][0] == pytest.approx(
        [0.09, 0.02, 0.04], abs=1e-3
    )
    assert found.described("end-effector", "accuracy") is None


def test_scores_by_hand(study, results):
    # Option 1, counted from 0, everywhere: box 2 of 5, rating 1 of 20, agreement 2.
    scores = questionnaire_scores(study, results.included[1])
    # A tick at 2 is +1, and -1 where the right end is positive: items 3, 6 and 8.
    assert scores["novel", "usefulness"] == pytest.approx((1 - 1 + 1 + 1 + 1) / 5)
    assert scores["novel", "satisfaction"] == pytest.approx((1 + 1 - 1 - 1) / 4)
    # Equal ratings have their value as the weighted mean, whatever the weights.
    assert scores["novel", "workload"] == pytest.approx(5.0)
    assert scores["novel", "difficulty"] == 2.0
    assert ("novel", "usefulness") not in questionnaire_scores(study, results.included[2])


def test_preferences_are_counted(results):
    # Places 0 to 3 take the first or the second condition of orders that alternate as well.
    assert results.preferred() == {"end-effector": 4}


def test_pairs_that_were_compared_once_weigh_all_conditions(tmp_path):
    study = small_study(tmp_path, tlx_weights="once", questionnaires=("nasa-tlx",))
    scores = questionnaire_scores(study, complete(study, 3).participant)
    assert scores["novel", "workload"] == scores["end-effector", "workload"] == pytest.approx(15.0)


def test_a_changed_or_lost_run_is_missing(tmp_path):
    study = small_study(tmp_path)
    complete(study, 1)
    runs = sorted((tmp_path / "runs").glob("*-trial-1.csv"))
    runs[0].write_bytes(runs[0].read_bytes() + b"\n")
    runs[1].unlink()
    notes = " ".join(study_results(study).notes)
    assert "P01, end-effector/trial-1 is missing: run" in notes
    assert "is not the file that was recorded." in notes
    assert "P01, novel/trial-1 is missing: run" in notes
    assert "No such file" in notes


def test_scripted_operators_are_named(tmp_path):
    study = small_study(tmp_path)
    recording = StudyRecording(study, new_participant(study))
    while (step := recording.next_step) is not None:
        if step.form is None:
            run = run_on(study, step.condition, seed=step.number, operator_type="scripted")
            recording.record_run(run)
        else:
            recording.skip("rehearsal")
    found = study_results(study)
    assert "scripted operators" in found.comparison.operators
    assert "Runs of scripted operators, not people, are those of: P01." in found.notes


def test_a_study_without_complete_participants_is_an_error(tmp_path):
    study = small_study(tmp_path)
    with pytest.raises(DataFileError, match="It has no participants"):
        study_results(study)
    new_participant(study)
    with pytest.raises(DataFileError, match="P01 is left out: 0 of 14 steps"):
        study_results(study)


def test_hypotheses_are_of_the_papers_two_controllers():
    assert hypothesis("usefulness", "end-effector", "novel") == "less"
    assert hypothesis("accuracy", "end-effector", "novel") == "greater"
    assert hypothesis("accuracy", "novel", "assisted") == "two-sided"


def test_an_analysis_without_errors_is_undefined():
    flat = {"a": np.arange(4.0), "b": np.arange(4.0) + 1.0}
    found = Comparison({"a": "A", "b": "B"}, {"time": flat}, "4 participants", {}, 0)
    assert found.varied("time") is None
    one = Comparison({"a": "A"}, {"time": {"a": np.arange(4.0)}}, "4 participants", {}, 0)
    assert one.varied("time") is None

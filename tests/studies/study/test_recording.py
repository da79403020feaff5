"""Steps of participants: order, trials, answers, resuming, and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tcs.errors import DataFileError, OutputError, UnknownNameError
from tcs.teleop.runs.run_files import load_run, save_run
from tcs_studies.experiment.trial import measure
from tcs_studies.study.forms import PAIR, background_form, difficulty_form, tlx_pairs_form
from tcs_studies.study.participants import (
    exclusive_session,
    load_participant,
    load_participants,
    new_participant,
    participant_path,
)
from tcs_studies.study.recording import StudyRecording
from tcs_studies.study.steps import form_of, steps_of
from tcs_studies.study.study_file import conditions_of, load_study
from tcs_studies.study.trials import attempt_of, trial_measures
from tests.studies.study.example import LINE, answers_to, complete, run_on, small_study


@pytest.fixture
def study(tmp_path):
    return small_study(tmp_path)


@pytest.fixture
def recording(study):
    """The session of the first participant, who has answered the first form."""
    found = StudyRecording(study, new_participant(study))
    found.save_answers(found.next_step, {})
    return found


def on_disk(recording):
    return load_participant(recording.study, recording.participant.participant)


def test_participants_take_the_orders_of_the_papers_table_in_turn(study):
    names = [new_participant(study) for _ in range(4)]
    assert [one.participant for one in names] == ["P01", "P02", "P03", "P04"]
    assert [one.order for one in names] == [
        ["end-effector", "novel"],
        ["novel", "end-effector"],
    ] * 2


def test_who_replaces_a_dropped_participant_takes_that_order(study):
    first, _ = new_participant(study), new_participant(study)
    StudyRecording(study, first).drop("ill")
    assert new_participant(study).order == first.order
    assert [one.dropped for one in load_participants(study)] == ["ill", None, None]


def test_steps_of_a_condition_are_training_trials_and_questionnaires(study):
    keys = [one.key for one in steps_of(study, ["novel", "end-effector"])]
    of_one = [
        "training-1", "trial-1", "van-der-laan", "tlx-ratings", "tlx-pairs", "difficulty",
    ]  # fmt: skip
    assert keys == [
        "background",
        *(f"novel/{one}" for one in of_one),
        *(f"end-effector/{one}" for one in of_one),
        "preference",
    ]


def test_pairs_of_workload_once_are_compared_after_the_first_condition(tmp_path):
    study = small_study(tmp_path, tlx_weights="once", questionnaires=("nasa-tlx",))
    keys = [one.key for one in steps_of(study, ["novel", "end-effector"])]
    assert [key for key in keys if "tlx" in key] == [
        "novel/tlx-ratings", "novel/tlx-pairs", "end-effector/tlx-ratings",
    ]  # fmt: skip


def test_every_record_is_on_the_disk_at_once(recording):
    assert list(on_disk(recording).steps) == ["background"]
    recording.record_run(run_on(recording.study, "end-effector"))
    assert list(on_disk(recording).steps) == ["background", "end-effector/training-1"]
    resumed = StudyRecording(recording.study, on_disk(recording))
    assert resumed.next_step.key == "end-effector/trial-1"
    assert resumed.progress() == (2, 14)


def test_a_run_file_is_copied_byte_by_byte(recording, tmp_path):
    path = tmp_path / "mine.csv"
    save_run(path, run_on(recording.study, "end-effector"))
    measures = recording.attach_run(path)
    copy = recording.study.folder / "runs" / "P01-end-effector-training-1.csv"
    assert copy.read_bytes() == path.read_bytes()
    # 1 s before the first command, 2 s along the line; 2 cm before its end the trial is over.
    assert measures.time == pytest.approx(1.93, abs=0.05)
    # The samples of a plane are up to 5 mm from it along the line.
    assert measures.accuracy == pytest.approx(0.01, abs=1e-3)
    assert measures.finished == 1.0


def test_a_run_is_not_the_run_of_two_trials(recording, tmp_path):
    path = tmp_path / "mine.csv"
    save_run(path, run_on(recording.study, "end-effector"))
    recording.attach_run(path)
    with pytest.raises(DataFileError, match=r"is already that of P01, end-effector/training-1"):
        recording.attach_run(path)


def test_a_run_that_does_not_reach_the_end_counts_with_the_time_limit(recording):
    found = recording.record_run(run_on(recording.study, "end-effector", reached=0.8))
    assert (found.finished, found.time) == (0.0, 120.0)


@pytest.mark.parametrize(
    ("metadata", "message"),
    [
        ({"condition": "novel"}, r"its condition is 'novel', but the next trial needs 'end-eff"),
        ({"limits": "clamped"}, r"its limits is 'clamped', but the next trial needs 'paper'"),
        ({"robot": "panda"}, r"its robot is 'panda', but the next trial needs 'iiwa7'"),
        ({"line_end": [1.0, 0, 0]}, r"not recorded on the line of the study"),
        ({"line_start": "here"}, r"not recorded on the line of the study"),
        ({"line_start": [10**400, 0, 0]}, r"not recorded on the line of the study"),
    ],
)
def test_runs_of_other_trials_are_refused(recording, metadata, message):
    with pytest.raises(DataFileError, match=message):
        recording.record_run(run_on(recording.study, "end-effector", **metadata))
    assert list(on_disk(recording).steps) == ["background"]


@pytest.mark.parametrize(
    ("condition", "accepted"), [("stick", True), ("joystick 2", True), (None, True), ("a", False)]
)
def test_a_condition_that_is_driven_elsewhere_has_any_run_but_those_of_others(
    tmp_path, condition, accepted
):
    conditions = [
        {"name": "stick", "title": "Joystick"},
        {"name": "a", "title": "A", "limits": "paper"},
    ]
    study = small_study(tmp_path, conditions=conditions)
    recording = StudyRecording(study, new_participant(study))
    recording.skip("none")
    run = run_on(study, condition, limits="clamped")
    if accepted:
        assert recording.record_run(run).finished == 1.0
    else:
        with pytest.raises(DataFileError, match="its condition is 'a'"):
            recording.record_run(run)


def test_a_scripted_trial_has_the_measures_of_the_experiment(study):
    whole = run_on(study, "novel", operator_type="scripted")
    # A trial of the experiment ends at the first sample within the sphere at the end.
    trial = attempt_of(whole, study.course, 120.0)
    assert 2 < len(trial) < len(whole)
    np.testing.assert_array_equal(trial.position, whole.position[: len(trial)])
    assert trial_measures(study, trial) == measure(trial, study.course)


def test_a_hand_that_did_not_move_is_refused(recording):
    with pytest.raises(DataFileError, match="samples"):
        recording.record_run(run_on(recording.study, "end-effector", reached=0.0))


def test_trials_and_forms_are_recorded_in_order(recording):
    steps = {one.key: one for one in steps_of(recording.study, recording.participant.order)}
    with pytest.raises(DataFileError, match="not the next one"):
        recording.save_answers(steps["preference"], {"preferred": "novel"})
    recording.record_run(run_on(recording.study, "end-effector"))
    recording.record_run(run_on(recording.study, "end-effector", seed=1))
    with pytest.raises(DataFileError, match=r"no trial is due\. Next: questionnaire"):
        recording.record_run(run_on(recording.study, "end-effector", seed=2))


def test_first_answers_are_kept(study):
    recording = StudyRecording(study, new_participant(study))
    step = recording.next_step
    assert recording.save_answers(step, {"age": "30"})
    assert not recording.save_answers(step, {"age": "40"})
    assert on_disk(recording).steps["background"].answers == {"age": 30}


def test_missing_steps_have_a_reason(recording):
    assert recording.skip("robot failed").key == "end-effector/training-1"
    assert on_disk(recording).steps["end-effector/training-1"].missing == "robot failed"


@pytest.mark.parametrize("reason", ["", " ", "x" * 501])
def test_blank_and_long_reasons_are_refused_and_not_saved(recording, reason):
    before = on_disk(recording)
    with pytest.raises(DataFileError, match="the reason has"):
        recording.skip(reason)
    with pytest.raises(DataFileError, match="the reason has"):
        recording.drop(reason)
    assert on_disk(recording) == before == recording.participant


def test_a_dropped_participant_is_not_continued(recording):
    recording.drop("ill")
    with pytest.raises(DataFileError, match="was dropped: ill"):
        StudyRecording(recording.study, on_disk(recording))


def test_one_process_records_a_participant(recording):
    with exclusive_session(recording.study, "P01"):
        with pytest.raises(OutputError, match="recorded by another process"):
            with exclusive_session(recording.study, "P01"):
                pass
        with exclusive_session(recording.study, "P02"):
            pass
    with exclusive_session(recording.study, "P01"):
        pass


def test_a_complete_participant_is_read_back(study):
    recording = complete(study, 3)
    assert recording.next_step is None
    assert on_disk(recording) == recording.participant
    for record in on_disk(recording).steps.values():
        if record.run is not None:
            load_run(study.folder / record.run)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda one: one.update(order=["novel"]), "study.yaml changed"),
        (lambda one: one.update(participant="P07"), "is of participant 'P07'"),
        (
            lambda one: one["steps"].update({"novel/trial-9": {"recorded": "", "missing": "x"}}),
            "ste",
        ),
        (lambda one: one["steps"]["background"].update(answers={"age": 7}), "16 to 120"),
        (lambda one: one["steps"]["background"].update(answers={"age": True}), "answers"),
        (lambda one: one["steps"]["background"].update(missing="both"), "one of run, answers and"),
        (
            lambda one: one["steps"].update({"novel/trial-1": {"recorded": "", "run": "../a"}}),
            "runs/",
        ),
        (
            lambda one: one["steps"].update({"novel/trial-1": {"recorded": "", "answers": {}}}),
            "trial",
        ),
        (lambda one: one.update(format_version=2), "format_version"),
    ],
)
def test_changed_files_are_refused_in_a_line(recording, change, message):
    path = participant_path(recording.study, "P01")
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    with pytest.raises((DataFileError, UnknownNameError)) as caught:
        on_disk(recording)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "[1]", "{", "{" * 5000, "\xff"])
def test_files_that_are_no_json_objects_are_refused(recording, text):
    participant_path(recording.study, "P01").write_text(text, encoding="latin-1")
    with pytest.raises(DataFileError, match="participant '"):
        on_disk(recording)


def test_the_plan_is_read_back_and_not_overwritten(study):
    assert load_study(study.folder) == study
    with pytest.raises(OutputError, match="exists"):
        small_study(study.folder)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trials": 0}, "trials"),
        ({"conditions": [{"name": "a", "title": "A"}] * 2}, "must differ"),
        ({"conditions": [{"name": "../a", "title": "A"}, {"name": "b", "title": "B"}]}, "name"),
        ({"line": {**LINE, "end": LINE["start"]}}, "differ"),
        ({"questionnaires": ["sus"]}, "questionnaires"),
    ],
)
def test_invalid_plans_are_refused(study, changes, message):
    import yaml

    path = study.folder / "study.yaml"
    path.write_text(yaml.safe_dump(json.loads(json.dumps({**study.plan.model_dump(), **changes}))))
    with pytest.raises(DataFileError, match=message):
        load_study(study.folder)


def test_conditions_of_the_command_line():
    known, other = conditions_of(["novel", "stick=Joystick"])
    assert (known.title, known.limits) == ("novel controller", "paper")
    assert (other.title, other.limits) == ("Joystick", None)
    with pytest.raises(DataFileError, match="another one with its title"):
        conditions_of(["nowel"])


@pytest.mark.parametrize("raw", [3, "3"])
def test_texts_of_a_page_and_numbers_of_a_file_are_the_same_answers(raw):
    form = difficulty_form("novel controller")
    assert form.checked({"difficulty": raw, "comments": " "}, "form") == {"difficulty": 3}


@pytest.mark.parametrize("raw", [0, 6, "6", True, 3.0, "three", "3 ", [3], {}, None, ""])
def test_answers_outside_the_scale_are_refused(raw):
    with pytest.raises(DataFileError, match="form: 'difficulty'"):
        difficulty_form("novel controller").checked({"difficulty": raw}, "form")


@pytest.mark.parametrize("raw", ["15", "121", "-20", "2e1", "20.5", "٢٠", "9" * 5000, True])
def test_ages_that_are_none_are_refused(raw):
    with pytest.raises(DataFileError, match="whole number from 16 to 120"):
        background_form().checked({"age": raw}, "form")


def test_texts_have_no_control_codes_and_a_length():
    form = background_form()
    assert form.checked({"gender": "a\x00b\x1bc"}, "form") == {"gender": "a b c"}
    with pytest.raises(DataFileError, match="2,000 at most"):
        form.checked({"gender": "x" * 2001}, "form")


def test_pairs_are_shuffled_by_participant_and_each_is_there_once(study):
    order = ["end-effector", "novel"]
    step = next(one for one in steps_of(study, order) if one.form == "tlx-pairs")
    keys = [
        [one.key for one in form_of(study, name, order, step).questions] for name in ("P01", "P02")
    ]
    plain = [one.key for one in tlx_pairs_form("any").questions]
    assert keys[0] != keys[1]
    assert sorted(keys[0]) == sorted(keys[1]) == sorted(plain)
    assert len({frozenset(key.split(PAIR)) for key in plain}) == 15


def test_answers_are_valid_for_every_form(study):
    for step in steps_of(study, ["novel", "end-effector"]):
        if step.form is not None:
            form = form_of(study, "P01", ["novel", "end-effector"], step)
            assert form.faults(answers_to(form, 1)) == {}

"""`tcs study`: a plan, participants from run files and answers, resuming, and what is refused."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

from tcs.teleop.runs.run_files import save_run
from tcs_studies.output.terminal_tables import report_study
from tcs_studies.study.participants import load_participant, new_participant, participant_names
from tcs_studies.study.recording import StudyRecording
from tcs_studies.study.steps import form_of, steps_of
from tcs_studies.study.study_file import load_study
from tests.studies.study.example import answers_to, complete, run_on, small_study


@pytest.fixture
def study(tmp_path):
    return small_study(tmp_path / "mine")


def answers_file(study, path, name="P01", order=("end-effector", "novel"), omit=()):
    """Answers to all forms of a participant."""
    content = {
        step.key: answers_to(form_of(study, name, order, step), 2)
        for step in steps_of(study, order)
        if step.form is not None and step.key not in omit
    }
    path.write_text(yaml.safe_dump(content))
    return path


def run_files(study, folder, order=("end-effector", "novel")):
    """A run file for each trial of a participant, as options."""
    words = []
    for i, step in enumerate(one for one in steps_of(study, order) if one.form is None):
        path = folder / f"trial-{i}.csv"
        save_run(path, run_on(study, step.condition, seed=i))
        words += ["--run", path]
    return words


def refused(ran, *words):
    return ran.code == 1 and ran.err.count("\n") == 1 and all(word in ran.err for word in words)


def test_a_new_study_and_its_first_steps(tcs_command, tmp_path):
    folder = tmp_path / "mine"
    words = ("--conditions", "novel,stick=Joystick,assisted", "--trials", 2, "--training", 0)
    ran = tcs_command("study", "new", folder, *words, "--questionnaires", "none")
    assert ran.code == 0
    assert f"tcs study record {folder}" in ran.out
    study = load_study(folder)
    assert study.conditions == ("novel", "stick", "assisted")
    assert [one.limits for one in study.plan.conditions] == ["paper", None, "clamped"]
    # The line is that of `tcs teleop --line`, joint 4 meets its limit.
    assert study.plan.line.blocking_joint == 4
    assert refused(tcs_command("study", "new", folder), "exists")


def test_a_participant_from_run_files_and_answers(tcs_command, study, tmp_path):
    answers = answers_file(study, tmp_path / "answers.yaml")
    runs = run_files(study, tmp_path)
    ran = tcs_command("study", "record", study.folder, *runs, "--answers", answers)
    assert ran.code == 0
    lines = ran.out.splitlines()
    assert lines[0] == "P01: end-effector control, novel control"
    assert "training trial 1 of 1 with end-effector control (condition 1 of 2): 1.9 s;" in lines[2]
    assert lines[-1] == "P01: all 14 steps are recorded"
    assert len(list((study.folder / "runs").iterdir())) == 4
    # The next one takes the other order.
    ran = tcs_command("study", "record", study.folder, "--skip", "no form")
    assert "P02" in ran.out
    assert load_participant(study, "P02").order == ["novel", "end-effector"]


def test_a_session_stops_where_nothing_is_given_and_resumes_there(tcs_command, study, tmp_path):
    answers = answers_file(study, tmp_path / "answers.yaml", omit=["novel/difficulty"])
    runs = run_files(study, tmp_path)
    ran = tcs_command("study", "record", study.folder, *runs[:2], "--answers", answers)
    assert ran.out.splitlines()[-1].startswith("P01: 2 of 14 steps; next: trial 1 of 1 with end-e")
    ran = tcs_command("study", "record", study.folder, *runs[2:], "--answers", answers)
    assert ran.out.splitlines()[-1].startswith("P01: 12 of 14 steps; next: questionnaire 'diffic")
    ran = tcs_command("study", "record", study.folder, "--skip", "refused")
    assert "missing, refused" in ran.out
    assert "13 of 14 steps; next: questionnaire 'preference'" in ran.out
    ran = tcs_command("study", "record", study.folder, "--answers", answers)
    assert "all 14 steps are recorded" in ran.out


def test_runs_that_are_not_due_are_refused(tcs_command, study, tmp_path):
    answers = answers_file(study, tmp_path / "answers.yaml")
    runs = run_files(study, tmp_path)
    ran = tcs_command(
        "study", "record", study.folder, "--answers", answers, "--run", runs[-1], "--no-browser"
    )
    assert refused(ran, "its condition is 'novel'", "'end-effector'")
    ran = tcs_command("study", "record", study.folder, "--answers", answers, *runs, *runs[:2])
    assert refused(ran, "no trial is due", "all steps are recorded")


def test_odd_values_are_refused_in_a_line(tcs_command, study, tmp_path):
    for words in (
        ("--run", tmp_path / "none.csv"), ("--answers", tmp_path), ("--skip", "a" * 5000),
        ("--drop", "a" * 5000), ("--participant", "a\0b"), ("--participant", "a" * 5000, "--new"),
    ):  # fmt: skip
        ran = tcs_command("study", "record", study.folder, "--no-browser", *words)
        assert ran.code == 1, words
        assert len(ran.err.strip().splitlines()) == 1, (words, ran.err)
    for folder in ("a" * 5000, "/dev/null"):
        for command in ("record", "report"):
            assert refused(tcs_command("study", command, folder), "study.yaml")
    # A command that is refused adds nobody, and no folder.
    assert participant_names(study) == []
    assert [path.name for path in study.folder.iterdir()] == ["study.yaml"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("background: {age: 7}", ("'background'", "'age'", "16 to 120")),
        ("novel/van-der-laan: {}", ("'novel/van-der-laan'", "is not answered")),
        ("novel/trial-1: {}", ("'novel/trial-1' is not a questionnaire of 'P01'",)),
        ("preference: {preferred: both}", ("'preferred'", "must be end-effector, novel")),
        ("preference: 3", ("must map questions to answers",)),
        ("[", ("not valid YAML",)),
        ("", ("must contain keys and values",)),
    ],
)
def test_invalid_answers_are_refused_in_a_line(tcs_command, study, tmp_path, content, words):
    path = tmp_path / "answers.yaml"
    path.write_text(content)
    assert refused(tcs_command("study", "record", study.folder, "--answers", path), *words)
    assert participant_names(study) == []


def test_participants_are_chosen_by_name_where_several_are_unfinished(tcs_command, study):
    for _ in range(2):
        assert tcs_command("study", "record", study.folder, "--new", "--skip", "later").code == 0
    ran = tcs_command("study", "record", study.folder, "--skip", "later")
    assert refused(ran, "unfinished participants: P01, P02", "--participant", "--new")
    ran = tcs_command("study", "record", study.folder, "--participant", "P3", "--skip", "later")
    assert refused(ran, "unknown participant 'P3'", "P01, P02")
    ran = tcs_command("study", "record", study.folder, "--participant", "P01", "--drop", "ill")
    assert "dropped" in ran.out
    ran = tcs_command("study", "record", study.folder, "--participant", "P01", "--skip", "later")
    assert refused(ran, "P01", "was dropped: ill")
    words = ("--new", "--participant", "p02", "--skip", "later")
    assert refused(tcs_command("study", "record", study.folder, *words), "has a participant 'p02'")
    words = ("--new", "--participant", "../x", "--skip", "later")
    assert refused(tcs_command("study", "record", study.folder, *words), "participant")


def test_the_address_is_printed_and_the_wait_ends(tcs_command, study):
    ran = tcs_command("study", "record", study.folder, "--no-browser", "--duration", 0.1)
    assert ran.code == 0
    assert "open http://127.0.0.1:" in ran.err
    assert "not filled in" in ran.err
    assert "0 of 14 steps; next: questionnaire 'background'" in ran.out


def test_a_folder_without_a_study_is_refused(tcs_command, tmp_path):
    assert refused(tcs_command("study", "record", tmp_path), "study.yaml", "tcs study new")


def test_skip_and_drop_exclude_each_other(tcs_command, study):
    ran = tcs_command("study", "record", study.folder, "--skip", "a", "--drop", "b")
    assert ran.code == 2


def test_a_report(tcs_command, study, capsys):
    assert refused(tcs_command("study", "report", study.folder), "no participants")
    complete(study, 1)
    ran = tcs_command("study", "report", study.folder, "--json")
    assert ran.json["participants"][0]["included"] is True
    assert (study.folder / "report.html").stat().st_size > 10_000
    assert (study.folder / "report-tables" / "trials.csv").exists()
    report_study(ran.json)
    out = capsys.readouterr().out
    assert "Small study: 1 of 1 participants" in out
    assert "15 tables as CSV" in out


@pytest.mark.slow
def test_an_interrupted_form_is_due_again(study):
    """Ctrl-C while a page is open."""
    recording = StudyRecording(study, new_participant(study))
    checkout = Path(__file__).resolve().parents[2]
    process = subprocess.Popen(
        [sys.executable, "-m", "tcs", "study", "record", str(study.folder), "--no-browser"],
        stderr=subprocess.PIPE, text=True, cwd=checkout,
    )  # fmt: skip
    assert "http://127.0.0.1" in process.stderr.readline()
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert load_participant(study, "P01") == recording.participant
    json.loads((study.folder / "participants" / "P01.json").read_text())

"""The report of a study: its tables, files and text, with little and with much data."""

from __future__ import annotations

import csv
import re

import pytest

from tcs.errors import OutputError
from tcs.output.report.blocks import Page, Section
from tcs.output.report.html import as_html
from tcs_studies.output.report.study.files import table_csv, write_study_report
from tcs_studies.output.report.study.page import study_page
from tcs_studies.output.report.study.tables import comments_table, preference_table
from tcs_studies.study.participants import new_participant
from tcs_studies.study.recording import StudyRecording
from tcs_studies.study.results import study_results
from tests.studies.study.example import complete, run_on, small_study


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    study = small_study(tmp_path_factory.mktemp("study"))
    for place in range(3):
        complete(study, place)
    complete(study, 3).drop("ill")
    return study


@pytest.fixture(scope="module")
def written(study, tmp_path_factory):
    """Summary of the report, and its folder."""
    folder = tmp_path_factory.mktemp("report")
    return write_study_report(study, folder / "mine.html"), folder


@pytest.fixture(scope="module")
def results(study):
    return study_results(study)


def read(path):
    with path.open(newline="") as stream:
        return list(csv.reader(stream))


def test_every_table_is_a_file(results, written):
    result, folder = written
    names = [path.stem for path in (folder / "mine-tables").iterdir()]
    assert len(names) == len(result["files"]) - 1
    sections = ("participants", "preference", "workload", "difficulty-1", "comments")
    assert {*(f"table-{name}" for name in sections), "trials", "answers", "values"} < {*names}
    for title, count in (("accuracy-time-effort-acceptance", 2), ("motion-of-the-hand", 2)):
        assert {f"table-{title}-{i + 1}" for i in range(count)} < {*names}
    table = preference_table(results)
    assert read(folder / "mine-tables" / "table-preference.csv")[1:] == table.texts()


def test_files_have_every_trial_answer_and_value(written):
    _, folder = written
    tables = folder / "mine-tables"
    trials = read(tables / "trials.csv")
    assert trials[0][:6] == ["participant", "condition", "order", "training", "trial", "accuracy"]
    assert len(trials) == 1 + 3 * 4
    answers = read(tables / "answers.csv")
    # Those of the dropped participant as well, marked.
    assert {(row[0], row[1]) for row in answers[1:]} == {
        ("P01", "True"), ("P02", "True"), ("P03", "True"), ("P04", "False"),
    }  # fmt: skip
    values = read(tables / "values.csv")
    assert len(values) == 1 + 3 * 2
    assert "" not in values[1]


def test_the_summary_has_the_tests_of_the_paper(written):
    result, _ = written
    assert result["scripted"] is False
    assert list(result["tests"]) == ["accuracy", "time", "effort", "usefulness", "satisfaction"]
    test = result["tests"]["accuracy"]["end-effector - novel"]
    assert (test["count"], test["tail"]) == (3, "greater")
    assert result["groups"]["usefulness"]["novel"]["count"] == 3
    # Three values have no p value of the Shapiro-Francia test.
    assert result["groups"]["time"]["novel"]["francia_p"] is None
    assert sum(result["preferred"].values()) == 3
    assert [one["included"] for one in result["participants"]] == [True, True, True, False]


def test_the_page_has_tables_and_figures_of_the_paper(written):
    _, folder = written
    text = (folder / "mine.html").read_text()
    for part in ("Table II", "Table III", "Table IV", "Figure 8f", "Figure 10", "Figure 56"):
        assert part in text
    # Five box plots, the acceptance graph and the paths.
    assert text.count("<svg role=") == 7
    assert "P04 was dropped and is left out: ill." in text


def test_one_participant_and_conditions_that_the_paper_has_not(tmp_path):
    study = small_study(tmp_path, names=("a", "b", "c"), questionnaires=("difficulty",))
    complete(study, 1)
    text = as_html(study_page(study_results(study), command="tcs study report mine"))
    assert "Tests need 3 participants" in text
    assert "Pairs of conditions" in text
    assert "Acceptance after" not in text
    assert "nan" not in re.sub(r"<svg.*?</svg>", "", text, flags=re.S)


def test_comments_are_text_on_the_page_and_in_a_spreadsheet(tmp_path):
    study = small_study(tmp_path, questionnaires=())
    recording = StudyRecording(study, new_participant(study))
    recording.skip("none")
    for _ in range(4):
        recording.record_run(run_on(study, recording.next_step.condition))
    text = '=HYPERLINK("x") <b>bold</b>\nsecond line'
    recording.save_answers(recording.next_step, {"preferred": "novel", "comments": text})
    table = comments_table(study_results(study))
    assert table.texts() == [["P01", "–", "preference", '=HYPERLINK("x") <b>bold</b> second line']]
    page = Page("Title", "Lead", [Section("Comments", [table])])
    assert "&lt;b&gt;bold&lt;/b&gt; second line" in as_html(page)
    assert table_csv(table).splitlines()[1].split(b",")[3].startswith(b"\"'=HYPERLINK")


def test_a_page_that_cannot_be_written_is_refused_first(study, tmp_path):
    with pytest.raises(OutputError, match=r"must end in \.html"):
        write_study_report(study, tmp_path / "report.pdf")
    assert list(tmp_path.iterdir()) == []

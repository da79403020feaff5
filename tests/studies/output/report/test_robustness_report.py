"""The robustness report: tables, text and files."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from tcs.errors import OutputError
from tcs.output.report import as_html, as_markdown
from tcs.output.words import REASON_TEXTS
from tcs_studies.output.report.robustness.page import draw_rows, robustness_page
from tcs_studies.output.report.robustness.tables import is_short, losses_table, table_1, table_3
from tcs_studies.output.report.robustness.write import write_report
from tcs_studies.output.words import goes_with, lost_goal
from tests.output.report.test_page import Reader, column


@pytest.fixture(scope="module")
def page(study, lossless, pictures, paper, plan):
    return robustness_page(
        [study, lossless], [pictures] * 2, paper, plan, seconds=12.0, command="python it.py"
    )


def test_table_1_has_the_figure_of_the_paper_and_the_difference(study, lossless, paper):
    table = table_1([study, lossless], paper)
    ours = column(table, "tcs")
    assert ours[1] == "100.0 (0.0)"
    mean = float(ours[0].split(" ")[0])
    assert mean == pytest.approx(100.0 * np.mean(study.best.fractions), abs=0.05)
    assert column(table, "Paper") == ["99.9 (1.6)", "100.0 (0.0)"]
    differences = column(table, "Difference")
    assert float(differences[0]) == pytest.approx(mean - 99.9, abs=0.11)
    assert differences[1] == "0.0"


def test_a_row_is_short_when_its_printed_mean_is_below_the_papers(study, lossless, paper):
    assert is_short(study, paper)
    assert not is_short(lossless, paper)


def test_table_3_has_na_where_the_paper_does(study, paper):
    feeding = dataclasses.replace(study, task="feeding")
    table = table_3([study, feeding], paper)
    assert column(table, "Members") == ["1", "2", "1", "2"]
    assert column(table, "Without, paper")[1] == "94.0 (11.6)"
    assert column(table, "Without, paper")[3] == "N/A"
    fractions = study.methods.paired[2, True].fractions
    with_two = float(column(table, "With")[1].split(" ")[0])
    assert with_two == pytest.approx(100.0 * fractions.mean(), abs=0.05)


def test_a_short_row_is_explained_from_its_losses(page, study):
    text = as_markdown(page)
    worst = study.losses.goals[0]
    assert "Below the paper: shaving, small-wheelchair. Goal " in text
    assert f"Goal {worst.goal + 1} (head) is reached in {100.0 * worst.success:.1f} %" in text
    table = losses_table(study)
    assert column(table, "Goal") == [str(loss.goal + 1) for loss in study.losses.goals]
    assert [float(cell) / 100.0 for cell in column(table, "Reached")] == pytest.approx(
        [loss.success for loss in study.losses.goals], abs=0.0005001
    )
    assert "Every goal is reached in every sample: brushing, small-wheelchair." in text


def test_a_loss_is_reported_with_its_reasons(study):
    loss = study.losses.goals[0]
    reason, share = next(iter(loss.reasons.items()))
    assert f"{REASON_TEXTS[reason]} ({100.0 * share:.0f} %)" in lost_goal(loss)
    assert goes_with(loss).startswith(loss.joint.replace("_", " "))


def test_the_page_is_self_contained(page):
    html = as_html(page)
    reader = Reader()
    reader.feed(html)
    assert reader.open == []
    pictures = ("#", "data:image/")
    assert all(link.startswith(pictures) for link in reader.links)
    # Names of XML namespaces are not loaded.
    addresses = set(re.findall(r"https?://[^\"'<> )]*", html))
    assert addresses == {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}


def test_ids_of_drawings_are_unique(page):
    html = as_html(page)
    names = re.findall(r'<(?:clipPath|path|g|defs)[^>]* id="([^"]*)"', html)
    clips = [name for name in names if name.startswith("p") and len(name) > 8]
    assert len(clips) == len(set(clips)) > 3


def test_files_are_written_whole(study, pictures, plan, tmp_path):
    folder = tmp_path / "a" / "b"
    paths = write_report(folder, [study], [pictures], plan, seconds=1.0, command="it")
    assert sorted(folder.iterdir()) == sorted(paths)
    assert paths[0].read_text().startswith("<!doctype html>")
    assert paths[2].read_text().count("\n") == 10 * plan.samples + 1


def test_a_path_that_takes_no_folder_is_reported(study, pictures, plan, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be created"):
        write_report(tmp_path / "file" / "x", [study], [pictures], plan, seconds=1.0, command="it")


@pytest.mark.slow
def test_pictures_do_not_depend_on_the_number_of_processes(pictures, score_path):
    assert draw_rows([score_path], jobs=2) == (pictures,)
    assert pictures.map.startswith(b"\x89PNG")
    assert pictures.scene.startswith(b"\x89PNG")

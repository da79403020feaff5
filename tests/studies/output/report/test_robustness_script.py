"""The script that writes the robustness report."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

from tcs.placement.store import save_scores
from tests.placement.store.example import score_file

SCRIPT = Path(__file__).resolve().parents[4] / "scripts" / "robustness_report.py"


@pytest.fixture
def run(monkeypatch, tmp_path, capsys):
    """Run the script in a folder; return its exit code and what it prints to stderr."""

    def run_script(*words):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", [str(SCRIPT), *map(str, words)])
        with pytest.raises(SystemExit) as left:
            runpy.run_path(str(SCRIPT), run_name="__main__")
        return left.value.code or 0, capsys.readouterr().err

    return run_script


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--rows", "shavin/bed"), "unknown row 'shavin/bed'"),
        (("--samples", 0, "--rows", "shaving/bed"), "samples is 0"),
        (("--jobs", 0), "--jobs is 0"),
    ],
)
def test_invalid_options_are_refused_in_one_line_before_the_work(run, tmp_path, words, message):
    code, printed = run(*words)
    assert code == 1
    assert message in printed
    assert printed.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_another_row_is_refused(run, tmp_path):
    scores = tmp_path / "out" / "scores"
    scores.mkdir(parents=True)
    # The file was scored in the wheelchair.
    file = score_file()
    file.metadata["paper"] = True
    save_scores(scores / "shaving-bed-pr2.tcs", file)
    code, printed = run("--rows", "shaving/bed")
    assert code == 1
    assert "has environment 'wheelchair', not 'bed'" in printed
    assert printed.count("\n") == 1
    assert list((tmp_path / "out" / "robustness").iterdir()) == []


@pytest.mark.slow
def test_a_row_from_scratch(run, tmp_path):
    words = ("--rows", "scratching_chest/bed", "--samples", 20, "--out", "o", "--scores", "s")
    code, printed = run(*words)
    assert code == 0, printed
    # No bar in a pipe.
    assert "\x1b" not in printed
    written = ["robustness.html", "robustness.md", "samples.csv"]
    assert sorted(path.name for path in (tmp_path / "o").iterdir()) == written
    assert "scratching chest, bed" in (tmp_path / "o" / "robustness.md").read_text()
    assert len(list((tmp_path / "s").iterdir())) == 1

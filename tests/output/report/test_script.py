"""The script that writes the robustness report."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tcs.placement.store import save_scores
from tests.placement.store.example import score_file

SCRIPT = Path(__file__).resolve().parents[3] / "scripts" / "robustness_report.py"


def run(*words, cwd):
    command = [sys.executable, str(SCRIPT), *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--rows", "shavin/bed"), "unknown row 'shavin/bed'"),
        (("--samples", 0, "--rows", "shaving/bed"), "samples is 0"),
        (("--jobs", 0), "--jobs is 0"),
    ],
)
def test_invalid_options_are_refused_in_one_line_before_the_work(tmp_path, words, message):
    done = run(*words, cwd=tmp_path)
    assert done.returncode == 1
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_another_row_is_refused(tmp_path):
    scores = tmp_path / "out" / "scores"
    scores.mkdir(parents=True)
    # The file was scored in the wheelchair.
    save_scores(scores / "shaving-bed-pr2.tcs", score_file())
    done = run("--rows", "shaving/bed", cwd=tmp_path)
    assert done.returncode == 1
    assert "has environment 'wheelchair', not 'bed'" in done.stderr
    assert done.stderr.count("\n") == 1
    assert list((tmp_path / "out" / "robustness").iterdir()) == []


@pytest.mark.slow
def test_a_row_from_scratch(tmp_path):
    words = ("--rows", "scratching_chest/bed", "--samples", 20, "--out", "o", "--scores", "s")
    done = run(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    # No bar in a pipe.
    assert "\x1b" not in done.stderr
    written = ["robustness.html", "robustness.md", "samples.csv"]
    assert sorted(path.name for path in (tmp_path / "o").iterdir()) == written
    assert "scratching chest, bed" in (tmp_path / "o" / "robustness.md").read_text()
    assert len(list((tmp_path / "s").iterdir())) == 1

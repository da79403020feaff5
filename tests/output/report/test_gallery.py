"""The gallery in the docs, and the script that makes it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tcs.placement.store import save_scores
from tcs_studies.output.report.robustness.paper import load_paper
from tests.placement.store.example import score_file

CHECKOUT = Path(__file__).resolve().parents[3]
SCRIPT = CHECKOUT / "scripts" / "gallery.py"
DOCS = CHECKOUT / "docs"
TEXT = (DOCS / "gallery.md").read_text(encoding="utf-8")


def run(*words, cwd):
    command = [sys.executable, str(SCRIPT), *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd)


def test_every_row_of_the_paper_is_shown_once():
    shown = re.findall(r"images/gallery-(\w+)-(wheelchair|bed-no-wall|bed)\.png", TEXT)
    assert sorted(shown) == sorted(load_paper().rows())
    assert TEXT.index("## Figure 1") < TEXT.index("## Figure 6 (a)")


def test_pictures_are_there_and_small():
    named = set(re.findall(r"\((images/[\w.-]+\.png)\)", TEXT))
    assert len(named) == 16
    assert [name for name in named if not (DOCS / name).is_file()] == []
    left = {f"images/{path.name}" for path in (DOCS / "images").glob("gallery-*.png")} - named
    assert left == set()
    # All pictures of the docs together; a clone should not take long.
    assert sum(path.stat().st_size for path in (DOCS / "images").iterdir()) < 2e6


def test_a_file_of_another_row_is_refused(tmp_path):
    scores = tmp_path / "scores"
    scores.mkdir()
    # The file of the first row contains scores of another robot.
    file = score_file()
    file.metadata.update(robot="tiago", paper=True)
    save_scores(scores / "shaving-wheelchair-pr2.tcs", file)
    for task, environment in load_paper().rows():
        if (task, environment) != ("shaving", "wheelchair"):
            path = scores / f"{task}-{environment}-pr2.tcs"
            path.write_bytes((scores / "shaving-wheelchair-pr2.tcs").read_bytes())
    done = run("--scores", scores, "--out", tmp_path / "docs", cwd=tmp_path)
    assert done.returncode == 1
    assert "not '" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "docs" / "gallery.md").exists()


@pytest.mark.slow
def test_the_gallery_is_what_the_script_makes(tmp_path):
    done = run("--scores", tmp_path / "scores", "--out", tmp_path / "docs", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    made = tmp_path / "docs"
    assert (made / "gallery.md").read_text(encoding="utf-8") == TEXT
    names = {path.name for path in (made / "images").iterdir()}
    # The others are made by the benchmarks of capability maps and by `tcs teleop experiment`.
    others = {"capability.png", "teleop-experiment.png"}
    assert names == {path.name for path in (DOCS / "images").iterdir()} - others

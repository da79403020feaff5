"""The Python of the docs runs as it stands there, one block after the other."""

import math
import re
import shutil
from pathlib import Path

import pytest

import tcs
from tests.chosen import some_of

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGES = [
    path for path in sorted(DOCS.glob("*.md")) if "```python" in path.read_text(encoding="utf-8")
]
LONG = "refinement", "selection"
"""Pages whose blocks refine and evaluate sets: with the slow tests."""


@pytest.fixture(scope="module")
def scored(tmp_path_factory):
    """A score file: any will do, so one that is made in a second."""
    path = tmp_path_factory.mktemp("scored") / "feeding.tcs"
    tcs.save(path, tcs.score("feeding", paper=True))
    return path


@pytest.mark.parametrize(
    "page",
    some_of(PAGES, *(p for p in PAGES if p.stem not in LONG)),
    ids=lambda page: page.stem,
)
def test_blocks_run(page, scored, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.S)
    # Files that a block reads.
    for name in re.findall(r'tcs\.load\("(.+?)"\)', "".join(blocks)):
        shutil.copyfile(scored, name)
    # Names introduced by the sentence before a block.
    pose = {"base_x": 1.4, "base_y": -1.2, "base_yaw": math.pi, "torso": 0.0}
    names = {"tcs": tcs, "here": tcs.InitialConfiguration(**pose)}
    for block in blocks:
        exec(compile(block, str(page), "exec"), names)


def test_there_are_blocks():
    assert len(PAGES) >= 3

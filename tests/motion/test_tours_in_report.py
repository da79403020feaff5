"""The tours of a set in a report: times, clearances, and why goals are not done."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import tcs
from tcs.cli.app import app
from tcs.output.report.blocks import Bullets, Table, Text
from tcs.output.report.score import report as score_report
from tcs.output.report.score import tours
from tcs.output.report.score.tours import Tours, tours_blocks
from tcs.placement.scoring.rebuild import rebuild_scenes


@pytest.fixture(scope="module", autouse=True)
def _fewer_postures():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tours, "_RATE", 3.0)
        patch.setattr("tcs.output.draw.camera.SIZE", (300, 260))
        patch.setattr("tcs.output.report.score.report._DPI", 30)
        yield


@pytest.fixture(scope="module")
def measured(planned, two_goals, _fewer_postures):
    _, scene, _ = rebuild_scenes(tcs.load(two_goals))[0]
    return Tours.of(planned, {"": scene})


def test_clearances_are_least_at_the_goal_and_never_below_what_is_required(measured, planned):
    (stop,), (found,) = planned.stops, measured.clearances
    assert len(found) == len(stop.segments) == 4
    approach, retreat = found[1], found[2]
    # Both are nearest at the goal, some centimetres off the skin.
    assert approach[2] == pytest.approx(retreat[2], abs=1e-6)
    assert 0.0 < approach[2] < 0.1
    assert approach[1].startswith("person")
    assert measured.to_json()["stops"][0]["clearance"] <= approach[2]


def test_the_section_lists_every_segment_and_every_failure(measured, planned):
    said, table, failures = tours_blocks(measured, ["head", "head"])
    assert isinstance(said, Text)
    assert "1 of 2 goals can be done" in said.text
    assert f"re-checked {planned.edges:,} pieces" in said.text
    assert "none are false" in said.text
    assert isinstance(table, Table)
    texts = table.texts()
    assert [row[0] for row in texts] == ["move", "approach", "retreat", "move"]
    assert texts[0][1:3] == ["rest", "goal 1, head"]
    np.testing.assert_allclose(
        sum(float(row[3]) for row in texts), planned.stops[0].duration, atol=0.3
    )
    assert isinstance(failures, Bullets)
    assert failures.items[0].startswith("goal 2: joint or velocity limits prevent its approach")


@pytest.mark.slow
def test_the_command_plans_the_set_that_it_shows(planned, two_goals, monkeypatch, tmp_path):
    asked = []
    monkeypatch.setattr(score_report, "plan", lambda _, members: asked.append(members) or planned)
    page = tmp_path / "report.md"
    words = [str(two_goals), "--out", str(page), "--pairs", "0", "--dense", "0", "--json"]
    ran = CliRunner().invoke(app, ["report", *words, "--motions"])
    assert ran.exit_code == 0, ran.output
    found = json.loads(ran.stdout)["tours"]
    assert asked == [[0]]
    assert (found["goals_done"], found["false"]) == (1, 0)
    assert "## Motions" in page.read_text()

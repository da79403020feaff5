from __future__ import annotations

import dataclasses

import pytest

import tcs
from tcs.errors import OutputError
from tcs.model.grid import InitialConfiguration
from tcs.output.report.score.shown_set import ScoredScene
from tcs.output.view import (
    ScoreView,
    Viewer,
    make_score_view,
    score_view,
    show_score_view,
    write_score_view,
)
from tcs.placement.scoring import load_job
from tcs.placement.scoring.sets import build_sets
from tcs.placement.store import StateTables
from tests.placement.store.example import score_file
from tests.placement.tables.small import random_scores, small_grid

HERE = InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=0.0, torso=0.0)


@pytest.fixture
def view(objects, shaving_set) -> ScoreView:
    """A view of random scores for shaving in the wheelchair."""
    return ScoreView(
        viewed=shaving_set,
        objects=objects,
        title="Shaving",
        subtitle="best set: 100.0% of the goals",
        source="fitted by hand, BSD",
        meshes=False,
    )


@pytest.fixture
def file(shaving):
    """A score file with random scores for the goals of shaving, which no scene is built from."""
    grid = small_grid(nx=6, ny=4)
    scores = random_scores(grid, len(shaving.goals), seed=1)
    return dataclasses.replace(
        score_file(grid=grid), tables=(StateTables.of(scores, build_sets(scores, grid)),)
    )


@pytest.fixture
def built(monkeypatch, scene):
    """Give every view the scene of the session; return whether meshes were requested, by call."""
    requested = []

    def scored_scenes(_file, _shown, *, meshes):
        requested.append(meshes)
        return (ScoredScene(load_job("shaving", "wheelchair", "pr2", paper=True), scene),)

    monkeypatch.setattr(score_view, "scored_scenes", scored_scenes)
    return requested


def test_the_view_shows_the_recommended_set_without_a_current_state(file, built):
    made = make_score_view(file)
    choice = tcs.select(file)
    assert made.viewed.members == tuple(choice.indices[i] for i in choice.order)
    assert made.subtitle.startswith("recommended, most goals, then fewest stops: ")
    assert "PR2" in made.title
    assert built == [False]


def test_the_view_shows_the_set_selected_from_the_current_state(file, built):
    made = make_score_view(file, here=HERE, max_members=1, meshes=True)
    assert len(made.viewed.members) == 1
    assert made.subtitle.startswith("selected for a robot at x 0.00 m")
    assert made.meshes
    assert built == [True]


def test_a_page_is_written_with_its_summary(view, tmp_path):
    path = tmp_path / "page.html"
    result = write_score_view(view, path)
    text = path.read_text(encoding="utf-8")
    assert "Shaving" in text
    assert view.subtitle in text
    assert view.source not in text
    grid = view.viewed.grid
    assert result == {
        "file": str(path),
        "bytes": path.stat().st_size,
        "meshes": False,
        "members": [grid.configuration(index).to_json() for index in view.viewed.members],
        "source": None,
    }


def test_a_page_with_meshes_states_their_source(view, tmp_path):
    path = tmp_path / "page.html"
    result = write_score_view(dataclasses.replace(view, meshes=True), path)
    assert result["source"] == view.source
    assert f"from the robot file: {view.source}" in path.read_text(encoding="utf-8")


def test_a_page_that_cannot_be_written_is_an_error(view, tmp_path):
    with pytest.raises(OutputError):
        write_score_view(view, tmp_path / "absent" / "page.html")


def shown(view, monkeypatch, *, browser=False, duration=0.0):
    """Show a view; return its lines, its notes and the addresses opened in a browser."""
    lines, notes, opened = [], [], []
    monkeypatch.setattr("webbrowser.open", opened.append)
    show_score_view(
        view, browser=browser, duration=duration, on_line=lines.append, on_note=notes.append
    )
    return lines, notes, opened


def test_a_live_view_prints_the_set_the_colours_and_the_state(view, monkeypatch):
    lines, notes, opened = shown(view, monkeypatch)
    assert lines[0] == f"{view.title}; {view.subtitle}"
    assert lines[1].startswith("arrows: green: reached, ")
    assert lines[2].startswith("member 1 of 2: goal ")
    assert len(notes) == 1
    assert notes[0].startswith("open http://localhost:")
    assert opened == []


def test_a_browser_is_opened_at_the_address(view, monkeypatch):
    _, notes, opened = shown(view, monkeypatch, browser=True)
    assert len(opened) == 1
    assert opened[0] in notes[0]


def test_ctrl_c_closes_the_view(view, monkeypatch):
    def interrupted(_viewer, _duration):
        raise KeyboardInterrupt

    monkeypatch.setattr(Viewer, "run", interrupted)
    _, notes, _ = shown(view, monkeypatch, duration=None)
    assert notes[1].startswith("closed after 0 s")

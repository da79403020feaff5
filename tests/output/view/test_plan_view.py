"""Plans in the viewer: when the arm is where, what the page says, and the swept volume."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from tcs.cli.app import app
from tcs.model.grid import InitialConfiguration
from tcs.motion import GoalResult, MotionPlan, Segment, StopPlan, Timed, save_plan
from tcs.motion.plan_check import PlanHand
from tcs.output.view import PlanView, make_plan_view, plan_view, swept, write_plan_view
from tcs.output.view.plan_view import plan_frames, show_plan_view
from tcs.output.view.scene_objects import SceneShapes
from tcs.output.view.swept import SPACING, swept_mesh
from tcs.placement.scoring import load_job

REST = np.array([0.3, 0.2, 0.5, -1.2, 0.4, -0.8, 0.2])
AT_GOAL = REST + np.array([0.4, 0.0, 0.0, 0.5, 0.0, 0.0, 0.3])
HERE = InitialConfiguration(base_x=0.6, base_y=-0.9, base_yaw=np.pi / 2, torso=0.3)


def segment(name, start, end, first, last, seconds):
    times, q = np.linspace(0.0, seconds, 9), np.linspace(first, last, 9)
    v = np.tile((last - first) / seconds, (9, 1))
    v[[0, -1]] = 0.0
    return Segment(name, start, end, Timed(times, q, v))


@pytest.fixture(scope="module")
def moved():
    """A plan of two seconds to goal 1 and one of nothing; goal 0 has no motion."""
    segments = (
        segment("move", None, 1, REST, AT_GOAL, 1.0),
        segment("approach", 1, 1, AT_GOAL, AT_GOAL + 0.01, 0.4),
        segment("move", 1, None, AT_GOAL + 0.01, REST, 0.6),
    )
    failed = GoalResult(
        0, 0, False, "no_path", ("l_forearm_link", "person::head"), "rest to goal 1"
    )
    return MotionPlan(
        made_from={"task": "shaving", "environment": "wheelchair", "robot": "pr2"},
        joints=tuple("abcdefg"),
        stops=(StopPlan(HERE, 5, segments, True), StopPlan(HERE, 6, (), True)),
        results=(failed, *(GoalResult(goal, 0, True, "") for goal in range(1, 8))),
        edges=24,
        false=0,
        seed=0,
        seconds=1.0,
    )


@pytest.fixture
def view(moved, scene, shaving):
    shapes = SceneShapes(scene, shaving, meshes=False)
    return PlanView(moved, shapes, "Shaving", "BSD", False, True, {"": scene})


def test_frames_follow_the_timing(moved):
    frames = plan_frames(moved, 10.0)
    # Two seconds of motion, its end, and a second at each stop.
    assert [sum(one.stop == stop for one in frames) for stop in (0, 1)] == [31, 10]
    np.testing.assert_allclose(frames[0].joints, REST)
    np.testing.assert_allclose(frames[10].joints, AT_GOAL, atol=1e-12)
    np.testing.assert_allclose(frames[30].joints, REST, atol=1e-12)
    assert {one.goal for one in frames[:31]} == {1}
    assert frames[-1].joints is None


def test_the_page_says_what_is_done_when_and_why_not(view, tmp_path):
    found = write_plan_view(view, tmp_path / "plan.html")
    text = (tmp_path / "plan.html").read_text()
    assert found["bytes"] == (tmp_path / "plan.html").stat().st_size < 5e6
    assert found["members"] == [HERE.to_json()] * 2
    assert "0.0 to 3.0 s: stop 1 at x 0.60 m, y -0.90 m, heading 90 deg, goal 2 done" in text
    assert "3.0 to 4.0 s: stop 2" in text
    assert "goal 1: no path was found (rest to goal 1" in text
    assert "most often l forearm against head" in text


def test_a_live_view_prints_the_same_lines(view, monkeypatch):
    lines, notes = [], []
    show_plan_view(view, browser=False, duration=0.0, on_line=lines.append, on_note=notes.append)
    assert lines == [view.title, *view.lines]
    assert notes[0].startswith("open http://localhost:")


def test_the_swept_volume_has_each_body_at_places_along_its_way(scene):
    path = np.linspace(REST, AT_GOAL, 200)
    corners, faces = swept_mesh(scene, path)
    plant, context = scene.built.plant, scene.plant_context
    first, counts = 0, {}
    for body, hull, _ in swept._hulls(scene):
        way = []
        for q in path:
            scene.set_arm(q)
            way.append(plant.EvalBodyPoseInWorld(context, plant.get_body(body)).multiply(hull))
        # The mesh has the places of one body after another.
        shown = []
        while len(here := posture_of(corners[:, first : first + hull.shape[1]], way)):
            shown.append(int(here[0]))
            first += hull.shape[1]
        for number, place in enumerate(way):
            before = max(one for one in shown if one <= number)
            away = np.linalg.norm(place - way[before], axis=0).max()
            assert away < SPACING
        for one, other in itertools.pairwise(shown):
            assert SPACING <= np.linalg.norm(way[other] - way[one], axis=0).max() < 1.5 * SPACING
        counts[plant.get_body(body).name()] = len(shown)
    assert first == corners.shape[1]
    assert faces.max() == corners.shape[1] - 1
    # The hand moves farther than the shoulder.
    assert counts["l_gripper_palm_link"] > max(5, 2 * counts["l_shoulder_pan_link"])


def posture_of(corners, way):
    """Return the numbers of the places of a way that corners are those of."""
    if corners.shape != way[0].shape:
        return []
    return np.flatnonzero([np.abs(place - corners).max() < 1e-12 for place in way])


def test_the_command_plays_a_plan(moved, scene, monkeypatch, tmp_path):
    job = load_job("shaving", "wheelchair", "pr2", paper=True)
    hand = PlanHand(job, scene, tuple(range(8)))
    monkeypatch.setattr(plan_view, "hands_of", lambda *_, meshes: {"": hand})
    assert make_plan_view(moved).title.endswith("wheelchair · Willow Garage PR2, left arm")
    save_plan(tmp_path / "plan.json", moved)
    page = tmp_path / "page.html"
    command = ["view", str(tmp_path / "plan.json"), "--export", str(page)]
    ran = CliRunner().invoke(app, [*command, "--json"])
    assert json.loads(ran.stdout)["file"] == str(page)
    assert page.exists()
    refused = CliRunner().invoke(app, [*command, "--max-members", "1"])
    assert (refused.exit_code, "own stops" in refused.stderr) == (2, True)
    refused = CliRunner().invoke(app, ["view", "scores.tcs", "--swept"])
    assert (refused.exit_code, "requires a plan.json" in refused.stderr) == (2, True)

"""Scoring in a changed environment: what is moved, added, set and forbidden."""

from __future__ import annotations

import numpy as np
import pytest

import tcs
from tcs.placement.tables import Reason
from tcs.service import Engine, RescoreRequest, SceneRequest
from tests.environments import BESIDE, write_environment

STEP = 0.2
# What is tested is what happens in the processes, or put in its place.
pytestmark = pytest.mark.usefixtures("in_process")

GRID = {**BESIDE, "base_x": (0.2, STEP, 6), "base_y": (0.6, STEP, 3)}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rescoring")
    environment = write_environment(folder, "beside", GRID)
    tcs.save(folder / "beside.tcs", tcs.score("shaving", environment=str(environment), paper=True))
    return folder / "beside.tcs"


@pytest.fixture(scope="module")
def engine():
    with Engine() as engine:
        yield engine


@pytest.fixture(scope="module")
def rescored(engine, path, tmp_path_factory):
    """Function that returns the score file of a changed environment."""
    file = engine.open_file(path).file

    def run(**changes):
        status = engine.wait(engine.submit(RescoreRequest(file=file, **changes)).job)
        assert status.problem is None
        there = tmp_path_factory.mktemp("changed") / "changed.tcs"
        there.write_bytes(engine.content_of(status.result["file"]))
        return tcs.load(there), status.result["file"]

    return run


def by_position(file):
    """Return what is reached, shape (x, y, heading, torso, goal)."""
    grid = file.configurations
    return file.nominal.scores.reached.reshape(*grid.shape, -1)


def test_a_person_who_moves_takes_the_scores_along(path, rescored):
    before = by_position(tcs.load(path))
    after = by_position(rescored(move={"wheelchair": {"x": STEP}})[0])
    assert before.any()
    np.testing.assert_array_equal(after[1:], before[:-1])
    assert (after[:1] != before[:1]).any()


def test_a_wall_and_a_region_stand_in_the_way(path, rescored):
    before = tcs.load(path)
    wall, _ = rescored(add=[{"piece": "wall", "x": 0.6, "y": 0.8, "turn_deg": 90}])
    lost = before.nominal.scores.reached & ~wall.nominal.scores.reached
    assert lost.any()
    assert not (wall.nominal.scores.reached & ~before.nominal.scores.reached).any()
    region = [(-5.0, -5.0), (5.0, -5.0), (5.0, 0.35), (-5.0, 0.35)]
    kept, _ = rescored(forbid=[region])
    grid = kept.configurations
    at = grid.values(np.arange(grid.size))
    # Half of the base is 0.34 m wide; turned by 45 degrees it is wider.
    square = np.isclose(np.cos(4.0 * at["base_yaw"]), 1.0)
    excluded = kept.nominal.scores.reason == Reason.EXCLUDED
    np.testing.assert_array_equal(excluded.all(axis=1)[square], at["base_y"][square] < 0.7)
    assert 0 < excluded.all(axis=1).sum() < grid.size


@pytest.mark.parametrize("around", [None, (0.61, 0.79)])
def test_a_first_answer_has_the_scores_of_some_base_positions(path, rescored, around):
    move = {"wheelchair": {"x": 0.07}}
    whole, _ = rescored(move=move)
    options = {} if around is None else {"around": around}
    some, _ = rescored(move=move, every=2, max_members=1, **options)
    first = (0, 0) if around is None else (0, 1)
    x, y = (some.configurations.axis(f"base_{name}").values for name in "xy")
    np.testing.assert_allclose(x, 0.2 + 2 * STEP * np.arange(3) + STEP * first[0])
    np.testing.assert_allclose(y, (0.6 + STEP * np.arange(3))[first[1] :: 2])
    of_whole = by_position(whole)[first[0] :: 2, first[1] :: 2]
    assert of_whole.any()
    np.testing.assert_array_equal(by_position(some), of_whole)


@pytest.fixture
def built(monkeypatch):
    """The scenes that are built."""
    from tcs.placement.scoring.job import Job

    built, scene = [], Job.scene
    monkeypatch.setattr(Job, "scene", lambda job: built.append(job) or scene(job))
    return built


def test_a_scene_is_built_once_for_each_change(path, rescored, built):
    rescored(move={"wheelchair": {"y": 0.03}}, every=2)
    first, _ = rescored(move={"wheelchair": {"y": 0.03}})
    assert len(built) == 1
    second, _ = rescored(move={"wheelchair": {"y": 0.04}})
    assert len(built) == 2
    assert first.metadata["scene_digest"] != second.metadata["scene_digest"]
    rescored(joints={"head_tilt_deg": 5.0}, move={"wheelchair": {"y": 0.04}})
    assert len(built) == 3


def test_the_changed_environment_can_be_scored_again_by_its_file(engine, rescored, tmp_path):
    file, digest = rescored(
        move={"person": {"x": 0.05}}, joints={"head_tilt_deg": 5.0}, only_state=True
    )
    scene = tmp_path / "changed.yaml"
    scene.write_text(engine.environment_of(digest), encoding="utf-8")
    again = tcs.score("shaving", environment=str(scene), paper=True)
    np.testing.assert_array_equal(again.nominal.scores.reached, file.nominal.scores.reached)
    assert "joints" in scene.read_text()


def test_its_scene_is_that_of_the_change(engine, path, rescored):
    original = engine.open_file(path).file
    _, digest = rescored(move={"wheelchair": {"x": 0.1, "y": 0.3}})
    goals = []
    for file in (original, digest):
        status = engine.wait(engine.submit(SceneRequest(file=file)).job)
        assert [one["name"] for one in status.result["things"]][:2] == ["wheelchair", "person"]
        assert "head_tilt_deg" in [one["name"] for one in status.result["joints"]]
        goals.append(np.array(status.result["states"][0]["goals"]))
    np.testing.assert_allclose(goals[1] - goals[0], [[0.1, 0.3, 0.0]] * 8, atol=1.1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"move": {"sofa": {"x": 1.0}}}, "unknown thing to move 'sofa'"),
        ({"add": [{"piece": "sofa", "x": 0.0, "y": 0.0}]}, "unknown piece of furniture 'sofa'"),
        ({"joints": {"head_tilt": 1.0, "head_tilt_deg": 5.0}}, "sets 'head_tilt' twice"),
        ({"joints": {"nose": 1.0}}, "unknown joint 'nose'"),
        ({"only_state": True, "at": {"bed_height": 0.0}}, "'at' must set nothing"),
        ({"around": (0.0, 0.0)}, "'around' requires 'every'"),
    ],
)
def test_changes_that_cannot_be_made(engine, path, changes, message):
    file = engine.open_file(path).file
    status = engine.wait(engine.submit(RescoreRequest(file=file, **changes)).job)
    assert status.state == "failed"
    assert message in status.problem
    assert "\n" not in status.problem
    assert "/tmp" not in status.problem.replace(str(path.parent), "")

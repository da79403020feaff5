from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.errors import DataFileError
from tcs.output.view import open_meshcat
from tcs.output.view.teleop import Replay, RunView, replay_page
from tcs.output.view.teleop.panel import LIMIT, SINGULAR
from tcs.output.view.teleop.replay import PLAY, RESTART, SPEED, TIME
from tcs.teleop import Command, Teleoperation, load_arm
from tcs.teleop.runs.recorder import run_from_steps
from tests.output.view.teleop.conftest import Instead


@pytest.fixture
def film(iiwa, driven):
    return RunView(iiwa, driven)


@pytest.fixture
def replay(meshcat, iiwa_display, film):
    return Replay(meshcat, iiwa_display, film)


def test_samples_are_those_of_their_time(film):
    assert film.sample(-1.0) == 0
    assert film.sample(0.0) == 0
    assert film.sample(1.0) == 100
    assert film.sample(1.0099) == 100
    assert film.sample(99.0) == len(film.run) - 1


def test_the_tool_pose_is_that_of_the_arm(film, iiwa):
    for i in (0, 350, 899):
        at = iiwa.kinematics(film.run.joints[i])
        # Quaternions and back again: rounding.
        np.testing.assert_allclose(film.tool(i).rotation().matrix(), at.R, atol=1e-12)
        np.testing.assert_allclose(film.tool(i).translation(), at.p, atol=1e-12)


def test_the_panel_shows_modes_limits_and_singularities(film):
    run = film.run
    assert film.readout(0).mode == "end-effector mode"
    assert film.readout(350).mode == "null-space mode, group 1 (joints 1 2 3)"
    at = int(np.flatnonzero(run.limits.any(axis=1))[0])
    joint = int(np.flatnonzero(run.limits[at])[0])
    assert film.readout(at).states[joint] == LIMIT
    assert f"joint {joint + 1}" in film.readout(at).message
    stretched = int(np.flatnonzero(run.singular)[-1])
    assert SINGULAR in film.readout(stretched).states
    held = dataclasses.replace(run, clutch=np.ones(len(run), bool))
    assert RunView(film.arm, held).readout(0).mode == "end-effector mode; clutch engaged"
    stopped = dataclasses.replace(run, stopped=np.ones(len(run), bool))
    assert RunView(film.arm, stopped).readout(0).message == "stopped"


def test_it_plays_by_the_clock_and_ends(replay, film):
    replay.advance(0.5)
    assert replay.time == pytest.approx(0.5)
    replay.advance(100.0)
    assert replay.time == film.length
    assert not replay.playing


def test_the_slider_sets_the_time_and_pauses(replay, meshcat):
    replay.advance(0.123)
    replay.advance(0.123)
    assert replay.playing
    meshcat.SetSliderValue(TIME, 4.0)
    replay.advance(0.5)
    assert replay.time == pytest.approx(4.0)
    assert not replay.playing


def test_speed_and_buttons(replay, meshcat, monkeypatch):
    meshcat.SetSliderValue(SPEED, 2.0)
    replay.advance(1.0)
    assert replay.time == pytest.approx(2.0)
    clicks = {PLAY: 0, RESTART: 0}

    monkeypatch.setattr(replay, "_meshcat", Instead(meshcat, GetButtonClicks=clicks.__getitem__))
    clicks[PLAY] = 1
    replay.advance(1.0)
    assert (replay.time, replay.playing) == (pytest.approx(2.0), False)
    clicks[RESTART] = 1
    replay.advance(0.0)
    assert (replay.time, replay.playing) == (0.0, True)
    replay.advance(100.0)
    clicks[PLAY] = 2
    replay.advance(0.0)
    assert (replay.time, replay.playing) == (0.0, True)


def test_the_arm_is_in_the_posture_of_the_run(replay, meshcat, iiwa_display, film, monkeypatch):
    moved = {}

    monkeypatch.setattr(replay, "_meshcat", Instead(meshcat, SetTransform=moved.__setitem__))
    replay.time = 5.0
    replay.show()
    for path, pose in iiwa_display.poses(film.run.joints[500]).items():
        assert moved[path].IsExactlyEqualTo(pose)


def test_another_robots_run_is_refused(driven):
    with pytest.raises(DataFileError, match=r"iiwa_joint_1.*'panda'.*--robot"):
        RunView(load_arm("panda"), driven)


def test_page_is_whole_and_small(iiwa_display, film):
    text = replay_page(open_meshcat(), iiwa_display, film, title="iiwa & co", notes=["<by> me"])
    assert "iiwa &amp; co" in text
    assert "&lt;by&gt; me" in text
    assert text.count("</body>") == 1
    # 2.2 MB of it are Meshcat.
    assert len(text.encode()) < 5e6


def test_long_runs_get_fewer_pictures(iiwa, iiwa_display, ready):
    session = Teleoperation(iiwa, ready)
    command = Command(angular=(0.0, 0.0, 0.1))
    rows = [(command, session.step(command)) for _ in range(400)]
    run = run_from_steps(iiwa, rows, {})
    # Thirteen minutes with a sample every two seconds.
    long = RunView(iiwa, dataclasses.replace(run, time=200.0 * run.time))
    assert long.length > 790
    text = replay_page(open_meshcat(), iiwa_display, long, title="long")
    assert len(text.encode()) < 10e6


def test_the_line_of_a_trial_is_shown(driven, iiwa, iiwa_display, meshcat):
    ends = {"line_start": [0.6, 0.2, 0.9], "line_end": [-0.1, 0.2, 0.9]}
    film = RunView(iiwa, dataclasses.replace(driven, metadata=ends))
    np.testing.assert_array_equal(film.course[1], ends["line_end"])
    Replay(meshcat, iiwa_display, film)
    assert meshcat.HasPath("course/line")


@pytest.mark.parametrize(
    "ends",
    [
        {},
        {"line_start": [0.6, 0.2, 0.9]},
        {"line_start": [0.6, 0.2, 0.9], "line_end": "there"},
        {"line_start": [0.6, 0.2], "line_end": [0.6, 0.2]},
        {"line_start": [0.6, 0.2, 0.9], "line_end": [0.6, 0.2, 0.9]},
        {"line_start": [0.6, 0.2, 0.9], "line_end": [0.6, float("nan"), 0.9]},
    ],
    ids=["none", "no end", "a word", "flat", "no way", "nowhere"],
)
def test_a_run_without_a_line_shows_none(driven, iiwa, ends):
    assert RunView(iiwa, dataclasses.replace(driven, metadata=ends)).course is None


def test_pictures_of_a_long_run_go_to_its_end(iiwa_display, driven, iiwa):
    seen = []

    class Noting(RunView):
        def sample(self, seconds):
            seen.append(seconds)
            return super().sample(seconds)

    long = Noting(iiwa, dataclasses.replace(driven, time=20.0 * driven.time))
    replay_page(open_meshcat(), iiwa_display, long, title="long")
    assert len(seen) <= 3002
    # Even times, the last one less than a picture after the end.
    assert np.ptp(np.diff(seen)) < 1e-9
    assert long.length <= seen[-1] < long.length + seen[1]

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from tcs.model.scene import Scene
from tcs.output.view import SceneObjects, ViewedSet, export, export_page, open_meshcat, play_steps
from tcs.output.view.scene_objects import camera_pose
from tests.output.view.browser import chromium


def test_every_goal_of_the_set_is_shown_once_at_the_member_that_serves_it_best(bed):
    steps = play_steps(bed)
    reached = bed.scores.reached[list(bed.members)].any(axis=0)
    assert sorted(step.goal for step in steps) == list(reached.nonzero()[0])
    for step in steps:
        assert bed.members[step.member] == step.index
        assert bed.joints(step.index, step.goal) is not None


def test_without_a_set_the_first_configuration_is_shown(objects, shaving_set):
    nothing = ViewedSet(shaving_set.grid, shaving_set.scores, (), None)
    assert len(play_steps(nothing)) == 1
    assert "No configuration reaches a goal" in export_page(
        open_meshcat(), objects, nothing, title="Nothing"
    )


def test_page_states_what_it_is_and_fits_into_four_megabytes(objects, shaving_set):
    text = export_page(
        open_meshcat(), objects, shaving_set, title="Shaving & more", notes=["By <no one>."]
    )
    assert "Shaving &amp; more" in text
    for entry in ("Arrows: ", "goal shown", "where the base stands", "scored arm"):
        assert entry in text
    assert text.count('id="tcs-pause"') == 1
    head = text[: text.index("</head>")]
    assert head.count('name="viewport" content="width=device-width') == 1
    assert "By &lt;no one&gt;." in text
    assert text.count("</body>") == 1
    assert len(text.encode()) < 4e6


@pytest.mark.parametrize("base", [(2.0, 0.0), (-1.0, -1.0), (0.0, 1.5), None])
def test_the_camera_sees_person_and_goals_beside_the_robot(base):
    goals = [RigidTransform(p=[0.4, 0.1, 1.0]), RigidTransform(p=[0.6, -0.1, 1.2])]
    eye, middle = camera_pose(goals, base)
    assert middle == pytest.approx([0.5, 0.0, 1.1])
    away = eye - middle
    assert np.hypot(*away[:2]) == pytest.approx(2.7)
    if base is None:
        # Tools point along x: they come from the other side.
        assert away[:2] == pytest.approx([-2.7, 0.0])
        return
    towards = np.array(base) - middle[:2]
    cosine = away[:2] @ towards / np.hypot(*towards) / 2.7
    assert cosine == pytest.approx(np.cos(1.75))
    turned = RigidTransform(RollPitchYaw(0.0, 0.0, np.pi), [0.0, 0.0, 0.0])
    mirrored = [RigidTransform(turned.rotation(), goal.translation()) for goal in goals]
    if abs(towards[1]) > 0.1:
        assert camera_pose(mirrored, base)[0] != pytest.approx(eye)


class Recorder:
    """An animation that records its calls."""

    def __init__(self, rate):
        self.poses, self.shown = {}, {}

    def SetTransform(self, frame, path, pose):
        self.poses.setdefault(path, {})[frame] = pose.GetAsMatrix34()

    def SetProperty(self, frame, path, name, visible):
        assert name == "visible"
        self.shown.setdefault(path, {})[frame] = visible


def test_objects_are_at_rest_until_the_next_goal(objects, shaving_set, monkeypatch):
    """The browser interpolates between keys, so objects must be at rest between changes."""
    monkeypatch.setattr(export, "MeshcatAnimation", Recorder)
    shots = [objects.snapshot(step.index, step.goal) for step in play_steps(shaving_set)]
    seen = [set(map(str, shot.arrows)) for shot in shots]
    assert len({frozenset(one) for one in seen}) > 1
    found = export._animation(shots, seen)
    hold = export._HOLD
    moved = 0
    for path, keys in found.poses.items():
        frames = sorted(keys)
        moved += len(frames) > 2
        for number, shot in enumerate(shots):
            for frame in (number * hold, number * hold + hold // 2, (number + 1) * hold - 1):
                before = max(key for key in frames if key <= frame)
                after = min((key for key in frames if key >= frame), default=before)
                np.testing.assert_array_equal(keys[before], shot.poses[path])
                np.testing.assert_array_equal(keys[after], shot.poses[path])
    assert moved > 1
    for path, keys in found.shown.items():
        for number, one in enumerate(seen):
            assert keys[max(key for key in keys if key <= number * hold)] == (path in one)


def test_captions_state_when_each_member_is_shown(shaving_set):
    steps = play_steps(shaving_set)
    lines = export._captions(shaving_set, steps)
    times = [tuple(map(float, line.split(" s:")[0].split(" to "))) for line in lines]
    assert times[0][0] == 0.0
    assert [start for start, _ in times[1:]] == [end for _, end in times[:-1]]
    assert times[-1][1] == pytest.approx(len(steps) * 1.5)


@pytest.mark.parametrize("name", ["pr2", "tiago"])
@pytest.mark.slow
def test_page_with_meshes_fits_into_fifteen_megabytes(spec, shaving, shaving_set, name, request):
    from tcs.model.robots import load_robot

    scene = Scene(dataclasses.replace(spec, robot=load_robot(name)), meshes=True)
    objects = SceneObjects(scene, shaving, shaving_set, meshes=True)
    text = export_page(open_meshcat(), objects, shaving_set, title="Meshes")
    assert 3e6 < len(text.encode()) < 15e6


@pytest.fixture(scope="module")
def browser():
    yield from chromium()


@pytest.mark.slow
def test_page_plays_through_the_set_without_a_server(browser, objects, shaving_set, tmp_path):
    meshcat = open_meshcat()
    path = tmp_path / "scene.html"
    path.write_text(export_page(meshcat, objects, shaving_set, title="Shaving"))
    del meshcat
    browser.open(path.as_uri(), "robot")
    steps = play_steps(shaving_set)
    script = browser.driver.execute_script
    browser.wait(lambda: script("return viewer.animator.playing"))
    script("document.getElementById('tcs-pause').click()")
    assert not script("return viewer.animator.playing")
    assert script("return document.getElementById('tcs-pause').textContent") == "Play"
    seek = "viewer.animator.pause(); viewer.animator.seek(arguments[0]);"
    where = """
    const p = viewer.scene_tree.find(["drake", "robot"]).object.position; return [p.x, p.y, p.z];
    """
    for number, step in enumerate(steps):
        # In the middle of its second and a half.
        browser.driver.execute_script(seek, 1.5 * number + 0.75)
        result = shaving_set.result(step.index)
        shown = {g: [one.name.lower()] for g, one in enumerate(result.reasons)}
        assert browser.arrows() == shown
        at = result.configuration
        x, y, z = browser.driver.execute_script(where)
        assert (x, y, z) == pytest.approx((at.base_x, at.base_y, 0.0), abs=1e-6)
    assert {step.member for step in steps} == {0, 1}
    assert browser.complaints() == []
    assert [name for name in browser.fetched() if not name.startswith(("data:", "blob:"))] == []
    whole = browser.picture()
    assert (abs(whole - browser.picture("robot")) > 20).any(axis=2).sum() > 3000
    assert (abs(whole - browser.picture("environment")) > 20).any(axis=2).sum() > 3000

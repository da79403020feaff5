from __future__ import annotations

import subprocess
import sys
import time

import numpy as np
import pytest
from pydrake.math import RigidTransform

from tcs.errors import OutputError
from tcs.model.scene import goal_poses
from tcs.output.view import Viewer, open_meshcat
from tcs.output.view.live import show_change


@pytest.fixture(scope="module")
def shared_meshcat():
    return open_meshcat()


@pytest.fixture
def meshcat(shared_meshcat):
    yield shared_meshcat
    shared_meshcat.Delete()
    shared_meshcat.DeleteAddedControls()


@pytest.fixture
def reported():
    return []


@pytest.fixture
def viewer(meshcat, objects, shaving_set, reported):
    return Viewer(meshcat, objects, shaving_set, reported.append)


def test_snapshot_has_the_arm_where_the_table_has_it(objects, scene, shaving_set):
    index = shaving_set.members[0]
    goal = int(np.flatnonzero(shaving_set.scores.reached[index])[0])
    shot = objects.snapshot(index, goal)
    at = shaving_set.grid.configuration(index)
    scene.place_base(at.base_x, at.base_y, at.base_yaw)
    scene.set_torso(at.torso)
    scene.set_arm(shaving_set.joints(index, goal))
    # What the last joint carries moves with every joint of the arm.
    last = next(part.body for part in scene.built.parts if part.carrier == 7)
    X_BL = RigidTransform(shot.poses[f"robot/{int(last)}"])
    X_WL = RigidTransform(shot.poses["robot"]) @ X_BL
    there = scene.built.plant.EvalBodyPoseInWorld(
        scene.plant_context, scene.built.plant.get_body(last)
    )
    assert X_WL.IsNearlyEqualTo(there, 1e-12)
    X_WB = RigidTransform(shot.poses["robot"])
    assert X_WB.translation() == pytest.approx([at.base_x, at.base_y, 0.0])


def test_the_arm_is_at_rest_if_the_goal_is_not_reached(objects, scene, shaving_set):
    reached = shaving_set.scores.reached
    index = int(np.flatnonzero((~reached).sum(axis=1) >= 2)[0])
    first, second = np.flatnonzero(~reached[index])[:2]
    shots = [objects.snapshot(index, int(goal)) for goal in (first, second)]
    for path, pose in shots[0].poses.items():
        if path != "goal shown":
            assert np.array_equal(pose, shots[1].poses[path]), path


def test_arrows_have_the_reasons_and_places_of_the_goals(objects, scene, shaving, shaving_set):
    shot = objects.snapshot(7, 1)
    assert shot.arrows == set(enumerate(shaving_set.result(7).reasons))
    for g, X_WG in enumerate(goal_poses(scene, shaving)):
        assert RigidTransform(shot.poses[f"goals/{g}"]).IsNearlyEqualTo(X_WG, 1e-12)


def test_everything_that_is_shown_is_in_meshcat(viewer, meshcat, objects, shaving_set):
    shot = objects.snapshot(shaving_set.members[0], viewer.state.goal)
    for path in (*shot.poses, "floor", "set/0/outline", "set/1/ahead", "ground"):
        assert meshcat.HasPath(path), path
    for goal in range(shaving_set.goals):
        assert meshcat.HasPath(f"goals/{goal}/too_far")


def test_a_slider_moves_the_robot_and_reports_the_result(viewer, meshcat, reported, shaving_set):
    assert not viewer.update()
    assert len(reported) == 1
    assert reported[0].startswith("member 1 of 2: goal ")
    meshcat.SetSliderValue("base x [m]", -0.1)
    assert viewer.update()
    assert not viewer.update()
    along = viewer.state.along
    index = int(shaving_set.grid.flat(along))
    assert shaving_set.grid.configuration(index).base_x == pytest.approx(-0.1)
    line = shaving_set.result(index).line(viewer.state.goal)
    assert reported[1:] == [f"other configuration: {line}"]


def test_choosing_a_member_moves_the_other_sliders(viewer, meshcat, shaving_set):
    meshcat.SetSliderValue("set member", 2.0)
    assert viewer.update()
    at = shaving_set.grid.configuration(shaving_set.members[1])
    assert meshcat.GetSliderValue("base y [m]") == pytest.approx(at.base_y)
    assert meshcat.GetSliderValue("torso [m]") == pytest.approx(at.torso)
    assert not viewer.update()


class Spy:
    """Records the objects and properties that it receives."""

    def __init__(self):
        self.visible, self.moved = {}, set()

    def SetTransform(self, path, _pose):
        self.moved.add(path)

    def SetProperty(self, path, name, value):
        assert name == "visible"
        self.visible[path] = value


def test_only_what_changes_is_sent_and_one_arrow_is_seen_for_each_goal(objects, shaving_set):
    spy = Spy()
    before, after = objects.snapshot(5, 0), objects.snapshot(40, 0)
    show_change(spy, None, before)
    assert spy.moved == set(before.poses)
    show_change(spy, before, after)
    reasons = shaving_set.result(40).reasons
    seen = {path for path, visible in spy.visible.items() if visible}
    assert seen == {f"goals/{g}/{reason.name.lower()}" for g, reason in enumerate(reasons)}
    spy.moved.clear()
    show_change(spy, after, after)
    assert not spy.moved


def test_run_ends_after_its_duration(viewer):
    begun = time.monotonic()
    viewer.run(duration=0.05)
    assert time.monotonic() - begun >= 0.05


def test_a_port_that_is_taken_is_reported(shared_meshcat):
    with pytest.raises(OutputError, match=f"port {shared_meshcat.port()}"):
        open_meshcat(shared_meshcat.port())


COLLECTED_BY_A_THREAD = """
import gc, threading
from tcs.output.view import open_meshcat
gc.disable()
cycle = [open_meshcat()]
cycle.append(cycle)
del cycle
thread = threading.Thread(target=gc.collect)
thread.start()
thread.join()
print("alive")
"""


def test_a_thread_that_collects_garbage_does_not_end_the_process():
    ran = subprocess.run(
        [sys.executable, "-c", COLLECTED_BY_A_THREAD], capture_output=True, text=True, check=False
    )
    assert (ran.returncode, ran.stdout) == (0, "alive\n"), ran.stderr


def test_a_port_is_free_again_when_its_viewer_is_not_used_any_more():
    meshcat = open_meshcat()
    port = meshcat.port()
    with pytest.raises(OutputError, match="cannot listen"):
        open_meshcat(port)
    del meshcat
    assert open_meshcat(port).port() == port

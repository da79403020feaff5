from __future__ import annotations

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
def told():
    return []


@pytest.fixture
def viewer(meshcat, props, shaving_answers, told):
    return Viewer(meshcat, props, shaving_answers, told.append)


def test_snapshot_has_the_arm_where_the_table_has_it(props, scene, shaving_answers):
    index = shaving_answers.members[0]
    goal = int(np.flatnonzero(shaving_answers.scores.reached[index])[0])
    shot = props.snapshot(index, goal)
    at = shaving_answers.grid.configuration(index)
    scene.place_base(at.base_x, at.base_y, at.base_yaw)
    scene.set_torso(at.torso)
    scene.set_arm(shaving_answers.joints(index, goal))
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


def test_arm_rests_where_the_goal_is_not_reached(props, scene, shaving_answers):
    reached = shaving_answers.scores.reached
    index = int(np.flatnonzero((~reached).sum(axis=1) >= 2)[0])
    first, second = np.flatnonzero(~reached[index])[:2]
    shots = [props.snapshot(index, int(goal)) for goal in (first, second)]
    for path, pose in shots[0].poses.items():
        if path != "goal shown":
            assert np.array_equal(pose, shots[1].poses[path]), path


def test_arrows_have_the_reasons_and_places_of_the_goals(props, scene, shaving, shaving_answers):
    shot = props.snapshot(7, 1)
    assert shot.arrows == set(enumerate(shaving_answers.verdict(7).reasons))
    for g, X_WG in enumerate(goal_poses(scene, shaving)):
        assert RigidTransform(shot.poses[f"goals/{g}"]).IsNearlyEqualTo(X_WG, 1e-12)


def test_everything_that_is_shown_is_in_meshcat(viewer, meshcat, props, shaving_answers):
    shot = props.snapshot(shaving_answers.members[0], viewer.state.goal)
    for path in (*shot.poses, "floor", "set/0/outline", "set/1/ahead", "ground"):
        assert meshcat.HasPath(path), path
    for goal in range(shaving_answers.goals):
        assert meshcat.HasPath(f"goals/{goal}/too_far")


def test_a_slider_moves_the_robot_and_tells_the_verdict(viewer, meshcat, told, shaving_answers):
    assert not viewer.look()
    assert len(told) == 1
    assert told[0].startswith("member 1 of 2: goal ")
    meshcat.SetSliderValue("stand at x [m]", -0.1)
    assert viewer.look()
    assert not viewer.look()
    along = viewer.state.along
    index = int(shaving_answers.grid.flat(along))
    assert shaving_answers.grid.configuration(index).base_x == pytest.approx(-0.1)
    line = shaving_answers.verdict(index).line(viewer.state.goal)
    assert told[1:] == [f"stand here: {line}"]


def test_choosing_a_member_takes_the_other_sliders_along(viewer, meshcat, shaving_answers):
    meshcat.SetSliderValue("set member", 2.0)
    assert viewer.look()
    at = shaving_answers.grid.configuration(shaving_answers.members[1])
    assert meshcat.GetSliderValue("stand at y [m]") == pytest.approx(at.base_y)
    assert meshcat.GetSliderValue("torso [m]") == pytest.approx(at.torso)
    assert not viewer.look()


class Spy:
    """Notes what it is asked to show."""

    def __init__(self):
        self.visible, self.moved = {}, set()

    def SetTransform(self, path, _pose):
        self.moved.add(path)

    def SetProperty(self, path, name, value):
        assert name == "visible"
        self.visible[path] = value


def test_only_what_changes_is_sent_and_one_arrow_is_seen_for_each_goal(props, shaving_answers):
    spy = Spy()
    before, after = props.snapshot(5, 0), props.snapshot(40, 0)
    show_change(spy, None, before)
    assert spy.moved == set(before.poses)
    show_change(spy, before, after)
    reasons = shaving_answers.verdict(40).reasons
    seen = {path for path, visible in spy.visible.items() if visible}
    assert seen == {f"goals/{g}/{reason.name.lower()}" for g, reason in enumerate(reasons)}
    spy.moved.clear()
    show_change(spy, after, after)
    assert not spy.moved


def test_run_ends_when_it_is_told(viewer):
    begun = time.monotonic()
    viewer.run(duration=0.05)
    assert time.monotonic() - begun >= 0.05


def test_a_port_that_is_taken_is_told(shared_meshcat):
    with pytest.raises(OutputError, match=f"port {shared_meshcat.port()}"):
        open_meshcat(shared_meshcat.port())

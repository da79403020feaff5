"""Joints of an environment: their limits, and the joints that follow them."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from tcs.errors import EnvironmentFileError, GridError, TcsError, UnknownNameError
from tcs.model.grid import Axis, Grid
from tcs.model.scene import Scene, SceneSpec, load_environment, lower
from tcs.model.tasks import load_task
from tests.model.scene.environments import EnvironmentAlone

LIFT = """\
<sdf version="1.9">
  <model name="lift">
    <link name="base"/>
    <link name="top"/>
    <joint name="height" type="prismatic">
      <parent>base</parent><child>top</child>
      <axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis>
    </joint>
    <link name="flap_link"/>
    <joint name="flap" type="revolute">
      <parent>top</parent><child>flap_link</child>
      <axis><xyz>0 1 0</xyz><limit><lower>-1.5</lower><upper>1.5</upper></limit></axis>
    </joint>
    <link name="ball_link"/>
    <joint name="ball" type="ball"><parent>top</parent><child>ball_link</child></joint>
  </model>
</sdf>
"""
AXIS = {"unit": "m", "start": 0.0, "step": 0.1, "count": 2}
GRID = {
    "base_x": AXIS,
    "base_y": AXIS,
    "base_yaw": {"unit": "deg", "start": 0.0, "step": 90.0, "count": 4},
    "torso": AXIS,
}
FLAP_FOLLOWS = {"height": {"knots": [0, 1], "joints": {"flap": [0.2, 1.2]}}}


@pytest.fixture
def lift(tmp_path):
    """Make an environment with a lift, given what else its file says."""
    (tmp_path / "lift.sdf").write_text(LIFT, encoding="utf-8")

    def make(**changes):
        content = {
            "name": "hall",
            "title": "A hall",
            "origin": "the door",
            "source": "made up",
            "models": [{"name": "lift", "file": "lift.sdf"}],
            "grid": GRID,
            **changes,
        }
        path = tmp_path / "hall.yaml"
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        return EnvironmentAlone(path)

    return make


def angle(X):
    R = X.rotation().matrix()
    return np.arctan2(R[0, 2], R[0, 0])


def test_followers_have_their_positions_from_the_start(lift):
    environment = lift(posture=FLAP_FOLLOWS)
    assert angle(environment.pose("lift::flap_link")) == pytest.approx(0.2, abs=1e-12)
    environment = lift(posture=FLAP_FOLLOWS, joints={"height": 0.5})
    assert angle(environment.pose("lift::flap_link")) == pytest.approx(0.7, abs=1e-12)


def test_a_leader_is_limited_to_its_knots(lift):
    assert lift().added.joints.limits("height") == (-1.0, 2.0)
    environment = lift(posture=FLAP_FOLLOWS)
    assert environment.added.joints.limits("height") == (0.0, 1.0)
    for beyond in (-0.01, 1.01, np.nan):
        with pytest.raises(TcsError, match=r"joint 'height': .* m is beyond .* 0 to 1 m"):
            environment.set(height=beyond)
    # Rounding is tolerated.
    environment.set(height=0.1 * 3 + 0.7 + 1e-12)


@pytest.mark.parametrize(
    ("changes", "error", "expected"),
    [
        (
            {"joints": {"height": 2.5}},
            EnvironmentFileError,
            r"'hall', field 'joints', joint 'height': 2\.5 m is beyond .* -1 to 2 m",
        ),
        (
            {"joints": {"height": 1.5}, "posture": FLAP_FOLLOWS},
            EnvironmentFileError,
            r"joint 'height': 1\.5 m is beyond .* 0 to 1 m",
        ),
        (
            {"joints": {"ball": 1.0}},
            EnvironmentFileError,
            r"joint 'ball' is ball_rpy, but only revolute and prismatic",
        ),
        (
            {"posture": {"heigth": {"knots": [0, 1], "joints": {"flap": [0, 1]}}}},
            UnknownNameError,
            r"field 'posture\.heigth': unknown joint 'heigth'.*Did you mean 'height'",
        ),
        (
            {"posture": {"height": {"knots": [0, 1], "joints": {"flip": [0, 1]}}}},
            UnknownNameError,
            r"field 'posture\.height': unknown joint 'flip'.*Did you mean 'flap'",
        ),
        (
            {"posture": {"height": {"knots_deg": [0, 1], "joints": {"flap": [0, 1]}}}},
            EnvironmentFileError,
            r"'posture\.height': the joint is prismatic, so give 'knots'",
        ),
        (
            {"posture": {"height": {"knots": [0, 1], "joints": {"flap": [0, 1.6]}}}},
            EnvironmentFileError,
            r"'posture\.height', joint 'flap': 91\.6732 deg is beyond .* -85\.9437 to 85\.9437 deg",
        ),
        (
            {"observed": {"heigth": {**AXIS}}},
            UnknownNameError,
            r"field 'observed': unknown environment axis 'heigth'",
        ),
        (
            {"observed": {"flap": {**AXIS}}},
            GridError,
            r"field 'observed', axis 'flap': unit is 'm', but the joint is revolute.*'deg'",
        ),
        (
            {"observed": {"height": {**AXIS, "count": 22}}},
            GridError,
            r"field 'observed', axis 'height': 2\.1 m is beyond .* -1 to 2 m",
        ),
    ],
)
def test_an_invalid_position_is_refused_with_its_source(lift, changes, error, expected):
    with pytest.raises(error, match=expected) as caught:
        lift(**changes)
    assert "\n" not in str(caught.value)


def test_a_follower_cannot_be_set(lift):
    environment = lift(posture=FLAP_FOLLOWS)
    with pytest.raises(TcsError, match=r"'flap' follows 'height' .*Set 'height'"):
        environment.set(flap=0.1)


@pytest.fixture(scope="module")
def bed_scene(pr2):
    return Scene(SceneSpec(pr2, load_environment("bed")))


def test_a_scene_moves_the_person_with_the_head_rest(bed_scene):
    knee = bed_scene.body_frame_pose("calf_left").translation()
    bed_scene.set_joint("head_rest", np.radians(70))
    raised = bed_scene.body_frame_pose("calf_left").translation()
    bed_scene.set_joint("head_rest", 0.0)
    # hrl_base_selection: the legs move toward the foot end, x 1.404 to 1.563 m.
    assert knee[0] == pytest.approx(1.404, abs=1e-3)
    assert raised[0] == pytest.approx(1.563, abs=1e-3)
    np.testing.assert_array_equal(bed_scene.body_frame_pose("calf_left").translation(), knee)


def test_a_scene_refuses_what_its_joints_cannot_do(bed_scene):
    before = bed_scene.positions()
    with pytest.raises(
        TcsError, match=r"environment 'bed', joint 'bed_height': 0\.4 m .* 0 to 0\.3"
    ):
        bed_scene.set_joint("bed_height", 0.4)
    with pytest.raises(TcsError, match=r"environment 'bed'.*'neck_body' follows 'head_rest'"):
        bed_scene.set_joint("neck_body", 0.1)
    with pytest.raises(UnknownNameError, match=r"environment 'bed'.*Did you mean 'head_rest'"):
        bed_scene.set_joint("headrest", 0.1)
    np.testing.assert_array_equal(bed_scene.positions(), before)


@pytest.mark.parametrize(
    ("axis", "error", "expected"),
    [
        (
            Axis("head_rest", "deg", 0, 35, 4),
            GridError,
            r"axis 'head_rest': 105 deg .* 0 to 80 deg",
        ),
        (Axis("head_rest", "m", 0, 1, 1), GridError, r"axis 'head_rest': unit is 'm'.*'deg'"),
        (Axis("bed_height", "m", -0.1, 0.1, 2), GridError, r"'bed_height': -0\.1 m .* 0 to 0\.3 m"),
        (Axis("neck_body", "deg", 0, 1, 2), GridError, r"'neck_body' follows 'head_rest'"),
        (Axis("bed_heigth", "m", 0, 0.1, 2), UnknownNameError, r"axis 'bed_heigth'.*'bed_height'"),
    ],
    ids=lambda value: value.name if isinstance(value, Axis) else "",
)
def test_a_grid_beyond_the_bed_is_refused(bed_scene, axis, error, expected):
    robot_axes = Grid.from_spec(bed_scene.spec.environment.grid).axes[-4:]
    with pytest.raises(error, match=rf"task 'bathing', environment 'bed'.*{expected}"):
        lower(bed_scene, load_task("bathing"), Grid((axis, *robot_axes)))


def test_every_state_of_the_bed_is_lowered(bed_scene):
    environment = bed_scene.spec.environment
    grid = Grid.from_spec(environment.grid)
    (shift,) = environment.observed_axes
    task = load_task("bathing")
    before = bed_scene.positions()
    lowered = lower(bed_scene, task, Grid((shift, *grid.axes)))
    np.testing.assert_array_equal(bed_scene.positions(), before)
    assert lowered.grid.environment_states == 60
    assert lowered.arrays.goal_p.shape == (60, 14, 3)
    states = lowered.arrays.goal_p.reshape(5, 4, 3, 14, 3)
    # A shift moves every goal across, a raise lifts it; both leave the rest alone.
    across = np.broadcast_to(0.05 * np.eye(3)[1], states[1:].shape)
    np.testing.assert_allclose(np.diff(states, axis=0), across, atol=1e-12)
    up = np.broadcast_to(0.1 * np.eye(3)[2], states[:, 1:].shape)
    np.testing.assert_allclose(np.diff(states, axis=1), up, atol=1e-12)
    # Raising the head rest moves each goal by centimetres.
    assert np.linalg.norm(np.diff(states, axis=2), axis=-1).min() > 0.01

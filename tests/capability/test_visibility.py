import math

import numpy as np
import pytest

from tcs.capability.head import View, head_names, head_view, load_head
from tcs.capability.visibility import CORRECTED, THESIS, visibility
from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots import load_robot

TIAGO = View((0.0, 0.0, 0.0), tuple(np.radians([-104.0, 104.0])), tuple(np.radians([-82.5, 67.5])))


def point_at(yaw_deg, pitch_deg):
    """Return a point in a direction from the camera."""
    yaw, pitch = math.radians(yaw_deg), math.radians(pitch_deg)
    flat = math.cos(pitch)
    return np.array([[flat * math.cos(yaw), flat * math.sin(yaw), math.sin(pitch)]])


# Worked by hand from eqs. (13) to (15): halves of 1 - |yaw| / 104 and 1 - |pitch + 45| / 112.5.
@pytest.mark.parametrize(
    ("yaw", "pitch", "score"),
    [
        (0, -45, 1.0),
        (52, -45, 0.75),
        (0, 11.25, 0.75),
        (0, -82.5, 0.5 * (1 + 1 - 37.5 / 112.5)),
        (0, 80, 0.5),
        (180, -45, 1.0),
    ],
)
def test_as_printed(yaw, pitch, score):
    assert visibility(TIAGO, point_at(yaw, pitch), THESIS)[0] == pytest.approx(score, abs=1e-9)


@pytest.mark.parametrize(
    ("yaw", "pitch", "score"),
    [
        (0, -45, 1.0),
        (52, -45, 0.75),
        (-52, -45, 0.75),
        (0, 11.25, 0.75),
        (0, -63.75, 0.75),
        (0, -82.4999, 0.5),
        (0, 80, 0.0),
        (180, -45, 0.0),
        (110, -45, 0.0),
    ],
)
def test_corrected(yaw, pitch, score):
    # A tenth of a millionth of a degree short of the bound costs 1e-6.
    assert visibility(TIAGO, point_at(yaw, pitch), CORRECTED)[0] == pytest.approx(score, abs=3e-6)


def test_a_tool_to_the_side_is_finite():
    points = np.array([[0.0, 1.0, -1.0], [0.0, 0.0, -1.0]])
    assert np.all(np.isfinite(visibility(TIAGO, points, THESIS)))


def test_the_view_of_tiago_is_that_of_the_thesis(reach):
    view = head_view(reach.scene, reach.torso_height)
    np.testing.assert_allclose(np.degrees(view.yaw), [-104.0, 104.0], atol=1e-6)
    np.testing.assert_allclose(np.degrees(view.pitch), [-82.5, 67.5], atol=1e-6)


def test_the_camera_is_where_the_urdf_has_it_not_eq_16(reach):
    plant, state = reach.scene.built.plant, reach.scene.plant_context
    frames = (plant.GetFrameByName(name) for name in ("xtion_rgb_frame", "arm_1_link"))
    camera, shoulder = (
        frame.CalcPose(state, reach.scene.built.base_frame).translation() for frame in frames
    )
    np.testing.assert_allclose(camera - shoulder, [0.12275, 0.008, 0.329], atol=1e-6)
    view = head_view(reach.scene, reach.torso_height)
    # The scene is at another torso height.
    np.testing.assert_allclose(view.p_BoCo_B[:2], camera[:2], atol=1e-9)
    printed = np.array([0.136, 0.043, 0.155])
    assert (camera - shoulder - printed)[2] == pytest.approx(0.174, abs=1e-6)


def test_the_tool_frame_of_the_thesis_is_8_cm_behind_that_of_the_robot_file(reach):
    plant, state = reach.scene.built.plant, reach.scene.plant_context
    ours, theirs = (
        plant.GetFrameByName(name) for name in ("gripper_tool_frame", "gripper_grasping_frame")
    )
    X = theirs.CalcPose(state, ours)
    np.testing.assert_allclose(X.translation(), [-0.08, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(X.rotation().matrix(), np.eye(3), atol=1e-9)


def test_the_camera_moves_with_the_torso_and_the_scene_is_restored(reach):
    before = reach.scene.positions()
    low, high = (head_view(reach.scene, torso_height).p_BoCo_B for torso_height in (0.0, 0.3))
    np.testing.assert_allclose(np.subtract(high, low), [0, 0, 0.3], atol=1e-12)
    np.testing.assert_array_equal(reach.scene.positions(), before)


def test_the_shipped_heads_fit_their_robots():
    for name in head_names():
        assert load_head(load_robot(name)).source


def test_a_robot_without_a_head_file_is_refused():
    with pytest.raises(RobotError, match="'iiwa7': no head file ships for it, only for pr2"):
        load_head(load_robot("iiwa7"))


def test_unknown_rule():
    with pytest.raises(UnknownNameError, match="visibility 'best'"):
        visibility(TIAGO, np.zeros((1, 3)), "best")

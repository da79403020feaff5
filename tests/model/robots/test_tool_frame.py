"""Axes of a hand in its tool frame, and the frame that goals need."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tcs.model.robots import load_robot
from tcs.model.robots.tool_frame import HandAxes, hand_axes

AXES = [sign * np.eye(3)[k] for k in range(3) for sign in (1.0, -1.0)]


@pytest.mark.parametrize(
    ("forward", "opening"), [p for p in itertools.product(AXES, AXES) if not np.any(p[0] * p[1])]
)
def test_goal_axes_have_x_forward_and_y_along_the_opening(forward, opening):
    axes = HandAxes(forward, opening, fingers=True).goal_axes()
    R = Rotation.from_euler("xyz", axes, degrees=True).as_matrix()
    np.testing.assert_allclose(R[:, 0], forward, atol=1e-12)
    np.testing.assert_allclose(np.abs(R[:, 1]), np.abs(opening), atol=1e-12)


@pytest.mark.parametrize("forward", AXES)
def test_without_fingers_x_is_forward(forward):
    hand = HandAxes(forward, None, fingers=False)
    R = Rotation.from_euler("xyz", hand.goal_axes(), degrees=True).as_matrix()
    np.testing.assert_allclose(R[:, 0], forward, atol=1e-12)
    assert hand.is_forward_x == (forward[0] == 1.0)


def test_the_fingers_of_tiago_pro_open_along_y():
    robot = load_robot("tiago_pro")
    hand = hand_axes(robot)
    assert hand.fingers
    assert hand.is_forward_x
    assert abs(hand.opening[1]) > 0.99
    base = hand_axes(robot.model_copy(update={"tool_frame": "gripper_left_base_link"}))
    assert base.forward_axis == "+z"


def test_a_bare_flange_points_away_from_its_link():
    hand = hand_axes(load_robot("ur5"))
    assert not hand.fingers
    assert hand.opening is None
    assert hand.is_forward_x

"""The tool frame against the fingers, and what needs seven joints."""

import dataclasses

import pytest

from tcs.errors import RobotError
from tcs.model.robot_check import fingers_off_axis
from tcs.model.robots import load_robot, robot_names
from tcs.teleop.arm import load_arm
from tcs_shapes.checkup import check_up


@pytest.mark.parametrize("name", robot_names())
def test_fingers_of_shipped_robots_point_along_x(name):
    assert fingers_off_axis(load_robot(name)) is None


def test_a_frame_with_z_forward_is_found():
    robot = load_robot("tiago_pro").model_copy(update={"tool_frame": "gripper_left_base_link"})
    assert fingers_off_axis(robot) == "+z"


@pytest.mark.slow  # enclosure takes seconds
def test_the_check_up_reports_it(pr2):
    found = dataclasses.replace(check_up(pr2, samples=1), fingers_along="+z")
    (problem,) = found.problems
    assert "along +z of tool frame 'l_gripper_tool_frame'" in problem
    assert found.to_json()["fingers_along"] == "+z"


def test_what_needs_seven_joints_refuses_six():
    with pytest.raises(RobotError, match=r"'ur5': teleoperation needs an arm of 7 joints.* has 6"):
        load_arm("ur5")

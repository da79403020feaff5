"""Faults of one's own robot files of which scoring warns."""

import dataclasses

import pytest
import yaml

from tcs.errors import RobotError
from tcs.files.paths import data_folder
from tcs.model.robot_check import fingers_off_axis, quick_problems
from tcs.model.robots import load_robot, robot_names
from tcs.teleop.arm import load_arm
from tcs_shapes.checkup import check_up

PRO = """\
based_on: tiago_pro
name: mine
tool_frame: gripper_left_base_link
"""


@pytest.mark.parametrize("name", robot_names())
def test_robots_that_ship_have_none(name):
    assert quick_problems(name) == ()
    assert quick_problems(data_folder() / "models" / "robots" / f"{name}.yaml") == ()


def test_fingers_that_point_along_z_are_found(tmp_path):
    (tmp_path / "mine.yaml").write_text(PRO)
    problem, _ = quick_problems(tmp_path / "mine.yaml")
    assert "point along +z of tool frame 'gripper_left_base_link'" in problem


def test_a_root_above_the_floor_is_found(tmp_path):
    shipped = yaml.safe_load((data_folder() / "models" / "robots" / "ur5.yaml").read_text())
    mount = {**shipped["mount"], "xyz": [0.0, 0.0, -0.4]}
    content = {"based_on": "ur5", "name": "mine", "mount": mount}
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump(content))
    (problem,) = quick_problems(tmp_path / "mine.yaml")
    assert "below" in problem
    assert "add a mount" in problem


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

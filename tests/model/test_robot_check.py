"""Faults of one's own robot files of which scoring warns."""

import pytest
import yaml

from tcs.files.paths import data_folder
from tcs.model.robot_check import quick_problems
from tcs.model.robots import robot_names

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

"""Which joints before a tool are taken as its arm."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import RobotError
from tcs.kernel.six_joints.arm import is_sliding
from tcs.model.robots import load_robot
from tcs.model.robots.urdf import read_urdf
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec, arm_chain
from tcs_shapes.arm_joints import nearest_joints
from tcs_shapes.checkup import arm_class, round_trip
from tcs_shapes.draft import DraftOptions, draft_robot, write_draft
from tests.model.robots.made_up import gantry, urdf


def joints_of(folder, text):
    """Return the joints that move the tool of a URDF."""
    path = folder / "arm.urdf"
    path.write_text(text)
    model = read_urdf(path)
    return [joint for joint in model.chain(model.root, "tool") or () if joint.is_movable]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (urdf(), "a1 a2 a3 a4 a5 a6 a7"),
        (urdf(joints=6), "a1 a2 a3 a4 a5 a6"),
        (urdf(joints=5), "a1 a2 a3 a4 a5"),
        (gantry(), "j1 j2 j3 j4 j5 j6"),
        (gantry("PPPRR", telescope=False), "j1 j2 j3 j4 j5"),
        (gantry("PPPPRRR"), "j2 j3 j4 j5 j6 j7"),
    ],
    ids=["seven", "six", "five", "telescope", "five, three prismatic", "torso before"],
)
def test_the_arm_is_the_joints_nearest_the_tool(text, names, tmp_path):
    found = nearest_joints(joints_of(tmp_path, text), "from a to b")
    assert [joint.name for joint in found] == names.split()


@pytest.mark.parametrize(
    ("kinds", "found"),
    [
        ("PPRRRR", r"only 4 revolute joints.*Of the last 6 joints 2 are prismatic"),
        ("PPPR", r"only 1 revolute joints.*Of the last 4 joints 3 are prismatic"),
        ("RRR", r"only 3 revolute joints in a row lead \(j1, j2, j3\).*makes up for one. Name"),
    ],
)
def test_what_is_not_supported_is_one_line(kinds, found, tmp_path):
    joints = joints_of(tmp_path, gantry(kinds, telescope=False))
    with pytest.raises(RobotError, match=found) as error:
        nearest_joints(joints, "from a to b")
    assert "\n" not in str(error.value)


def test_a_drafted_arm_with_a_telescope_is_solved(tmp_path):
    path = tmp_path / "gantry.urdf"
    path.write_text(gantry())
    write_draft(draft_robot(path, "tool", DraftOptions(coarse=True)), tmp_path / "gantry.yaml")
    robot = load_robot(tmp_path / "gantry.yaml")
    assert robot.followers() == {"j1": ("stage",)}
    scene = Scene(SceneSpec(robot, EMPTY_ENVIRONMENT))
    scene.set_arm(np.zeros(6))
    chain, _ = arm_chain(scene)
    found = arm_class(chain)
    assert found.name == "three prismatic joints"
    assert is_sliding(found.solver)
    trip = round_trip(scene, found.solver, samples=50, seed=0)
    assert trip.recovered == 50

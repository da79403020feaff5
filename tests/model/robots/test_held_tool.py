"""Tools in the hand: shapes, tip, and robots named with the tool that they hold."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots import holding, load_robot, load_tool, tool_names
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec

WAND = """\
name: wand
title: a wand
source: made up
grip: {rpy_deg: [0, 0, 90]}
tip: {xyz: [0.3, 0, 0.1], rpy_deg: [0, -90, 0]}
shapes:
  - {kind: capsule, size: [0.01, 0.2], xyz: [0.1, 0, 0], rpy_deg: [0, 90, 0]}
"""


@pytest.fixture
def wand(tmp_path):
    file = tmp_path / "wand.yaml"
    file.write_text(WAND)
    return file


def test_the_tip_is_the_tool_frame(wand):
    bare, held = load_robot("pr2"), load_robot(holding("pr2", wand))
    model, positions = model_with_extras(held), held.with_mimics(held.joint_positions())
    R, p = pose_in_root(model, bare.tool_frame, positions)
    R_tip, p_tip = pose_in_root(model, held.tool_frame, positions)
    # A quarter to the left about the robot's z, then 30 cm along the wand.
    np.testing.assert_allclose(R.T @ (p_tip - p), [0, 0.3, 0.1], atol=1e-12)
    np.testing.assert_allclose((R.T @ R_tip)[:, 0], [0, 0, 1], atol=1e-12)
    shapes = [s for s in held.load_primitives() if s.body == "wand"]
    assert len(shapes) == 1
    assert len(held.load_primitives()) == len(bare.load_primitives()) + 1


def test_the_name_loads_the_same_robot_again(wand, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    held = load_robot("pr2+wand.yaml")
    assert held.name == f"pr2+{wand}"
    monkeypatch.chdir("/")
    assert load_robot(held.name) == held


@pytest.mark.parametrize("name", tool_names())
def test_tools_that_ship_are_held(name):
    """Their tip is at the surface or ahead of it, and Drake builds the scene with them."""
    tool, held = load_tool(name), load_robot(f"panda+{name}")
    x = tool.tip.xyz[0]
    ahead = [s.xyz[0] + max(s.size) / 2 for s in tool.shapes]
    assert x >= max(s.xyz[0] for s in tool.shapes)
    assert x <= max(ahead) + 0.12
    scene = Scene(SceneSpec(held, EMPTY_ENVIRONMENT))
    assert any(part.name == name for part in scene.built.parts)


def test_faults_of_a_tool_are_one_line(wand, tmp_path):
    with pytest.raises(UnknownNameError, match="Did you mean 'spoon'"):
        load_robot("pr2+spon")
    with pytest.raises(UnknownNameError, match="robot 'pr3'"):
        load_robot("pr3+spoon")
    wand.write_text(WAND.replace("size: [0.01, 0.2]", "size: [0.01]"))
    with pytest.raises(RobotError, match="a capsule needs 2"):
        load_robot(f"pr2+{wand}")
    wand.write_text(WAND.replace("title: a wand", "gripper: shut"))
    with pytest.raises(RobotError, match="title"):
        load_robot(f"pr2+{wand}")
    wand.write_text(WAND + "gripper: shut\n")
    with pytest.raises(UnknownNameError, match="shut"):
        load_robot(f"pr2+{wand}")
    wand.write_text(WAND.replace("name: wand", "name: l_gripper_palm_link"))
    with pytest.raises(RobotError, match="the name is taken"):
        load_robot(f"pr2+{wand}")


def test_a_tool_may_be_a_mesh(wand, tmp_path):
    solid = trimesh.creation.cone(radius=20.0, height=150.0)
    solid.export(tmp_path / "funnel.stl")
    mesh = "mesh: {file: funnel.stl, scale: 0.001, xyz: [0.1, 0, 0], rpy_deg: [10, 90, 20]}\n"
    wand.write_text(WAND[: WAND.index("shapes:")] + mesh)
    held = load_robot(holding("pr2", wand))
    shapes = [s for s in held.load_primitives() if s.body == "wand"]
    turn = Rotation.from_euler("xyz", [10, 90, 20], degrees=True)
    points = turn.apply(solid.vertices * 0.001) + np.array([0.1, 0, 0])
    # STL keeps seven digits; the shapes enclose what is in the file.
    assert np.any([s.contains(points, tolerance=1e-6) for s in shapes], axis=0).all()
    # They protrude by 3 mm at most, at the rim by more.
    around = np.array([[0.1, 0.0, 0.04], [0.1 + 0.16, 0.0, 0.0], [0.0, 0.1, 0.0]])
    assert not np.any([s.contains(around) for s in shapes], axis=0).any()


def test_meshes_of_tools_that_cannot_be_used_are_one_line(wand, tmp_path):
    head = WAND[: WAND.index("shapes:")]
    wand.write_text(head)
    with pytest.raises(RobotError, match="give 'shapes' or 'mesh', or both"):
        load_robot(f"pr2+{wand}")
    wand.write_text(head + "mesh: {file: none.stl}\n")
    with pytest.raises(RobotError, match=r"field 'mesh': mesh '.*none\.stl'") as caught:
        load_robot(f"pr2+{wand}")
    assert "\n" not in str(caught.value)
    solid = trimesh.creation.box((0.1, 0.1, 0.1))
    solid.update_faces(np.arange(len(solid.faces)) != 3)
    solid.export(tmp_path / "open.stl")
    wand.write_text(head + "mesh: {file: open.stl}\n")
    with pytest.raises(RobotError, match=r"open\.stl' is not closed: 3 of its edges") as caught:
        load_robot(f"pr2+{wand}")
    assert "\n" not in str(caught.value)

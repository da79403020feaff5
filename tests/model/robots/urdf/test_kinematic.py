"""The reduced URDF: silent in Drake, and with the kinematics of the original."""

import logging
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from pydrake.multibody.parsing import PackageMap, Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint
from scipy.spatial.transform import Rotation

from tcs.model.robots import kinematic_urdf, robot_urdf
from tcs.model.robots.robot_file import ExtraFrame
from tcs.model.robots.urdf.pose import pose_in_root
from tcs_shapes.self_collision import sample_positions


def parsed(text, robot):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(text, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(robot.root_body))
    plant.Finalize()
    return plant


def pose(plant, frame, positions):
    context = plant.CreateDefaultContext()
    for name, value in positions.items():
        if not plant.HasJointNamed(name):
            continue
        joint = plant.GetJointByName(name)
        turns = isinstance(joint, RevoluteJoint)
        (joint.set_angle if turns else joint.set_translation)(context, value)
    return plant.GetFrameByName(frame).CalcPoseInWorld(context).GetAsMatrix4()


@pytest.mark.parametrize("meshes", [False, True])
def test_drake_prints_no_warning(pr2, meshes, capfd, caplog, tmp_path, monkeypatch):
    monkeypatch.setenv("TCS_CACHE_DIR", str(tmp_path))
    with caplog.at_level(logging.DEBUG):
        parsed(kinematic_urdf(pr2.urdf, meshes), pr2)
    assert [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING] == []
    # Drake's own log goes to stderr when nothing redirects it to Python.
    assert "warning" not in capfd.readouterr().err.lower()


def test_drake_warns_about_the_original(pr2):
    # Validates the test above: without warnings for the original it would prove nothing.
    root = ElementTree.parse(pr2.urdf_path()).getroot()
    assert len(root.findall("transmission")) > 0
    kept = ElementTree.fromstring(kinematic_urdf(pr2.urdf))
    assert {child.tag for child in kept} == {"link", "joint"}
    assert {child.tag for joint in kept.findall("joint") for child in joint} == {
        "origin",
        "parent",
        "child",
        "axis",
        "limit",
    }


def original_pose(path, frame, positions):
    """Chain the joints of the URDF as its specification says, straight from the XML."""
    root = ElementTree.parse(path).getroot()
    above = {joint.find("child").get("link"): joint for joint in root.findall("joint")}
    X = np.eye(4)
    while frame in above:
        joint = above[frame]
        origin = joint.find("origin")
        step = np.eye(4)
        if origin is not None:
            rpy = [float(word) for word in origin.get("rpy", "0 0 0").split()]
            step[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
            step[:3, 3] = [float(word) for word in origin.get("xyz", "0 0 0").split()]
        if joint.get("type") != "fixed":
            axis = np.array([float(word) for word in joint.find("axis").get("xyz").split()])
            move = np.eye(4)
            q = positions[joint.get("name")]
            if joint.get("type") == "prismatic":
                move[:3, 3] = axis * q
            else:
                move[:3, :3] = Rotation.from_rotvec(axis * q).as_matrix()
            step = step @ move
        X = step @ X
        frame = joint.find("parent").get("link")
    return X


@pytest.mark.parametrize("frame", ["l_gripper_tool_frame", "r_gripper_r_finger_tip_link"])
def test_kinematics_are_those_of_the_original(pr2, frame):
    plant = parsed(kinematic_urdf(pr2.urdf), pr2)
    for positions in sample_positions(pr2, 20, seed=5):
        expected = original_pose(pr2.urdf_path(), frame, positions)
        # A metre of arm in double precision: some 1e-15; 1e-12 allows for other builds.
        np.testing.assert_allclose(pose(plant, frame, positions), expected, atol=1e-12)
        R, p = pose_in_root(pr2.model(), frame, positions)
        np.testing.assert_allclose(R, expected[:3, :3], atol=1e-12)
        np.testing.assert_allclose(p, expected[:3, 3], atol=1e-12)


def test_drake_parses_the_original_with_the_same_result(pr2, caplog):
    """Comparison with Drake's own parser on the file as installed."""
    plant = MultibodyPlant(0.0)
    parser = Parser(plant)
    packages = PackageMap()
    folder = next(f for f in pr2.urdf_path().parents if f.name == "example-robot-data")
    packages.Add("example-robot-data", str(folder))
    parser.package_map().AddMap(packages)
    (instance,) = parser.AddModels(str(pr2.urdf_path()))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(pr2.root_body, instance))
    plant.Finalize()
    ours = parsed(kinematic_urdf(pr2.urdf), pr2)
    for positions in sample_positions(pr2, 5, seed=6):
        np.testing.assert_allclose(
            pose(plant, pr2.tool_frame, positions),
            pose(ours, pr2.tool_frame, positions),
            atol=1e-12,  # as above
        )


def test_extra_frames_and_bodies_become_links(pr2):
    tip = ExtraFrame(
        name="tip", parent="l_gripper_tool_frame", xyz=(0.1, 0.0, 0.0), rpy_deg=(0.0, 0.0, 90.0)
    )
    robot = pr2.model_copy(update={"frames": (tip,)})
    plant = parsed(robot_urdf(robot), robot)
    zero = dict.fromkeys(robot.arm_joints, 0.0)
    step = np.linalg.inv(pose(plant, "l_gripper_tool_frame", zero)) @ pose(plant, "tip", zero)
    expected = [[0, -1, 0, 0.1], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    np.testing.assert_allclose(step, expected, atol=1e-12)  # as above

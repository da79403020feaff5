"""The suite for robots that ship: a new robot file in `models/robots` runs through every test.

The IK round trip and the remaining checks of `check_up` are in tests/shapes/test_checkup.py,
the proof that primitives enclose the meshes in fitting/test_enclosure.py, and a scored task in
tests/placement/scoring/test_robots.py; all of them run over every robot as well.
"""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RevoluteJoint

from tcs.model.robots import load_robot, robot_names, robot_urdf
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.urdf.pose import pose_in_root
from tcs_shapes.self_collision import SelfCollision, sample_positions
from tests.chosen import some_of

DOCS = Path(__file__).parents[3] / "docs" / "robots.md"
LICENCE = re.compile(r"BSD|Apache-2\.0|MIT|CC BY")


@pytest.fixture(scope="module", params=robot_names())
def robot(request):
    return load_robot(request.param)


@pytest.fixture(scope="module")
def model(robot):
    """The URDF with the frames and bodies of the robot file."""
    return model_with_extras(robot)


def test_the_rest_posture_is_named_and_within_the_limits(robot):
    assert robot.rest
    limits = robot.joint_limits()
    for name, angle in zip(robot.arm_joints, robot.arm_rest(), strict=True):
        assert limits[name][0] <= angle <= limits[name][1]
        assert angle == pytest.approx(robot.rest.get(name, angle), abs=1e-9)


def test_the_name_is_that_of_the_file(robot):
    assert load_robot(robot.name) == robot
    assert hash(load_robot(robot.name)) == hash(robot)


def test_limits_leave_every_joint_a_range(robot):
    joints, in_force = robot.model().joints, robot.joint_limits()
    whole = robot.without_ranges.joint_limits()
    for name, (lower, upper) in in_force.items():
        joint = joints[name]
        assert whole[name] == (joint.soft if robot.limits == "soft" else joint.hard)
        assert whole[name][0] <= lower
        assert upper <= whole[name][1]
        assert joint.hard[0] <= joint.soft[0] <= joint.soft[1] <= joint.hard[1]
        assert np.isinf(upper - lower) == (joint.type == "continuous"), name
    for name in (*robot.arm_joints, *filter(None, [robot.torso_joint])):
        assert in_force[name][0] < in_force[name][1]


def test_postures_and_openings_are_within_limits(robot):
    # The URDF of the PR2 limits its mimic joints to the wrong side of 0.
    free = {name for name, joint in robot.model().joints.items() if joint.mimic is None}
    limits = {name: pair for name, pair in robot.joint_limits().items() if name in free}
    for posture in robot.postures:
        for gripper in robot.grippers or (None,):
            chosen = robot.with_choices(posture=posture, gripper=gripper)
            positions = chosen.joint_positions()
            for name in limits.keys() & positions.keys():
                # The figures of a file are rounded to a microradian.
                lower, upper = limits[name]
                assert lower - 1e-6 <= positions[name] <= upper + 1e-6, (posture, name)


def test_kinematics_agree_with_drake(robot, model):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(robot_urdf(robot), "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(robot.root_body))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for positions in sample_positions(robot, 10, seed=1):
        for name, value in positions.items():
            joint = plant.GetJointByName(name)
            revolute = isinstance(joint, RevoluteJoint)
            (joint.set_angle if revolute else joint.set_translation)(context, value)
        X_BT = plant.GetFrameByName(robot.tool_frame).CalcPoseInWorld(context)
        R, p = pose_in_root(model, robot.tool_frame, positions)
        # Rounding of a chain of two metres: some 1e-15.
        np.testing.assert_allclose(R, X_BT.rotation().matrix(), atol=1e-12)
        np.testing.assert_allclose(p, X_BT.translation(), atol=1e-12)


@pytest.mark.parametrize(
    "robot", some_of(robot_names(), "tiago", "ur5", "stretch", "fr3", "gen3"), indirect=True
)
def test_rest_is_free_of_self_collision_at_every_torso_height(robot, model):
    moved, hand = (model.links_moved_by(robot.arm_joints[i]) for i in (0, -1))
    disabled = {frozenset(pair) for pair in robot.disabled_pairs}
    torso = robot.torso_joint
    heights = [{}] if torso is None else [{torso: z} for z in robot.joint_limits()[torso]]
    judge = SelfCollision(robot)
    for (name, posture), height in itertools.product(robot.rest_postures().items(), heights):
        given = dict(zip(robot.arm_joints, posture, strict=True))
        rest = robot.with_mimics({**robot.joint_positions(), **given, **height})
        touching = {
            pair
            for pair in judge.touching(rest)
            if moved & set(pair) and not set(pair) <= hand and frozenset(pair) not in disabled
        }
        assert touching == set(), (name, height)


def test_the_x_axis_of_the_tool_points_out_of_the_hand(robot, model):
    """Goals have x forward: from the last joint the tool lies straight ahead."""
    last = model.joints[robot.arm_joints[-1]].child
    R_T, p_T = pose_in_root(model, robot.tool_frame, {})
    R_L, p_L = pose_in_root(model, last, {})
    ahead = R_T.T @ (p_T - p_L)
    # A bare flange is where the last joint is.
    assert ahead[0] >= -1e-9
    # TIAGo's URDF gives its angles in 11 digits.
    np.testing.assert_allclose(ahead[1:], 0, atol=1e-9)
    axis = R_T.T @ R_L @ model.joints[robot.arm_joints[-1]].axis
    np.testing.assert_allclose(np.abs(axis), [1, 0, 0], atol=1e-9)


def test_the_licence_of_its_model_is_noted(robot):
    assert LICENCE.search(robot.source), robot.source


def test_the_docs_list_it(robot):
    assert f"\n| `{robot.name}` |" in DOCS.read_text(encoding="utf-8")

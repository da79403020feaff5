from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import TcsError, UnknownNameError
from tcs.model.robots import load_robot
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec
from tcs.teleop import load_arm
from tcs.teleop.arm import DEFAULT_VELOCITY, Arm

ROBOTS = ("iiwa7", "pr2", "tiago", "panda", "pr2_right")


@pytest.mark.parametrize("lift", [0.0, 0.2])
@pytest.mark.parametrize("name", ROBOTS)
def test_tool_and_jacobian_are_those_of_drake(name, lift, rng):
    arm = load_arm(name, torso_height=lift)
    scene = Scene(SceneSpec(load_robot(name), EMPTY_ENVIRONMENT))
    assert scene.set_torso(lift) == arm.torso_height
    for joints in arm.random_joints(rng, 20):
        scene.set_arm(joints)
        X_BT, ours = scene.tool_pose(), arm.kinematics(joints)
        # Rounding of eight products of matrices of size 1 m; the largest seen is 7e-16.
        np.testing.assert_allclose(ours.R, X_BT.rotation().matrix(), atol=1e-13)
        np.testing.assert_allclose(ours.p, X_BT.translation(), atol=1e-13)
        np.testing.assert_allclose(ours.jacobian, scene.tool_jacobian(), atol=1e-13)


@pytest.mark.parametrize("name", ["iiwa7", "tiago"])
def test_jacobian_is_the_derivative_of_the_tool_pose(name, rng):
    arm, step = load_arm(name), 1e-6
    for joints in arm.random_joints(rng, 5):
        now = arm.kinematics(joints)
        for i, unit in enumerate(np.eye(7)):
            after, before = (arm.kinematics(joints + s * step * unit) for s in (1, -1))
            linear = (after.p - before.p) / (2 * step)
            turn = (after.R - before.R) @ now.R.T / (2 * step)
            angular = [turn[2, 1], turn[0, 2], turn[1, 0]]
            # Rounding over the step, 1e-16 / 1e-6, and a third derivative times its square.
            np.testing.assert_allclose(now.jacobian[:3, i], angular, atol=1e-9)
            np.testing.assert_allclose(now.jacobian[3:, i], linear, atol=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_limits_are_those_of_the_robot_file(name):
    arm, robot = load_arm(name), load_robot(name)
    limits = [robot.joint_limits()[joint] for joint in robot.arm_joints]
    np.testing.assert_array_equal(np.column_stack([arm.lower, arm.upper]), limits)
    assert arm.joints == robot.arm_joints


def test_soft_limits_of_the_pr2_are_narrower_than_its_hard_ones(pr2):
    soft, hard = load_arm(pr2), load_arm(pr2.with_choices(limits="hard"))
    assert (soft.lower >= hard.lower).all()
    assert (soft.upper <= hard.upper).all()
    assert soft.upper[3] < hard.upper[3]


def test_velocity_limits_are_those_of_the_urdf():
    # KUKA's data sheet gives whole degrees a second: 98, 98, 100, 130, 140, 180, 180.
    degrees = np.degrees(load_arm("iiwa7").velocity)
    np.testing.assert_allclose(degrees, [98, 98, 100, 130, 140, 180, 180], atol=1e-5)


def test_a_joint_without_a_velocity_limit_moves_slowly(tmp_path):
    robot = load_robot("iiwa7")
    text = robot.urdf_path().read_text(encoding="utf-8")
    (tmp_path / "slow.urdf").write_text(text.replace('velocity="1.745329252"', ""))
    file = tmp_path / "slow.yaml"
    file.write_text(f"based_on: iiwa7\nurdf: {tmp_path / 'slow.urdf'}\n")
    assert load_arm(file).velocity[2] == DEFAULT_VELOCITY


def test_arrays_cannot_be_written_to():
    arm = load_arm("iiwa7")
    for array in (arm.lower, arm.upper, arm.velocity, arm.frames):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


@pytest.mark.parametrize(
    "joints",
    [
        *([0.0] * 6, [0.0] * 8, [0.0] * 6 + [np.nan], [0.0] * 6 + [np.inf]),
        *("seven", None, [[0.0] * 7], [10**400] * 7),
    ],
    ids=["six", "eight", "nan", "inf", "text", "nothing", "nested", "enormous"],
)
def test_joints_that_are_not_seven_numbers_are_refused(joints):
    with pytest.raises(TcsError, match="must be 7 finite numbers"):
        load_arm("iiwa7").checked(joints)


def test_the_joint_beyond_its_limits_is_named():
    arm = load_arm("iiwa7")
    assert arm.limit_violation(np.zeros(7)) == ""
    assert arm.limit_violation(arm.upper) == ""
    said = arm.limit_violation(np.array([0.0, 0, 0, -2.2, 0, 0, 0]))
    assert said.startswith("joint 4 ('iiwa_joint_4') is at -2.2000 rad, outside its limits -2.09")


def test_random_joints_keep_within_the_limits(rng):
    arm = load_arm("pr2")
    drawn = arm.random_joints(rng, 1000)
    assert all(arm.limit_violation(joints) == "" for joints in drawn)
    assert np.abs(drawn[:, ~arm.bounded]).max() <= np.pi


def test_an_unknown_robot_is_named():
    with pytest.raises(UnknownNameError, match="iiwa7"):
        load_arm("iwa7")


def test_an_arm_has_its_robot():
    arm = load_arm("iiwa7")
    assert isinstance(arm, Arm)
    assert arm.name == "iiwa7"


@pytest.mark.parametrize("lift", [np.nan, np.inf])
def test_a_torso_height_that_is_not_finite_is_refused(lift):
    with pytest.raises(TcsError, match="torso height: must be a finite number"):
        load_arm("tiago", torso_height=lift)

"""Robot files: content of that of the PR2, and errors of invalid ones."""

import dataclasses
import math
import pickle
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from tcs.errors import RobotError, UnknownNameError
from tcs.files.paths import data_folder
from tcs.model.robots import load_robot
from tcs.model.robots.robot_file import DisabledGroup

FOLDER = data_folder() / "models" / "robots"


@pytest.fixture
def content():
    return yaml.safe_load((FOLDER / "pr2.yaml").read_text())


def write(folder: Path, content) -> Path:
    shutil.copy(FOLDER / "pr2_primitives.csv", folder)
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def test_copy_elsewhere_is_the_same_robot(content, tmp_path, pr2):
    copy = load_robot(write(tmp_path, content))
    assert copy.primitives != pr2.primitives
    assert copy.model_copy(update={"primitives": pr2.primitives}) == pr2
    assert copy.load_primitives() == pr2.load_primitives()


def test_value_semantics(pr2):
    again = load_robot("pr2")
    assert again == pr2
    assert hash(again) == hash(pr2)
    assert pickle.loads(pickle.dumps(pr2)) == pr2
    assert pr2.with_choices(gripper="closed") != pr2


def test_soft_limits_come_from_the_urdf(pr2):
    # The safety_controller elements of the PR2's URDF.
    limits = pr2.joint_limits()
    assert limits["l_shoulder_lift_joint"] == (-0.3536, 1.2963)
    assert limits["l_elbow_flex_joint"] == (-2.1213, -0.15)
    assert limits["torso_lift_joint"] == (0.0115, 0.305)
    assert limits["l_wrist_roll_joint"] == (-np.inf, np.inf)


def test_hard_limits_on_request(pr2):
    limits = pr2.with_choices(limits="hard").joint_limits()
    assert limits["l_elbow_flex_joint"] == (-2.3213, 0.0)
    assert limits["torso_lift_joint"] == (0.0, 0.31)


def test_positions_include_all_joints_except_arm_and_torso(pr2):
    positions = pr2.joint_positions()
    movable = {joint.name for joint in pr2.model().joints.values() if joint.is_movable}
    assert set(positions) == movable - {*pr2.arm_joints, pr2.torso_joint}


def test_fingers_mimic_the_opening(pr2):
    positions = pr2.joint_positions()
    assert positions["l_gripper_l_finger_joint"] == 0.54
    assert positions["l_gripper_r_finger_tip_joint"] == 0.54
    # The URDF gives this one the multiplier -1.
    assert positions["l_gripper_r_parallel_root_joint"] == -0.54
    assert pr2.with_choices(gripper="closed").joint_positions()["l_gripper_r_finger_joint"] == 0.0


def test_other_arm_follows_the_posture(pr2):
    assert pr2.joint_positions()["r_elbow_flex_joint"] == pytest.approx(np.radians(-120), abs=1e-6)
    straight = pr2.with_choices(posture="paper2015").joint_positions()
    assert straight["r_elbow_flex_joint"] == -0.15


def test_joints_left_out_stay_within_limits(pr2):
    bare = pr2.model_copy(update={"posture": None})
    # Zero is beyond the elbow's soft limit.
    assert bare.joint_positions()["r_elbow_flex_joint"] == -0.15


def test_groups_found_under_soft_limits_do_not_hold_under_hard_ones(pr2):
    soft = set(pr2.disabled_pairs)
    hard = set(pr2.with_choices(limits="hard").disabled_pairs)
    assert soft - hard == {("l_elbow_flex_link", "l_shoulder_pan_link")}
    assert hard < soft


def test_ranges_of_groups_in_force_narrow_the_limits(pr2):
    elbow = "l_elbow_flex_joint"
    soft = pr2.joint_limits()[elbow]
    groups = [
        DisabledGroup(reason="below, they meet", ranges={elbow: (-2.0, 9.0)}, pairs=()),
        DisabledGroup(
            reason="soft ones alone", limits="soft", ranges={elbow: (-9.0, -1.0)}, pairs=()
        ),
    ]
    robot = pr2.model_copy(update={"disabled_groups": tuple(groups)})
    assert robot.joint_limits()[elbow] == (-2.0, -1.0)
    assert robot.with_choices(limits="hard").joint_limits()[elbow] == (-2.0, 0.0)
    assert robot.without_ranges.joint_limits()[elbow] == soft


def test_messages_name_the_file_as_it_was_given(content, tmp_path, monkeypatch):
    write(tmp_path, content | {"tool_frame": "nowhere"})
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UnknownNameError, match=r"^robot file 'mine\.yaml', field 'tool_frame': "):
        load_robot("mine.yaml")


def test_choices_that_do_not_exist_are_one_line(pr2):
    with pytest.raises(UnknownNameError, match=r"^robot 'pr2', field 'gripper': unknown gripper"):
        pr2.with_choices(gripper="ajar")
    with pytest.raises(RobotError, match=r"^robot 'pr2', field 'limits' is 'none', but must be"):
        pr2.with_choices(limits="none")


def test_the_home_folder_of_an_unknown_user_is_one_line(content, tmp_path):
    path = write(tmp_path, content | {"primitives": "~nouser/shapes.csv"})
    with pytest.raises(
        RobotError, match=r"mine\.yaml', field 'primitives' '~nouser/shapes\.csv': "
    ):
        load_robot(path)


def test_an_unknown_name_is_reported_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'pr2'"):
        load_robot("pr3")


def change(field, value):
    return lambda content: content.update({field: value})


def put(field, name, value):
    return lambda content: content[field].update({name: value})


def narrowed(joint, lower, upper):
    return [{"reason": "because I say so", "pairs": [], "ranges": {joint: [lower, upper]}}]


WRONG = {
    "unknown tool frame": (
        change("tool_frame", "l_gripper_tool_fram"),
        "field 'tool_frame': unknown .*'l_gripper_tool_fram'.*Did you mean 'l_gripper_tool_frame'",
    ),
    "unknown key": (change("tol_frame", "x"), "unknown key 'tol_frame'.*Did you mean 'tool_frame'"),
    "missing key": (lambda content: content.pop("urdf"), "field 'urdf' is missing"),
    "unknown arm joint": (
        lambda content: content["arm_joints"].__setitem__(3, "l_elbow_flx_joint"),
        "field 'arm_joints': unknown joint.*Did you mean 'l_elbow_flex_joint'",
    ),
    "five arm joints": (
        lambda content: content.update(arm_joints=content["arm_joints"][:4]),
        r"field 'arm_joints' is .*, but must have at least 5 items",
    ),
    "wrong order": (
        lambda content: content["arm_joints"].reverse(),
        "field 'arm_joints': from 'torso_lift_link' to 'l_gripper_tool_frame' the URDF has l_sh",
    ),
    "tool of the other arm": (
        change("tool_frame", "r_gripper_tool_frame"),
        "field 'arm_joints': from",
    ),
    "root that is carried": (
        change("root_body", "base_link"),
        "must be the root link.*base_footprint",
    ),
    "torso that turns": (change("torso_joint", "head_pan_joint"), "must be prismatic"),
    "posture beyond its limits": (
        put("postures", "wild", {"r_elbow_flex_joint": 0.3}),
        r"field 'postures.wild': 'r_elbow_flex_joint' is 0.3, but must be in \[-2.3213, 0\]",
    ),
    "posture of an unknown joint": (
        put("postures", "wild", {"r_elbow": 0.0}),
        "field 'postures.wild': unknown joint 'r_elbow'",
    ),
    "posture of the scored arm": (
        put("postures", "wild", {"l_elbow_flex_joint": -1.0}),
        "'l_elbow_flex_joint' is scored \\(arm or torso\\)",
    ),
    "posture of a fixed joint": (
        put("postures", "wild", {"base_laser_joint": 0.0}),
        "'base_laser_joint' is fixed",
    ),
    "posture that is no number": (
        put("postures", "wild", {"r_elbow_flex_joint": "bent"}),
        r"field 'postures\.wild\.r_elbow_flex_joint' is 'bent', but must be a valid number",
    ),
    "velocity limit of another joint": (
        change("velocity_limits", {"r_elbow_flex_joint": 1.0}),
        "field 'velocity_limits': unknown joint of the arm 'r_elbow_flex_joint'",
    ),
    "rest of another joint": (
        change("rest", {"r_elbow_flex_joint": -1.0}),
        "field 'rest': unknown joint of the arm 'r_elbow_flex_joint'.*Did you mean 'l_elbow_flex",
    ),
    "rest beyond its limits": (
        change("rest", {"l_elbow_flex_joint": 0.3}),
        r"field 'rest': 'l_elbow_flex_joint' is 0.3, but must be in \[-2.3213, 0\]",
    ),
    "unknown posture": (
        change("posture", "tuckd"),
        "mine\\.yaml', field 'posture': unknown posture 'tuckd'.*Did you mean",
    ),
    "unknown gripper": (change("gripper", "ajar"), "field 'gripper': unknown gripper 'ajar'"),
    "limits of another type": (
        change("limits", "none"),
        "field 'limits' is 'none', but must be 'soft' or 'hard'",
    ),
    "URDF not there": (
        change("urdf", "nowhere.urdf"),
        "mine\\.yaml', field 'urdf': .*there is no file",
    ),
    "package not there": (
        change("urdf", "package://no_such_robot/a.urdf"),
        "'no_such_robot' is neither installed, nor in ROS_PACKAGE_PATH",
    ),
    "primitives not there": (
        change("primitives", "nowhere.csv"),
        "mine\\.yaml', field 'primitives': .*cannot be read",
    ),
    "disabled pair of an unknown body": (
        change(
            "disabled_groups", [{"reason": "because I say so", "pairs": [["l_arm", "base_link"]]}]
        ),
        "field 'disabled_groups': unknown link or frame 'l_arm'",
    ),
    "disabled pair without reason": (
        change("disabled_groups", [{"pairs": [["base_link", "torso_lift_link"]]}]),
        r"field 'disabled_groups\[0\]\.reason' is missing",
    ),
    "range of an unknown joint": (
        change("disabled_groups", narrowed("l_elbow_joint", -2.0, -1.0)),
        r"field 'disabled_groups\[0\]\.ranges': unknown joint of the arm 'l_elbow_joint'",
    ),
    "range upside down": (
        change("disabled_groups", narrowed("l_elbow_flex_joint", -1.0, -2.0)),
        r"disabled_groups\[0\].*'l_elbow_flex_joint' must be \[lower, upper\]",
    ),
    "range beyond the limits": (
        change("disabled_groups", narrowed("l_elbow_flex_joint", 1.0, 2.0)),
        r"'l_elbow_flex_joint' has \[1, 2\], which must overlap its limits \[-2\.3213, 0\]",
    ),
    "extra frame with a taken name": (
        change("frames", [{"name": "base_link", "parent": "base_footprint"}]),
        "the name is taken",
    ),
    "extra frame on itself": (
        change("frames", [{"name": "tip", "parent": "tip"}]),
        "'tip': its parents lead back to itself",
    ),
    "extra frame on an unknown parent": (
        change("frames", [{"name": "tip", "parent": "l_palm"}]),
        "parent: unknown link or frame 'l_palm'",
    ),
}


@pytest.mark.parametrize("case", WRONG, ids=lambda case: case.replace(" ", "-"))
def test_wrong_files_get_one_clear_line(case, content, tmp_path):
    spoil, message = WRONG[case]
    spoil(content)
    with pytest.raises((RobotError, UnknownNameError)) as caught:
        load_robot(write(tmp_path, content))
    assert re.search(message, str(caught.value))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["- a\n- b\n", "a: [", "", "\tx"])
def test_a_file_that_is_not_a_robot_file_is_refused(text, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(RobotError, match=r"mine\.yaml"):
        load_robot(path)


def test_a_key_that_comes_twice_is_refused(content, tmp_path):
    path = write(tmp_path, content)
    path.write_text(path.read_text() + "title: another\n")
    with pytest.raises(
        RobotError, match=r"mine\.yaml' is not valid YAML: line .*'title' appears tw"
    ):
        load_robot(path)


def test_held_tool_brings_its_own_frame_and_shapes(content, tmp_path):
    content["bodies"] = [
        {
            "name": "razor",
            "parent": "l_gripper_tool_frame",
            "xyz": [0.05, 0.0, 0.0],
            "primitives": [{"kind": "capsule", "size": [0.01, 0.1], "rpy_deg": [0, 90, 0]}],
        }
    ]
    content["frames"] = [{"name": "blade", "parent": "razor", "xyz": [0.06, 0.0, 0.0]}]
    content["tool_frame"] = "blade"
    robot = load_robot(write(tmp_path, content))
    razor = robot.load_primitives()[-1]
    assert razor.body == "razor"
    # Turned by 90 degrees about y, the capsule's z axis lies along x.
    np.testing.assert_allclose(razor.rotation[:, 2], [1, 0, 0], atol=1e-15)


@pytest.mark.parametrize("field", ["frames", "bodies"])
def test_an_added_body_named_world_is_refused(content, tmp_path, field):
    """Drake has a body of that name; before, building the scene ended in a traceback."""
    shapes = {"primitives": [{"kind": "sphere", "size": [0.1]}]} if field == "bodies" else {}
    content.setdefault(field, []).append({"name": "world", "parent": "base_link", **shapes})
    with pytest.raises(RobotError, match="frame or body 'world': the name is taken"):
        load_robot(write(tmp_path, content))


@pytest.mark.parametrize("size", [1e15, 1e308, 1000.0, 1e-9, 0.0, -1.0])
def test_a_size_that_no_tool_has_is_refused(content, tmp_path, size):
    shapes = [{"kind": "sphere", "size": [size]}]
    content.setdefault("bodies", []).append(
        {"name": "tool", "parent": "base_link", "primitives": shapes}
    )
    with pytest.raises(RobotError, match=r"primitives\[0\].size\[0\]' is .* m, but a size must be"):
        load_robot(write(tmp_path, content))


def test_rates_of_the_arm_come_from_file_urdf_or_default(pr2):
    velocity, acceleration = pr2.arm_rates()
    assert velocity[0] == pytest.approx(2.088)
    assert acceleration == [2.0] * 7
    own = {"l_shoulder_pan_joint": 0.5}
    slow = pr2.model_copy(update={"velocity_limits": own, "acceleration_limits": own})
    assert [rates[0] for rates in slow.arm_rates()] == [0.5, 0.5]
    smooth = pr2.model_copy(update={"jerk_limits": own})
    assert (smooth.arm_jerks()[:2], pr2.arm_jerks()) == ([0.5, np.inf], [np.inf] * 7)


def test_a_missing_velocity_limit_is_asked_for(pr2, monkeypatch):
    model = pr2.model()
    joint = model.joints["l_elbow_flex_joint"]
    joints = {**model.joints, joint.name: dataclasses.replace(joint, velocity=math.inf)}
    unlimited = dataclasses.replace(model, joints=joints)
    monkeypatch.setattr(type(pr2), "model", lambda _: unlimited)
    with pytest.raises(
        RobotError, match=r"no velocity limit of 'l_elbow_flex_joint'.*velocity_limits"
    ):
        pr2.arm_rates()


def test_the_rest_posture_is_within_the_limits(pr2):
    rest = dict(zip(pr2.arm_joints, pr2.arm_rest(), strict=True))
    assert rest["l_shoulder_pan_joint"] == pytest.approx(np.pi / 2, abs=1e-6)
    assert rest["l_wrist_flex_joint"] == pytest.approx(-0.1)

"""Arms with prismatic and coupled joints that drive: the kernel's chain against Drake."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from tcs.errors import RobotError, UnknownNameError
from tcs.files.paths import data_folder
from tcs.model.robots import load_robot
from tcs.model.scene import Scene, SceneSpec, arm_chain, load_environment
from tcs.model.scene.contacts import Group
from tcs.output.report.score.scene_solids import base_outline
from tcs.placement.scoring import score, verify
from tests.environments import write_environment
from tests.reference.kinematics import coupled_pose, jacobian, link_poses

SEGMENTS = ("link_arm_l3", "link_arm_l2", "link_arm_l1", "link_arm_l0")


@pytest.fixture(scope="module")
def scene():
    return Scene(SceneSpec(load_robot("stretch"), load_environment("wheelchair")))


@pytest.fixture(scope="module")
def chain(scene):
    scene.set_arm(np.zeros(6))
    return arm_chain(scene)[0]


def drawn(scene, rng):
    return np.append(0.0, rng.uniform(*scene.arm_limits))


def test_links_between_coupled_joints_are_where_drake_has_them(scene, chain, rng):
    built, state = scene.built, scene.plant_context
    bodies = [built.plant.GetBodyByName(name) for name in SEGMENTS]

    def poses():
        return [b.body_frame().CalcPose(state, built.arm_base_frame) for b in bodies]

    scene.set_arm(np.zeros(6))
    tip = link_poses(chain, np.zeros(7))[3]
    # Each segment keeps its pose in the frame that carries it.
    offsets = [(tip[0].T @ (X.translation() - tip[1])) for X in poses()]
    for _ in range(5):
        q = drawn(scene, rng)
        scene.set_arm(q[1:])
        links = link_poses(chain, q)
        for X, offset, frame in zip(poses(), offsets, (8, 9, 10, 4), strict=True):
            R, p = coupled_pose(chain, q, links, frame)
            np.testing.assert_allclose(p + R @ offset, X.translation(), atol=1e-12)


def test_tool_pose_and_jacobian_are_those_of_drake(scene, chain, rng):
    for _ in range(5):
        q = drawn(scene, rng)
        scene.set_arm(q)
        X = scene.built.tool_frame.CalcPose(scene.plant_context, scene.built.arm_base_frame)
        R, p = link_poses(chain, q)[-1]
        np.testing.assert_allclose(R, X.rotation().matrix(), atol=1e-12)
        np.testing.assert_allclose(p, X.translation(), atol=1e-12)
        np.testing.assert_allclose(jacobian(chain, q), scene.tool_jacobian(), atol=1e-12)


def test_the_base_drives_with_the_arm_and_stands_on_the_floor(scene):
    parts = {part.name: part for part in scene.built.parts}
    assert parts["base_link"].group is Group.ARM
    assert not [part for part in scene.built.parts if part.group is Group.BODY]
    floor = parts["floor"]
    rule = scene.built.rule
    assert not rule.is_checked(parts["base_link"], floor)
    assert rule.is_checked(parts["link_arm_l0"], floor)
    outline = base_outline(scene)
    assert 0.3 < np.ptp(outline[:, 0]) < 0.4


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"coupled": {"joint_arm_l3": "joint_wrist_yaw"}}, "only prismatic joints"),
        ({"coupled": {"joint_lift": "joint_arm_l0"}}, "'joint_lift' is a joint of the arm itself"),
        ({"coupled": {"joint_arm_l9": "joint_arm_l0"}}, "joint_arm_l9"),
        ({"coupled": {}}, "the URDF has drive, joint_lift, joint_arm_l3"),
        ({"mount": {"link": "planned_base", "drive": [0.1, 0.3]}}, "back <= 0 <= forth"),
    ],
)
def test_bad_couplings_are_refused_in_one_line(tmp_path, change, message):
    path = data_folder() / "models/robots/stretch.yaml"
    content = yaml.safe_load(path.read_text()) | {"disabled_groups": []} | change
    content["primitives"] = str(path.with_name("stretch_primitives.csv"))
    copy = tmp_path / "stretch.yaml"
    copy.write_text(yaml.safe_dump(content))
    with pytest.raises((RobotError, UnknownNameError)) as caught:
        load_robot(copy)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.slow  # it compiles the sweep of arms of six joints
def test_drake_confirms_what_the_robot_reaches(tmp_path):
    grid = {
        "base_x": (1.0, 0.25, 4),
        "base_y": (-0.7, 0.2, 4),
        "base_yaw": (180, 45, 4),
        "torso": (0.0, 0.0, 1),
    }
    file = score("feeding", write_environment(tmp_path, "stretch-corner", grid), robot="stretch")
    found = verify(file, pairs=200, dense=20)
    assert found.is_sound
    assert found.checked > 10
    assert found.missed == 0

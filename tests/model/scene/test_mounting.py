"""Robots mounted on furniture: where Drake has them, what they may touch, and their scores."""

from __future__ import annotations

import math

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform, RollPitchYaw

from tcs.errors import RobotError, UnknownNameError
from tcs.files.paths import data_folder
from tcs.model.people import draw_bodies, scales_of_people
from tcs.model.robots import load_robot
from tcs.model.scene import (
    PeopleInScene,
    Scene,
    SceneSpec,
    body_frame_positions,
    environment_at,
    goal_poses,
    load_environment,
)
from tcs.model.scene.contacts import Group
from tcs.output.report.score.scene_solids import environment_solids
from tcs.placement.refinement.local_search import Space
from tcs.placement.scoring import load_job, score, verify

RAILS = data_folder() / "examples/wheelchair_rails.yaml"
STATES = (
    {"bed_height": 0.0, "head_rest": 0.2},
    {"bed_height": 0.2, "head_rest": 1.1},
)
ONE = {"count": 1, "step": 0.0, "start": 0.0}


def environment(folder, mount, *, based_on="bed", **changes):
    """Return an environment with a mount and a single configuration."""
    units = {"base_x": "m", "base_y": "m", "base_yaw": "deg", "torso": "m"}
    content = {
        "based_on": based_on,
        "name": "mounted",
        "title": "mounted",
        "mount": mount,
        "grid": {name: ONE | {"unit": unit} for name, unit in units.items()},
        "observed": {},
        **changes,
    }
    path = folder / "mounted.yaml"
    path.write_text(yaml.safe_dump(content))
    return load_environment(path)


@pytest.fixture(scope="module")
def on_head_rest(tmp_path_factory):
    """Jaco on the head rest of the bed, askew."""
    pose = {"xyz": [0.3, 0.6, 0.2], "rpy_deg": [10.0, -20.0, 30.0]}
    mount = {"parent": "bed::head_rest_link", "pose": pose}
    folder = tmp_path_factory.mktemp("bed")
    return load_job("bathing", environment(folder, mount), "jaco")


def test_arrays_are_where_drake_has_them_while_the_furniture_moves(on_head_rest):
    scene = on_head_rest.scene()
    task = on_head_rest.task
    arrays = environment_at(on_head_rest.lowered(scene), scene, task, STATES)
    parts = [part for part in scene.built.parts if part.group is Group.ENVIRONMENT]
    scene.place_base(0.3, -0.2, 0.7)
    X_MB = RigidTransform(RollPitchYaw(0.0, 0.0, 0.7), [0.3, -0.2, 0.0])
    bases = []
    for state, values in enumerate(STATES):
        for name, value in values.items():
            scene.set_joint(name, value)
        bases.append(scene.base_pose())
        X_BW = scene.base_pose().inverse()
        of_drake = [X_BW @ scene.shape_pose(part) for part in parts]
        of_drake += [X_BW @ X for X in goal_poses(scene, task)]
        R = np.concatenate([arrays.environment.R[state], arrays.goal_R[state]])
        p = np.concatenate([arrays.environment.p[state], arrays.goal_p[state]])
        expected = np.array([X.GetAsMatrix34() for X in of_drake])
        np.testing.assert_allclose(X_MB.rotation().inverse() @ R[0], expected[0, :, :3], atol=1e-9)
        moved = X_MB.inverse().GetAsMatrix34()
        np.testing.assert_allclose(moved[:, :3] @ R, expected[..., :3], atol=1e-9)
        np.testing.assert_allclose(p @ moved[:, :3].T + moved[:, 3], expected[..., 3], atol=1e-9)
    # The base went along with the bed.
    assert np.linalg.norm(bases[1].translation() - bases[0].translation()) > 0.2
    assert (bases[0].rotation().inverse() @ bases[1].rotation()).ToAngleAxis().angle() > 0.5


def test_observed_frames_and_maps_are_in_the_frame_of_the_base_poses(on_head_rest):
    scene = on_head_rest.scene()
    X_MW = scene.mount_pose().inverse()
    of_file = body_frame_positions(scene, on_head_rest.scored_grid)["head"]
    expected = X_MW @ scene.body_frame_pose("head").translation()
    np.testing.assert_allclose(of_file, expected, atol=1e-12)
    seen, there = environment_solids(scene, in_mount=True), environment_solids(scene)
    corner = X_MW @ there[5].corners[0]
    np.testing.assert_allclose(seen[5].corners[0], corner, atol=1e-12)


def test_people_of_other_sizes_are_seen_from_the_mount(on_head_rest):
    task = on_head_rest.task
    scene = on_head_rest.scene()
    people = PeopleInScene(on_head_rest.lowered(scene), scene, task, STATES)
    drawn = draw_bodies(1, seed=4)
    (found,) = people.arrays_of(scales_of_people(drawn), np.array([[1]]))
    body = drawn[0]
    person = {"sex": body.sex, **body.measures}
    alone = load_job(task, on_head_rest.spec.environment, "jaco", person=person)
    resized = alone.scene()
    expected = environment_at(alone.lowered(resized), resized, alone.task, STATES)
    # Link orientations in the model files are rounded to seven digits.
    np.testing.assert_allclose(found.environment.p[0], expected.environment.p[1], atol=1e-6)
    np.testing.assert_allclose(found.goal_p[0], expected.goal_p[1], atol=1e-6)


@pytest.mark.parametrize("on_seat", [True, False])
def test_a_mount_tilts_with_the_seat_or_stays_on_the_frame(tmp_path, on_seat):
    mount = {"parent": "wheelchair::base_link", "pose": {"xyz": [0.6, 0.4, 0.6]}}
    chair = environment(
        tmp_path, mount | {"on_seat": on_seat}, based_on="wheelchair", wheelchair={"tilt_deg": 30}
    )
    X = Scene(SceneSpec(load_robot("jaco"), chair)).mount_pose()
    angle = X.rotation().ToAngleAxis().angle()
    assert angle == pytest.approx(math.radians(30.0) if on_seat else 0.0, abs=1e-9)
    assert bool(X.translation()[2] > 0.61) is on_seat


@pytest.mark.parametrize(
    ("robot", "message"),
    [
        ("pr2", "it stands on 'base_link'"),
        ("tiago_pro", "it stands on"),
        ("stretch", "it drives"),
        ("panda", "it stands on 'mobile_base'"),
    ],
)
def test_robots_that_stand_on_the_floor_are_refused(robot, message):
    with pytest.raises(RobotError, match=message) as caught:
        SceneSpec(load_robot(robot), load_environment(RAILS))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("mount", "message"),
    [
        ({"parent": "chair::seat"}, "field 'mount': unknown parent 'chair::seat'"),
        ({"parent": "world", "touches": ["nothing"]}, "unknown environment body 'nothing'"),
    ],
)
def test_unknown_names_are_refused_in_one_line(tmp_path, mount, message):
    spec = SceneSpec(load_robot("jaco"), environment(tmp_path, mount))
    with pytest.raises(UnknownNameError) as caught:
        Scene(spec)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_base_is_checked_against_all_but_what_it_is_bolted_to():
    environment = load_environment(RAILS)
    robot = load_robot("jaco")
    scene = Scene(SceneSpec(robot, environment))
    assert "pedestal" not in {part.name for part in scene.built.parts}
    scene.set_arm(scene.spec.robot.arm_rest())

    def base_contacts():
        return {b for a, b, _ in scene.violations() if a == "j2s6s200_link_base"}

    scene.place_base(0.4, 0.3, 0.0)
    assert "wheelchair::side panel left" not in base_contacts()
    scene.place_base(0.5, 0.0, 0.0)
    assert base_contacts() & {"person::lower_body_link", "wheelchair::seat"}
    # A base that is let into the floor is found out, too.
    sunk = {"parent": "world", "pose": {"xyz": (2.0, 2.0, -0.05)}}
    low = environment.model_validate(environment.model_dump() | {"mount": sunk})
    scene = Scene(SceneSpec(robot, low))
    assert base_contacts() == {"floor"}


def test_refinement_stays_on_the_rails():
    grid = load_job("feeding", RAILS, "jaco").grid
    space = Space.of(grid, fixed=("base_y",))
    assert [axis.name for axis, c in zip(grid.axes, space.cell, strict=True) if c > 0.0] == [
        "base_x",
        "base_yaw",
    ]


@pytest.mark.slow  # it compiles the sweep of arms of six joints
def test_drake_confirms_what_the_arm_on_the_rails_reaches():
    file = score("feeding", RAILS, robot="jaco")
    found = verify(file, pairs=300, dense=20)
    assert found.is_sound
    assert found.checked == 300
    assert found.missed == 0
    assert file.robot_shapes is None

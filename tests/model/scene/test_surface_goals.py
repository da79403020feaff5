"""Goals all over a surface: where they are by Drake, how close, and what is left out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import yaml

from tcs.errors import TaskError, UnknownNameError
from tcs.files.paths import data_folder
from tcs.model.robots import load_robot
from tcs.model.scene import Scene, SceneSpec, goal_poses, load_environment, with_surface_goals
from tcs.model.scene.contacts import Group
from tcs.model.tasks import Surface, load_task
from tcs.placement.scoring import load_job

TASK = data_folder() / "examples/washing_torso.yaml"


def covered(environment="wheelchair", **changes):
    """Return the task with its surface changed, and covered."""
    task = load_task(TASK)
    surface = dataclasses.replace(task.surfaces[0], **changes)
    file = environment if not isinstance(environment, str) else load_environment(environment)
    return with_surface_goals(dataclasses.replace(task, surfaces=(surface,)), file)


@pytest.fixture(scope="module")
def scene():
    return Scene(SceneSpec(load_robot("panda"), load_environment("wheelchair")))


def to_bodies(scene, point):
    """Return Drake's distance of a point from each body, from the padded surface [m]."""
    pads = {part.geometry: part for part in scene.built.parts if part.group is Group.ENVIRONMENT}
    found = {}
    for one in scene.query_object().ComputeSignedDistanceToPoint(point):
        part = pads.get(one.id_G)
        if part is not None:
            found[part.name] = min(one.distance - part.pad, found.get(part.name, np.inf))
    return found


@pytest.mark.parametrize(("normal", "distance"), [("inward", 0.05), ("outward", 0.02)])
def test_goals_are_off_the_skin_and_point_at_it(scene, normal, distance):
    task = covered(spacing=0.06, normal=normal, distance=distance)
    torso = {"person::upper_body_link", "person::mid_body_link", "person::lower_body_link"}
    sign = 1.0 if normal == "inward" else -1.0
    for X_WG in goal_poses(scene, task):
        away = to_bodies(scene, X_WG.translation())
        nearest = min(away[name] for name in torso)
        # Where two shapes meet, the other one may be nearer.
        assert 0.5 * distance - 1e-6 <= nearest <= distance + 1e-6
        assert min(away.values()) >= 0.5 * distance - 1e-6
        # One step of `distance` along x of the tool leads to the padded surface, or away from it.
        ahead = X_WG.translation() + sign * distance * X_WG.rotation().matrix()[:, 0]
        assert min(to_bodies(scene, ahead)[name] for name in torso) == pytest.approx(0.0, abs=1e-6)
    assert len({goal.body_frame for goal in task.goals}) == 3


@pytest.mark.parametrize("spacing", [0.04, 0.1])
def test_goals_are_a_spacing_apart_and_leave_no_place_out(spacing):
    def points(spacing):
        task = covered(body="thigh_left", spacing=spacing, distance=0.0)
        return np.array([goal.position for goal in task.goals])

    goals, everywhere = points(spacing), points(0.0134)
    apart = np.linalg.norm(goals[:, None] - goals, axis=2)
    assert apart[~np.eye(len(goals), dtype=bool)].min() >= spacing - 1e-6
    farthest = np.linalg.norm(everywhere[:, None] - goals, axis=2).min(axis=1).max()
    # The two cover the surface from candidates of their own, a third of the spacing apart.
    assert farthest <= 1.5 * spacing


def test_covered_places_get_no_goals(scene):
    task = covered(body="mid_body", spacing=0.03, distance=0.04)
    backs = [g for g in goal_poses(scene, task) if g.rotation().matrix()[0, 0] > 0.9]
    # The back rest is behind the back; the front is exposed.
    assert not backs
    assert any(g.rotation().matrix()[0, 0] < -0.9 for g in goal_poses(scene, task))


def test_goals_on_a_table_and_on_another_person(tmp_path):
    content = {
        "based_on": "wheelchair",
        "name": "table",
        "title": "table",
        "obstacles": [{"name": "board", "box": [0.4, 0.6, 0.02], "xyz": [1.6, 0, 0.8]}],
        "body_frames": {"board": "board"},
    }
    path = tmp_path / "table.yaml"
    path.write_text(yaml.safe_dump(content))
    file = load_environment(path)
    on_top = covered(file, body="board", spacing=0.1, distance=0.02, facing=(0, 0, 2)).goals
    assert len(on_top) == 5 * 7
    assert {round(float(goal.position[2]), 9) for goal in on_top} == {0.03}
    all_around = covered(file, body="board", spacing=0.1, distance=0.02).goals
    assert len(all_around) == 2 * 5 * 7  # no places are left on its thin edges
    small = load_job(TASK, "wheelchair", "panda", person={"sex": "female", "stature": 1.5})
    tall = load_job(TASK, "wheelchair", "panda", person={"sex": "male", "stature": 1.95})
    assert len(small.task.goals) < len(tall.task.goals)
    assert not small.task.surfaces


def test_weights_are_shared_by_the_goals_of_a_surface():
    task = load_task(TASK)
    both = (task.surfaces[0], dataclasses.replace(task.surfaces[0], body="leg_left", weight=3.0))
    found = with_surface_goals(
        dataclasses.replace(task, surfaces=both), load_environment("wheelchair")
    )
    legs = np.array([goal.body_frame in ("thigh_left", "calf_left") for goal in found.goals])
    assert found.weights[legs].sum() == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"body": "trunk"}, UnknownNameError, "unknown body frame 'trunk'"),
        ({"spacing": 0.008}, TaskError, "at most 1,000 are allowed. Take a spacing of 0.01"),
        ({"body": "head", "distance": 0.3, "spacing": 0.5}, None, ""),
        ({"spacing": 0.001}, TaskError, "'spacing' is 0.001 m, but must be 0.005 to 0.5 m"),
        ({"distance": 4.0}, TaskError, "'distance' is 4 m, but must be 0 to 0.3 m"),
        ({"normal": "up"}, TaskError, "'normal' is 'up', but must be inward or outward"),
        ({"facing": (0, 0, 0)}, TaskError, "'facing' is [0, 0, 0], but must be [x, y, z] with"),
        ({"weight": 0.0}, TaskError, "'weight' is 0, but must be above 0"),
    ],
)
def test_bad_surfaces_are_refused_in_one_line(changes, error, message):
    if error is None:
        assert len(covered(**changes).goals) >= 1
        return
    with pytest.raises(error) as caught:
        covered(**changes)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("surface", "message"),
    [
        ({"body": "torso"}, "surface[0].spacing"),
        ({"body": "torso", "spacing": 0.05, "side": "left"}, "side"),
        ([{"body": "", "spacing": 0.05}], "surface[0]: field 'body' is empty"),
    ],
)
def test_bad_surfaces_in_a_file_name_the_field(tmp_path, surface, message):
    content = yaml.safe_load(TASK.read_text()) | {"surface": surface}
    path = tmp_path / "task.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises((TaskError, UnknownNameError)) as caught:
        load_task(path)
    assert message in str(caught.value)


def test_a_surface_is_a_frozen_value():
    assert Surface(body="chest", spacing=0.1) == Surface(body="chest", spacing=0.1)

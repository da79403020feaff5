"""Labels by the kernel, and learning from them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from tcs.capability import BasePose, Grasp, GraspPosition, GraspTask, Surroundings
from tcs.capability.arplace import TableTask, learn
from tcs.capability.arplace.labels import base_radius, label, table_scene
from tcs.errors import GridError, SelectionError, UnknownNameError
from tcs.model.grid import Axis
from tcs.model.scene import lower

SMALL = TableTask(
    distance=Axis("distance", "m", 0.05, 0.2, 2),
    height=Axis("height", "m", 0.5, 0.25, 2),
    angle=Axis("angle", "deg", -30.0, 60.0, 2),
    approach="side",
    base_x=Axis("base_x", "m", -0.9, 0.15, 5),
    base_y=Axis("base_y", "m", -0.6, 0.3, 5),
)


@pytest.fixture(scope="module")
def labels(tiago):
    return label(tiago, SMALL)


def test_labels_are_those_of_single_scenes(tiago, labels):
    """The heights are states of one scene; each is compared with a scene of its own."""
    parameters = SMALL.parameters
    assert labels.reached.shape == (8, 5, 5)
    assert 0 < labels.reached.sum() < labels.reached.size
    for height in SMALL.height.values:
        one = dataclasses.replace(SMALL, height=Axis("height", "m", float(height), 0.0, 1))
        scene, torso_height = table_scene(tiago, one)
        around = Surroundings(tiago, scene.spec.environment)
        for grasp in np.flatnonzero(parameters[:, 1] == height):
            distance, _, angle = parameters[grasp]
            position = GraspPosition(distance, 0.0, height, (Grasp(angle, "side"),))
            task = GraspTask("one", (position,))
            for i, j in ((0, 2), (2, 1), (3, 2), (4, 2)):
                base = BasePose(
                    SMALL.base_x.values[i], SMALL.base_y.values[j], 0.0, torso_height, 0.0
                )
                assert around.feasibility(task, base).feasible == labels.reached[grasp, i, j]


def test_a_table_only_removes_base_positions(tiago, labels):
    plate = label(tiago, dataclasses.replace(SMALL, thickness=0.03))
    assert np.all(plate.reached | ~labels.reached)
    # A base whose body overlaps the solid table reaches nothing.
    near = SMALL.base_x.values > -0.2
    assert not labels.reached[:, near].any()


def test_labels_do_not_depend_on_the_number_of_threads(tiago, labels):
    np.testing.assert_array_equal(label(tiago, SMALL, jobs=1).reached, labels.reached)


def test_the_base_radius_encloses_the_base(tiago, labels):
    scene, _ = table_scene(tiago, SMALL)
    grid = [Axis(n, u, 0.0, 0.0, 1) for n, u in (("base_x", "m"), ("base_y", "m"))]
    grid += [Axis("base_yaw", "deg", 0.0, 0.0, 1), Axis("torso", "m", 0.0, 0.0, 1)]
    from tcs.model.grid import Grid

    body = lower(scene, None, Grid(tuple(grid))).arrays.body
    assert base_radius(body) == pytest.approx(labels.base_radius)
    # The radius of TIAGo's base is 0.27 m.
    assert 0.27 <= labels.base_radius < 0.45


def test_learning_reports_progress_and_remembers_the_robot():
    done = []
    arplace = learn("tiago", SMALL, on_progress=lambda n, total: done.append((n, total)))
    assert done[-1] == (200, 200)
    assert arplace.metadata["robot"] == "tiago"
    assert arplace.torso_height == pytest.approx(0.175)


def test_a_task_out_of_reach_is_refused():
    far = dataclasses.replace(SMALL, base_x=Axis("base_x", "m", -9.0, 0.1, 3))
    with pytest.raises(SelectionError, match="no base position reaches any grasp"):
        learn("tiago", far)


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"approach": "below"}, UnknownNameError, "unknown approach 'below'"),
        ({"distance": Axis("base_x", "m", 0.0, 0.1, 3)}, GridError, "in place of 'distance'"),
        ({"base_x": Axis("base_x", "m", 0.0, 0.1, 2)}, GridError, "needs 3 or more"),
        ({"base_y": Axis("base_y", "m", -1, 1e-5, 200_000)}, GridError, "labels"),
        ({"height": Axis("height", "m", 0.01, 0.0, 1)}, GridError, "below the floor"),
        ({"base_yaw_deg": math.inf}, GridError, "heading of the base"),
        ({"thickness": 0.0}, GridError, "thickness of the table"),
        ({"depth": -1.0}, GridError, "depth of the table"),
        ({"below_tool": 2.0}, GridError, "distance from tool to table"),
    ],
)
def test_bad_tasks_are_one_line(changes, error, words):
    with pytest.raises(error, match=words) as caught:
        dataclasses.replace(SMALL, **changes)
    assert "\n" not in str(caught.value)


def test_a_torso_height_out_of_range_is_refused(tiago):
    with pytest.raises(GridError, match=r"torso height 2 m is out of range; must be 0 to 0.35 m"):
        label(tiago, dataclasses.replace(SMALL, torso_height=2.0))

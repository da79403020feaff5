"""What is free about a goal: its file, its words, and how far a pose is from it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tcs.errors import TcsError
from tcs.model.tasks import Freedom, load_task

X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
TASK = """\
name: wiping
title: Wiping
source: made up
environments: [wheelchair]
{task}
goals:
  - body_frame: head
    position: [0.1, 0, 0]
    quaternion_wxyz: [1, 0, 0, 0]
    {goal}
"""
FORMS = {
    "{rotation_about: [2, 0, 0]}": (Freedom(axis=X, rotates=True), "any rotation about x"),
    "orientation": (Freedom.of_orientation(), "any orientation"),
    "{orientation: true, position: [0.01, 0, 0]}": (
        Freedom.of_orientation((0.01, 0.0, 0.0)),
        "any orientation, position within +-(10 x 0 x 0) mm",
    ),
    "{cone: {axis: [0, 1, 0], half_angle_deg: 20}}": (
        Freedom(axis=Y, tilt=math.radians(20)),
        "y within 20 deg",
    ),
    "{cone: {axis: [0, 1, 0], half_angle_deg: 20}, rotation_about: [0, 1, 0]}": (
        Freedom(axis=Y, tilt=math.radians(20), rotates=True),
        "any rotation about y, y within 20 deg",
    ),
    "{symmetry: {axis: [1, 0, 0], fold: 2}}": (
        Freedom(axis=X, fold=2),
        "2-fold symmetric about x",
    ),
}
BAD = {
    "{rotation_about: [0, 0, 0]}": "the axis is",
    "{rotation_about: [1, 0]}": "must be [x, y, z]",
    "{cone: {axis: [1, 0, 0], half_angle_deg: 180}}": "cone.half_angle_deg",
    "{cone: {axis: [1, 0, 0], half_angle_deg: 9}, rotation_about: [0, 1, 0]}": "must be the same",
    "{symmetry: {axis: [1, 0, 0], fold: 1}}": "symmetry.fold",
    "{symmetry: {axis: [1, 0, 0], fold: 99}}": "must be 1 to 12",
    "{symmetry: {axis: [1, 0, 0], fold: 2}, rotation_about: [1, 0, 0]}": "exclude each other",
    "{orientation: true, rotation_about: [1, 0, 0]}": "frees every rotation",
    "{position: [0.01, -0.01, 0]}": "three tolerances from 0",
    "{position: [10, 0, 0]}": "three tolerances from 0",
    "{position: [.nan, 0, 0]}": "three tolerances from 0",
    "{position: [0, 0, 0]}": "nothing is free",
    "{}": "nothing is free",
    "{roll: true}": "roll",
    "spin": "free",
}


@pytest.fixture
def load(tmp_path):
    """Return the goal of a task file with the given lines."""

    def of(task="", goal=""):
        path = tmp_path / "wiping.yaml"
        path.write_text(TASK.format(task=task, goal=goal))
        return load_task(path).goals[0]

    return of


@pytest.mark.parametrize("text", FORMS)
def test_the_file_says_what_is_free(load, text):
    expected, words = FORMS[text]
    assert load(goal=f"free: {text}").free == load(task=f"free: {text}").free == expected
    assert str(expected) == words


def test_a_goal_overrides_its_task(load):
    assert load(task="free: orientation", goal="free: nothing").free is None
    own = load(task="free: orientation", goal="free: {rotation_about: [1, 0, 0]}")
    assert own.free == Freedom(axis=X, rotates=True)
    assert load() != own


@pytest.mark.parametrize("text", BAD)
def test_bad_freedom_is_refused_in_one_line(load, text):
    with pytest.raises(TcsError) as caught:
        load(goal=f"free: {text}")
    assert BAD[text] in str(caught.value)
    assert "\n" not in str(caught.value)


def pose(about=X, angle=0.0, p=(0.0, 0.0, 0.0)):
    return Rotation.from_rotvec(angle * np.array(about)).as_matrix(), np.array(p)


@pytest.mark.parametrize(
    ("free", "tool", "expected"),
    [
        (Freedom(rotates=True), pose(X, 2.0), (0.0, 0.0)),
        (Freedom(rotates=True), pose(Y, 0.3), (0.0, 0.3)),
        (Freedom(rotates=True), pose(p=(0.0, 3e-3, 4e-3)), (5e-3, 0.0)),
        (Freedom.of_orientation(), pose(Y, 3.0), (0.0, 0.0)),
        (Freedom(tilt=0.5), pose(Y, 0.5), (0.0, 0.0)),
        (Freedom(tilt=0.5), pose(Y, 0.7), (0.0, 0.2)),
        (Freedom(tilt=0.5), pose(X, 0.1), (0.0, 0.1)),
        (Freedom(fold=2), pose(X, math.pi), (0.0, 0.0)),
        (Freedom(fold=2), pose(X, math.pi + 0.1), (0.0, 0.1)),
        (Freedom(fold=2), pose(X, 0.5 * math.pi), (0.0, 0.5 * math.pi)),
        (Freedom(box=(0.01, 0.0, 0.02)), pose(p=(0.01, 0.003, -0.02)), (0.003, 0.0)),
    ],
)
def test_errors_are_distances_to_the_nearest_pose_that_serves(free, tool, expected):
    # The tilt's sine and cosine are good to rounding.
    assert free.errors(*tool) == pytest.approx(expected, abs=1e-12)

"""Goals with several poses, of which any one counts: their file, values and words."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from tcs.errors import TcsError
from tcs.model.tasks import Freedom, load_task

DATA = Path(__file__).parents[2] / "data"
TASK = """\
name: wiping
title: Wiping
source: made up
environments: [wheelchair]
goals:
  - {goal}
"""
POSE = "body_frame: head, position: [0.1, 0, 0], quaternion_wxyz: [1, 0, 0, 0]"
BACK = "{quaternion_wxyz: [0, 0, 0, 1]}"
BAD = {
    "{body_frame: head, position: [0.1, 0, 0]}": "goals[0]: field 'quaternion_wxyz' is missing",
    "{alternatives: [" + BACK + "]}": "goals[0]: alternatives[0]: field 'body_frame' is missing",
    "{" + POSE + ", alternatives: []}": "field 'alternatives' is empty",
    "{" + POSE + ", alternatives: {}}": "field 'goals[0].alternatives'",
    "{" + POSE + ", alternatives: [{weight: 2}]}": "weight",
    "{" + POSE + ", alternatives: [{quaternion_wxyz: [1, 1, 0, 0]}]}": "alternatives[0]: field 'q",
    "{" + POSE + ", alternatives: [{free: {}}]}": "alternatives[0]: field 'free': nothing is free",
    "{" + POSE + ", alternatives: [" + ", ".join([BACK] * 100) + "]}": "has 101 poses",
}


@pytest.fixture
def load(tmp_path):
    """Return the goal of a task file."""

    def of(goal):
        path = tmp_path / "wiping.yaml"
        path.write_text(TASK.format(goal=goal))
        return load_task(path).goals[0]

    return of


def test_alternatives_stand_beside_the_pose_of_a_goal_or_instead_of_it(load):
    beside = load("{" + POSE + ", alternatives: [" + BACK + "]}")
    assert [pose.quaternion.tolist() for pose in beside.poses] == [[1, 0, 0, 0], [0, 0, 0, 1]]
    assert [pose.body_frame for pose in beside.poses] == ["head", "head"]
    (goal,) = load_task(DATA / "cup.yaml").goals
    assert [pose.position.tolist() for pose in goal.poses] == [[0.6, 0.0, -0.35]] * 2
    np.testing.assert_allclose(goal.poses[1].quaternion, [0.5**0.5, 0, 0, -(0.5**0.5)], atol=1e-7)
    assert len(load_task(DATA / "cup.yaml").poses) == 2


def test_each_pose_says_what_is_free_about_it(load):
    spin, nothing = "free: {rotation_about: [1, 0, 0]}", "{free: nothing}"
    goal = load("{" + POSE + f", {spin}, alternatives: [{BACK}, {nothing}]}}")
    free = Freedom(rotates=True)
    assert [pose.free for pose in goal.poses] == [free, free, None]
    at = "any rotation about x at pose"
    assert goal.region == f"any of 3 poses, {at} 1, {at} 2"
    assert goal.at(goal.poses[:2]).region == "any of 2 poses, any rotation about x at each"
    assert load("{" + POSE + f", alternatives: [{BACK}]}}").region == "any of 2 poses"


def test_a_goal_differs_by_its_alternatives(load):
    one, two = load("{" + POSE + "}"), load("{" + POSE + f", alternatives: [{BACK}]}}")
    assert one != two
    assert dataclasses.replace(two, alternatives=()) == one
    assert hash(two) == hash(load("{" + POSE + f", alternatives: [{BACK}]}}"))
    assert one.alternatives == ()


@pytest.mark.parametrize("text", BAD)
def test_bad_alternatives_are_refused_in_one_line(load, text):
    with pytest.raises(TcsError) as caught:
        load(text)
    assert BAD[text] in str(caught.value)
    assert "\n" not in str(caught.value)

"""Which freedom the goals of an arm of five joints need."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.errors import TaskError
from tcs.model.scene.turning import axis_of_turn, freedom_rows
from tcs.model.tasks import Freedom, load_task
from tests.kernel.test_five_joints import five_joint_chain
from tests.kernel.test_six_joints import six_joint_chain

Y = (0.0, 1.0, 0.0)
TURN = Freedom(axis=Y, rotates=True)


def task_with(*frees):
    task = load_task("feeding").exact()
    goals = tuple(
        dataclasses.replace(goal, free=free) for goal, free in zip(task.goals, frees, strict=False)
    )
    return dataclasses.replace(task, goals=goals)


def test_arms_of_more_joints_need_no_freedom():
    chain = six_joint_chain("elimination", 0)
    assert axis_of_turn(load_task("feeding").exact(), chain, "arm") is None
    assert freedom_rows(load_task("feeding").exact(), chain, "arm").shape == (0, 9)


@pytest.mark.parametrize(
    "free", [None, Freedom(tilt=0.3), Freedom(fold=2), Freedom(box=(0.01,) * 3)]
)
def test_a_goal_without_a_free_rotation_is_refused(free):
    with pytest.raises(TaskError, match=r"goal 2: the arm of robot 'arm' has five.*rotation_about"):
        freedom_rows(task_with(TURN, free), five_joint_chain(0), "arm")


def test_goals_that_free_different_axes_are_refused():
    task = task_with(TURN, Freedom(axis=(0.0, -1.0, 0.0), rotates=True), Freedom(rotates=True))
    with pytest.raises(TaskError, match=r"goal 1 leaves.*about y free and goal 3 that about x"):
        freedom_rows(task, five_joint_chain(0), "arm")


def test_goals_of_any_orientation_take_the_axis_of_the_others():
    rows = freedom_rows(task_with(Freedom.of_orientation(), TURN), five_joint_chain(0), "arm")
    np.testing.assert_array_equal(rows[:, :3], [Y, Y])


def test_without_others_they_take_an_axis_that_no_joint_turns_about():
    chain = five_joint_chain(0)
    R, p = chain.R.copy(), chain.p.copy()
    R[7], p[7] = np.eye(3), [0.0, 0.0, 0.2]
    chain = chain._replace(R=R, p=p)
    axis = axis_of_turn(task_with(Freedom.of_orientation()), chain, "arm")
    assert axis != (0.0, 0.0, 1.0)
    with pytest.raises(TaskError, match="about z, the free rotation adds nothing"):
        axis_of_turn(task_with(Freedom(axis=(0.0, 0.0, 1.0), rotates=True)), chain, "arm")

"""The shipped tasks with what they let free, the default, beside the same goals at exact poses."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.model.tasks import load_task, task_names
from tcs.motion import check_approaches
from tcs.placement.scoring import load_job, score, task_environment_pairs, verify
from tcs.placement.tables import Reason
from tests.chosen import some_of
from tests.environments import BESIDE, CORNER, write_environment
from tests.exact import exact_task

SMALL = {
    "shaving": ("wheelchair", CORNER),
    "feeding": ("wheelchair", CORNER),
    "brushing": ("wheelchair", CORNER),
    "scratching_thigh_right": ("wheelchair", BESIDE),
}
"""Environments and grids on which a task is reached at exact poses."""


@pytest.mark.parametrize("name", task_names())
def test_the_exact_pose_is_within_what_a_goal_lets_free(name):
    task = load_task(name)
    assert task.has_freedom
    for goal in task.goals:
        assert goal.free is not None
        assert goal.free.errors(np.eye(3), np.zeros(3)) == (0.0, 0.0)
        # Along the approach nothing is free: that would be beside the skin, or in it.
        assert (goal.free.axis, goal.free.box[0]) == ((1.0, 0.0, 0.0), 0.0)
        assert 0.0 < goal.free.tilt < np.radians(45.0)


def test_a_spoon_stays_level():
    assert not any(goal.free.rotates for goal in load_task("feeding").goals)


@pytest.mark.parametrize("name", task_names())
def test_what_is_exact_keeps_all_else(name, tmp_path):
    task = load_task(name)
    exact = load_task(exact_task(name, tmp_path))
    assert not exact.has_freedom
    assert task.exact() == exact != task


@pytest.mark.parametrize(
    ("task", "environment"),
    some_of(task_environment_pairs(), ("bathing", "bed"), ("shaving", "wheelchair")),
)
def test_as_in_the_papers_the_scene_is_that_of_exact_goals(task, environment, tmp_path):
    jobs = (
        load_job(task, environment, "pr2", paper=True),
        load_job(exact_task(task, tmp_path), environment, "pr2"),
    )
    first, second = (job.lowered(job.scene()).digest() for job in jobs)
    assert first == second


@pytest.fixture(scope="module", params=some_of(SMALL, "shaving", "feeding"))
def meant(request, tmp_path_factory):
    """Task, environment, and the scores as meant."""
    task, (based_on, grid) = request.param, SMALL[request.param]
    folder = tmp_path_factory.mktemp("meant")
    environment = write_environment(folder, "small", grid, based_on=based_on)
    return task, environment, score(task, environment)


def test_whatever_is_done_exactly_is_done_as_meant(meant, tmp_path):
    task, environment, file = meant
    exact = score(exact_task(task, tmp_path), environment)
    free, fixed = (f.nominal.scores.reached for f in (file, exact))
    assert np.all(free | ~fixed)
    assert free.sum() > fixed.sum() > 0


def test_drake_refutes_nothing_as_meant(meant):
    _, _, file = meant
    found = verify(file, pairs=30, dense=0)
    assert found.is_sound
    assert found.checked == min(30, np.count_nonzero(file.nominal.scores.reason == Reason.REACHED))
    approaches = check_approaches(file, pairs=4)
    assert (approaches.checked, approaches.false) == (4, 0)

"""Goals with freedom of shipped robots: bounds of the search, and wider freedoms."""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from tcs.kernel.cache import jit
from tcs.kernel.freedom.forms import orientations
from tcs.kernel.freedom.reach import wrist_reach
from tcs.kernel.freedom.wrist_places import is_no_place
from tcs.kernel.problem import build_problem, chain_of
from tcs.kernel.rows import rows_at
from tcs.kernel.scores import REACHED
from tcs.kernel.sweep import score
from tcs.model.tasks import Freedom, load_task
from tcs.placement.scoring import load_job
from tests.chosen import some_of
from tests.kernel.shapes import offset_arm, random_arm, random_joints
from tests.reference.kinematics import link_poses

CONE = Freedom(tilt=math.radians(20.0))
WIDER = {
    "cone": [Freedom(tilt=math.radians(d)) for d in (5, 10, 15, 20, 26, 33, 40)],
    "box": [Freedom(box=(d, d, 2.0 * d)) for d in (0.003, 0.01, 0.02, 0.06)],
    "both": [Freedom(tilt=d, box=(0.1 * d, 0.1 * d, 0.1 * d)) for d in (0.1, 0.3, 0.5)],
}
"""Freedoms, each within the next one."""


@functools.cache
def free_problem(robot, free):
    """Return *shaving* in the wheelchair with a freedom at every goal, and its grid."""
    task = load_task("shaving").exact()
    task = replace(task, goals=tuple(replace(goal, free=free) for goal in task.goals))
    job = load_job(task, "wheelchair", robot)
    lowered = job.lowered(job.scene())
    return build_problem(lowered.arrays), lowered.grid


def some_rows(grid, count, seed):
    """Return random configurations of a grid."""
    return rows_at(grid, np.sort(np.random.default_rng(seed).choice(grid.size, count, False)))


@jit
def _are_no_places(places, at, found):
    for n in range(len(at)):
        found[n] = is_no_place(places, at[n, 0], at[n, 1], at[n, 2])


def are_no_places(places, p_A):
    """Return whether no posture takes the wrist to positions in the arm base [m], shape (n, 3)."""
    found = np.empty(len(p_A), np.bool_)
    _are_no_places(places, np.ascontiguousarray((p_A - places.p) @ places.R), found)
    return found


def wrists_of(chain, reach, q):
    """Return positions of the wrist in the arm base [m], shape (n, 3)."""
    tools = [link_poses(chain, one)[-1] for one in q]
    return np.array([p + R @ reach.wrist for R, p in tools])


@pytest.mark.parametrize("seed", range(6))
def test_every_posture_takes_the_wrist_to_a_place(seed):
    rng = np.random.default_rng(seed)
    chain = random_arm(rng)
    chain = chain._replace(
        lower=np.where(rng.random(7) < 0.5, np.maximum(chain.lower, -0.4), chain.lower),
        upper=np.where(rng.random(7) < 0.5, np.minimum(chain.upper, 0.6), chain.upper),
    )
    reach = wrist_reach(chain)
    assert len(reach.places.marked)
    q = np.array([random_joints(rng, chain) for _ in range(3000)])
    ends = np.isfinite(chain.lower) & (rng.random(q.shape) < 0.3)
    q = np.where(ends, np.where(rng.random(q.shape) < 0.5, chain.lower, chain.upper), q)
    q = np.where(np.isfinite(q), q, 0.0)
    assert not np.any(are_no_places(reach.places, wrists_of(chain, reach, q)))
    around = reach.pivot + rng.uniform(-reach.span, reach.span, (3000, 3))
    assert np.mean(are_no_places(reach.places, around)) > 0.1


@pytest.mark.parametrize("robot", ["pr2", "tiago"])
def test_limits_of_the_joints_before_the_wrist_leave_few_places(robot):
    problem, _ = free_problem(robot, CONE)
    chain, reach = chain_of(problem), problem.goals.freedom.reach
    rng = np.random.default_rng(0)
    inside = np.array([random_joints(rng, chain) for _ in range(3000)])
    assert not np.any(are_no_places(reach.places, wrists_of(chain, reach, inside)))
    endless = chain._replace(lower=np.full(7, -np.inf), upper=np.full(7, np.inf))
    anywhere = np.array([random_joints(rng, endless) for _ in range(3000)])
    assert np.mean(are_no_places(reach.places, wrists_of(chain, reach, anywhere))) > 0.3


def test_an_arm_without_a_spherical_wrist_has_no_places(rng):
    reach = wrist_reach(offset_arm(rng))
    assert not len(reach.places.marked)
    assert not np.any(are_no_places(reach.places, rng.uniform(-9.0, 9.0, (50, 3))))


@pytest.mark.parametrize("robot", some_of(("pr2", "tiago", "iiwa7", "ur5", "stretch"), "tiago"))
def test_a_goal_is_reached_where_one_of_its_samples_is(robot):
    """Among these are pairs that a bound of joint rates over the tilt lost."""
    problem, grid = free_problem(robot, CONE)
    rows, free = some_rows(grid, 400, 1), problem.goals.freedom
    reached = score(problem, rows).reason == REACHED
    samples = missed = 0
    for goal in range(problem.goals.number):
        u = free.samples(goal)
        R = problem.goals.R[:1, goal, None] @ orientations(free.form[goal], u).as_matrix()
        posed = problem.at_single_poses(R, np.repeat(problem.goals.p[:1, goal, None], len(u), 1))
        served = (score(posed, rows).reason == REACHED).any(axis=1)
        samples += np.count_nonzero(served)
        missed += np.count_nonzero(served & ~reached[:, goal])
    assert samples > 30
    assert missed == 0


@pytest.mark.parametrize("robot", some_of(("pr2", "tiago", "ur5", "stretch"), "pr2"))
@pytest.mark.parametrize("name", WIDER)
def test_a_wider_freedom_of_a_robot_reaches_no_less(robot, name):
    reached = []
    for free in (Freedom(tilt=1e-6), *WIDER[name]):
        problem, grid = free_problem(robot, free)
        reached.append(score(problem, some_rows(grid, 500, 2)).reason == REACHED)
    for narrow, wide in itertools.pairwise(reached):
        assert np.all(wide | ~narrow)
    assert np.count_nonzero(reached[-1]) > np.count_nonzero(reached[0]) > 10

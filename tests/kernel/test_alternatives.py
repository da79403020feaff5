"""Goals of several poses in the kernel: the best of them counts."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import grid_rows
from tcs.kernel.scores import BODY_BLOCKED, NEARNESS, REACHED
from tcs.kernel.sweep import blocked_grippers, gripper_contacts
from tcs.kernel.verification.scans import dense_scans
from tcs.model.tasks import Freedom
from tests.kernel.shapes import about
from tests.kernel.test_freedom import CHAIN
from tests.kernel.test_six_joints import six_joint_chain
from tests.kernel.toy import scores_of, toy_grid, toy_scene
from tests.reference.pairs import free_score, is_served

FIRST = np.array([0, 2, 3, 5])
"""Three goals: of two poses, of one and of two."""


@pytest.fixture(params=["six", "seven"], scope="module")
def scene(request):
    """Return a scene of five poses, all alone."""
    chain = CHAIN if request.param == "seven" else six_joint_chain("spherical wrist", 10)
    chain = chain._replace(lower=np.full(7, -3.0), upper=np.full(7, 3.0))
    scene = toy_scene(chain, 5, obstacles=2, goals=5, states=1)
    # The first two are near each other.
    R, p = scene.goal_R.copy(), scene.goal_p.copy()
    R[:, 1], p[:, 1] = R[:, 0] @ about(np.array([1.0, 0.0, 0.0]), 0.6), p[:, 0]
    return scene._replace(goal_R=R, goal_p=p)


@pytest.fixture(scope="module")
def alone(scene):
    return scores_of(scene, toy_grid(states=1))


def test_a_goal_has_the_score_of_the_best_of_its_poses(scene, alone):
    scores = scores_of(scene._replace(first_pose=FIRST), toy_grid(states=1))
    assert scores.reason.shape == (len(alone.reason), 3)
    for g, (a, b) in enumerate(itertools.pairwise(FIRST)):
        reached = alone.reason[:, a:b] == REACHED
        np.testing.assert_array_equal(scores.reason[:, g] == REACHED, reached.any(axis=1))
        at = a + np.argmax(np.where(reached, alone.dexterity[:, a:b], -1.0), axis=1)
        rows = np.flatnonzero(reached.any(axis=1))
        np.testing.assert_array_equal(scores.dexterity[rows, g], alone.dexterity[rows, at[rows]])
        np.testing.assert_array_equal(scores.joints[rows, g], alone.joints[rows, at[rows]])
    both = (alone.reason[:, :2] == REACHED).sum(axis=1)
    assert np.any(both == 2)
    assert np.any(both == 1)


def test_the_reason_is_that_of_the_pose_that_comes_farthest(scene, alone):
    scores = scores_of(scene._replace(first_pose=FIRST), toy_grid(states=1))
    progress = NEARNESS[alone.reason]
    for g, (a, b) in enumerate(itertools.pairwise(FIRST)):
        at = a + np.argmax(progress[:, a:b], axis=1)
        rows = np.flatnonzero(~np.isin(scores.reason[:, g], (REACHED, BODY_BLOCKED)))
        np.testing.assert_array_equal(scores.reason[rows, g], alone.reason[rows, at[rows]])
        np.testing.assert_array_equal(scores.contact[rows, g], alone.contact[rows, at[rows]])
        assert len(rows) > 10


def test_poses_of_a_goal_may_be_free_or_not(scene, alone):
    freedom = np.zeros((5, 9))
    freedom[1] = Freedom(axis=(1.0, 0.0, 0.0), tilt=0.8).row()
    grid = toy_grid(states=1)
    scores = scores_of(scene._replace(first_pose=FIRST, freedom=freedom), grid)
    reached = alone.reason == REACHED
    either = scores.reason[:, 0] == REACHED
    assert np.all(either | ~(reached[:, 0] | reached[:, 1]))
    assert np.sum(either) > np.sum(reached[:, 0] | reached[:, 1])
    np.testing.assert_array_equal(scores.joints[:, 1], alone.joints[:, 2])


def test_reference_and_dense_scan_agree(scene):
    several, grid = scene._replace(first_pose=FIRST), toy_grid(states=1)
    scores, problem = scores_of(several, grid), build_problem(several)
    found = np.argwhere(scores.reason == REACHED)[:3]
    for h, g in found:
        assert is_served(several, grid, h, g, scores.joints[h, g].astype(float))
        expected = free_score(several, grid, h, g, problem.goals.freedom)
        assert expected.reason == REACHED
        assert scores.dexterity[h, g] >= expected.dexterity - 1e-6
    left = np.argwhere(~np.isin(scores.reason, (REACHED, BODY_BLOCKED)))[:3]
    for pairs, is_reached in ((found, True), (left, False)):
        values = dense_scans(problem, grid_rows(grid), pairs, 800, np.empty((len(pairs), 7)))
        np.testing.assert_array_equal(values > 0.0, is_reached)


def test_a_gripper_is_blocked_where_it_is_at_all_poses(scene):
    problem = build_problem(scene._replace(first_pose=FIRST))
    codes = gripper_contacts(problem) != NO_CONTACT
    parts = [codes[:, a:b].all(axis=1) for a, b in itertools.pairwise(FIRST)]
    np.testing.assert_array_equal(blocked_grippers(problem), np.transpose(parts))

"""Pairs that are left out never touch; others are kept."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.arrays import SPHERE
from tcs.kernel.distances import DistanceTables
from tcs.kernel.motion.edges import NO_PAIR, posture_contact
from tcs.kernel.motion.never_in_contact import MOST_BETWEEN, needed_pairs
from tcs.kernel.motion.scene import motion_scene, new_motion_workspace, with_pairs
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tests.kernel.arms import drake_arm
from tests.kernel.motion.toys import HERE, within_limits
from tests.kernel.shapes import placed
from tests.kernel.toy import toy_grid, toy_scene, with_obstacle
from tests.reference.constructed import arm_base
from tests.reference.kinematics import link_poses

OUT = np.array([0.35, 0.0, 0.1])
"""Where the shapes of the first three links are, in their frames [m]."""
MET = np.array([1.0, 0.6, 0.5, 0, 0, 0, 0])
"""A posture at which each of them meets a ball [rad]."""
SIZE = 16
"""Number of cells of a full turn of a joint in a table."""


@pytest.fixture(scope="module")
def chain():
    return drake_arm("pr2 left").chain


def with_shapes(chain, frame, body, places):
    """Return a scene whose first three shapes are on given links; three balls are on their way."""
    scene = toy_scene(chain, 0, obstacles=30)
    R_WA, p_WA = arm_base(scene, toy_grid(), HERE)
    p = scene.arm.p.copy()
    p[0, :3] = places
    frames = np.array([*frame, 4, 7, 7], np.int8)
    bodies = np.array([*body, 4, 5, 6], scene.arm.body.dtype)
    scene = scene._replace(arm=scene.arm._replace(frame=frames, body=bodies, p=p))
    for R_AL, p_AL in link_poses(chain, MET)[:3]:
        ball = placed(SPHERE, [0.05, 0, 0], p=R_WA @ (R_AL @ OUT + p_AL) + p_WA)
        scene = with_obstacle(scene, ball)
    return motion_scene(build_problem(scene), rows_at(toy_grid(), [HERE]))


@pytest.fixture(scope="module")
def every(chain):
    """Return a scene whose first three links have a shape each that meets a ball on its way."""
    return with_shapes(chain, (1, 2, 3), (2, 9, 3), OUT)


def joints_between(scene):
    return scene.shapes.link_frame[scene.pairs.members[:, 0]] - scene.pairs.members[:, 2]


def all_of(scene):
    return np.ones(len(scene.pairs.members), np.bool_)


def test_pairs_that_up_to_three_joints_keep_apart_are_left_out(chain, every, rng):
    needed, joints = needed_pairs(every, all_of(every)), joints_between(every)
    assert np.all(needed[joints > MOST_BETWEEN])
    numbers = range(1, MOST_BETWEEN + 1)
    for n in numbers:
        assert 0 < needed[joints == n].sum() < np.sum(joints == n)
    postures = [within_limits(rng, chain) for _ in range(500)]
    by_joints = [(needed & (joints == n), True) for n in numbers]
    for kept, touches in ((~needed, False), *by_joints):
        some = with_pairs(every, kept)
        work = new_motion_workspace(some)
        assert any(posture_contact(some, work, q) != NO_PAIR for q in postures) == touches


def test_one_box_around_several_shapes_encloses_each_of_them(chain):
    # The one that is farthest from the axis comes last along it.
    places = [[0.0, 0.0, 0.0], [0.05, 0.0, 0.02], OUT]
    scene = with_shapes(chain, (3, 3, 3), (3, 3, 3), places)
    needed, turned = needed_pairs(scene, all_of(scene)), joints_between(scene) == MOST_BETWEEN
    for kept, touches in ((~needed, False), (needed & turned, True)):
        some = with_pairs(scene, kept)
        assert (posture_contact(some, new_motion_workspace(some), MET) != NO_PAIR) == touches


def test_pairs_that_are_not_to_be_checked_are_kept(every):
    needed, checked = needed_pairs(every, all_of(every)), joints_between(every) == 1
    np.testing.assert_array_equal(needed_pairs(every, checked), needed | ~checked)


def test_a_table_that_clears_the_pair_at_one_angle_alone_does_not_leave_it_out(every):
    # As if the balls were of the robot: the last body of the scene.
    kept = (joints_between(every) == MOST_BETWEEN) & (
        every.pairs.members[:, 1] == len(every.shapes.body) - 1
    )
    ball = every.shapes.body.max() + 1
    scene = with_pairs(every, kept)
    body = scene.shapes.body.copy()
    body[-1] = ball
    corners = np.zeros((SIZE, SIZE), np.uint8)
    # Near the angle 0 of the last joint between, and at no other one.
    corners[:, [0, 1, -1]] = 255
    of_bodies = np.full((ball + 1, ball + 1), -1)
    of_bodies[:, ball - scene.shapes.robot] = 0
    tables = DistanceTables(
        of_bodies,
        np.array([[0, 2]]),
        np.array([[SIZE, SIZE]]),
        np.zeros((1, 2)),
        np.zeros(1, np.int64),
        corners.ravel(),
    )
    scene = scene._replace(shapes=scene.shapes._replace(body=body), distances=tables)
    assert len(scene.pairs.members) == 1
    assert np.all(needed_pairs(scene, all_of(scene)))

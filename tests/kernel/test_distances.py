"""Tables of distances in the kernel: bounds, postures, scores and certified motions."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.arrays import BodyDistances
from tcs.kernel.cache import jit
from tcs.kernel.distances import (
    NOTHING,
    DistanceTables,
    arranged,
    distance_bound,
    may_come_apart,
)
from tcs.kernel.motion.edges import NO_PAIR, certified, posture_contact
from tcs.kernel.scores import REACHED
from tests.kernel.arms import drake_arm
from tests.kernel.judge import compare, stratified
from tests.kernel.motion.toys import prepared, within_limits
from tests.kernel.toy import scores_of, toy_grid, toy_scene
from tests.reference.motion import least_excess, point_on_curve, straight_curve
from tests.reference.pairs import STEP, bounds_at

UPPER, FORE, PALM, FINGER, HEAD = 3, 4, 5, 6, 7
"""Bodies of the toy scene."""


@jit
def bounds(distances: DistanceTables, n, q, found):
    for i in range(len(q)):
        found[i] = distance_bound(distances, n, q[i])


@jit
def any_apart(distances: DistanceTables, n, start, end, gap):
    return may_come_apart(distances, n, start, end, 1.25, gap)


def tables(rng, pairs, joints, sizes):
    return BodyDistances(
        body=np.array(pairs, np.int64),
        joint=np.array(joints, np.int64),
        size=np.array(sizes, np.int64),
        reach=rng.uniform(0.05, 0.3, (len(pairs), 2)),
        corners=rng.integers(0, 256, int(np.prod(sizes, axis=1).sum())).astype(np.uint8),
    )


def test_bounds_agree_with_the_reference(rng):
    given = tables(rng, [[0, 3], [2, 5]], [[1, 2], [4, 4]], [[76, 66], [70, 1]])
    given.reach[1, 1] = 0.0
    q = rng.uniform(-7.0, 7.0, (500, 7))
    packed, found = arranged(given, 6), np.empty((2, len(q)))
    for n in range(2):
        bounds(packed, n, q, found[n])
    expected = [bounds_at(given, angles) for angles in q]
    np.testing.assert_allclose(found[0], [e[frozenset((0, 3))] for e in expected], atol=1e-12)
    np.testing.assert_allclose(found[1], [e[frozenset((2, 5))] for e in expected], atol=1e-12)
    # Some are known, others not.
    for each in found:
        assert 20 < np.count_nonzero(each > 0.0) < 480
        assert np.all(each[each <= 0.0] == NOTHING)
    assert packed.of_bodies[3, 0] == 0
    assert packed.of_bodies[2, 5] == 1
    assert packed.of_bodies[0, 1] == -1


def test_a_range_of_two_joints_is_read_whole(rng):
    given = tables(rng, [[0, 1]], [[2, 3]], [[90, 90]])
    given.corners[:] = 50
    packed = arranged(given, 2)
    start = np.zeros(7)
    end = np.array([0.0, 0.0, 0.2, 0.3, 0.0, 0.0, 0.0])
    assert not any_apart(packed, 0, start, end, 0.00201)
    assert any_apart(packed, 0, start, end, 0.0020)
    # A corner beyond the last angle is one of its cell.
    inside = packed.corners.reshape(90, 90)
    last = int(0.3 * (1.0 + 0.125) * 90 / (2.0 * np.pi)) + 1
    for row, column, is_read in (
        (1, 3, True),
        (1, last, True),
        (1, last + 1, False),
        (40, 3, False),
    ):
        inside[row, column] = 51
        assert any_apart(packed, 0, start, end, 0.00201) == is_read
        inside[row, column] = 50
    # Too far from each other to tell.
    assert any_apart(packed, 0, start, 10.0 * end, 0.0021)


@pytest.fixture(scope="module")
def chain():
    return drake_arm("pr2 left").chain


@pytest.fixture(scope="module")
def fat(chain):
    """A scene whose palm and finger touch the arm and the body in most postures."""
    scene = toy_scene(chain, 4, obstacles=3)
    return scene._replace(arm=scene.arm._replace(size=1.8 * scene.arm.size))


def test_scores_agree_with_the_reference_where_tables_decide(fat, rng):
    pairs = [[FORE, PALM], [FORE, FINGER], [UPPER, PALM], [HEAD, FORE]]
    given = tables(rng, pairs, [[4, 5], [5, 6], [3, 4], [0, 3]], [[40, 36]] * 4)
    scene, grid = fat._replace(distances=given), toy_grid()
    before, after = scores_of(fat, grid), scores_of(scene, grid)
    freed = (after.reason == REACHED) & (before.reason != REACHED)
    assert freed.sum() > 20
    assert not np.any((before.reason == REACHED) & (after.reason != REACHED))
    compare(scene, grid, after, stratified(rng, after.reason, 1))
    # Most of all where the table has the last word.
    compare(scene, grid, after, rng.permutation(np.argwhere(freed))[:3])


def test_a_table_of_great_distances_exempts_a_pair(fat, rng):
    given = tables(rng, [[FORE, PALM]], [[4, 5]], [[20, 20]])
    given.corners[:], given.reach[:] = 255, 0.001
    scene, grid = fat._replace(distances=given), toy_grid()
    body = fat.arm.body
    off = np.isin(body[:, None], (FORE, PALM)) & np.isin(body[None], (FORE, PALM))
    exempt = fat._replace(arm_vs_arm=fat.arm_vs_arm & ~off)
    for mine, expected in zip(scores_of(scene, grid), scores_of(exempt, grid), strict=True):
        np.testing.assert_array_equal(mine, expected)


def smooth(q):
    """Return a made-up distance over joints 5 and 6 [m]."""
    return 0.004 + 0.006 * np.sin(q[..., 4]) * np.cos(2.0 * q[..., 5])


@pytest.fixture(scope="module")
def only_the_table(chain):
    """A scene in which palm and forearm always touch, and are far apart as a table says."""
    size = 256
    angles = np.arange(size) * 2.0 * np.pi / size
    q = np.zeros((size, size, 7))
    q[..., 4], q[..., 5] = angles[:, None], angles
    given = BodyDistances(
        body=np.array([[FORE, PALM]]),
        joint=np.array([[4, 5]]),
        size=np.array([[size, size]]),
        # Above the derivatives of `smooth`, and so that `reach * (reach + MOST)` is above half the
        # second derivatives of its square: 0.006^2 + 0.01 * 0.006, and 0.012^2 + 0.01 * 0.024.
        reach=np.array([[0.007, 0.016]]),
        corners=np.clip(np.floor(smooth(q) / STEP), 0, 255).astype(np.uint8).ravel(),
    )
    scene = toy_scene(chain, 0, obstacles=0)
    body, grown = scene.arm.body, np.where(np.isin(scene.arm.body, (FORE, PALM)), 5.0, 1.0)
    pair = (body[:, None] == FORE) & (body[None] == PALM)
    return scene._replace(
        arm=scene.arm._replace(size=scene.arm.size * grown[:, None]),
        arm_vs_arm=pair | pair.T,
        arm_vs_body=np.zeros_like(scene.arm_vs_body),
        arm_vs_environment=np.zeros_like(scene.arm_vs_environment),
        distances=given,
    )


def test_motions_are_free_where_the_table_shows_it_all_along(chain, only_the_table, rng):
    scene, work, plain = prepared(only_the_table)
    gap, lost = only_the_table.self_margin, 1e-4
    counts = np.zeros(3, int)
    for _ in range(200):
        start = within_limits(rng, chain)
        control = straight_curve(start, start + 0.4 * rng.normal(size=7))
        free = posture_contact(scene, work, start) == NO_PAIR
        assert free == (least_excess(plain, start) > 0.0)
        done = certified(scene, work, control) == 1.0
        along = smooth(np.array([point_on_curve(control, t) for t in np.linspace(0, 1, 400)]))
        counts += [free, done, not done]
        if done:
            assert along.min() >= gap
        elif free:
            # In the middle of a cell, the bound of a millimetre loses less than `lost`.
            assert along.min() < gap + lost + STEP
    assert counts.min() > 20

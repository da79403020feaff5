"""Properties of planned paths: certified, repeatable, reversible, local, and none without a gap."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tcs.kernel.arrays import BOX
from tcs.kernel.motion.connect import connect
from tcs.kernel.motion.edges import NO_PAIR, certified, posture_contact
from tcs.kernel.motion.search_trees import new_trees
from tcs.kernel.motion.shortcut import shorten
from tests.kernel.arms import drake_arm
from tests.kernel.motion.toys import HERE, SWING, bare, prepared, within_limits
from tests.kernel.shapes import placed
from tests.kernel.toy import toy_grid, with_obstacle
from tests.reference.constructed import arm_base
from tests.reference.motion import straight_curve


@pytest.fixture(scope="module")
def chain():
    return drake_arm("pr2 left").chain


def walled(chain, low=0.5, high=0.85, begin=0.4, thickness=0.02):
    """Return a bare scene with a wall between the two postures of SWING, from low to high [m].

    It begins at a distance in front of the shoulder [m] and ends beyond the arm's reach.
    """
    scene = bare(chain)
    R_WA, p_WA = arm_base(scene, toy_grid(), HERE)
    size = [(1.2 - begin) / 2, thickness / 2, (high - low) / 2]
    p = R_WA @ [(1.2 + begin) / 2, 0.0, 0.0] + p_WA
    p[2] = (low + high) / 2
    return with_obstacle(scene, placed(BOX, size, R_WA, p))


def plan(scene, seed=0, attempts=40, iterations=3000):
    """Return a path from the first posture of SWING to the second, None if there is none."""
    ready, work, plain = prepared(scene)
    trees = new_trees(seed)
    count = connect(ready, work, trees, SWING[:1], SWING[1:], iterations, attempts)
    return (trees.path[:count].copy() if count else None), ready, work, plain


def length(path):
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


@pytest.mark.parametrize("thickness", [0.02, 1e-5])
@pytest.mark.parametrize("seed", range(3))
def test_a_path_leads_around_a_wall_and_is_free(chain, seed, thickness):
    # The trees grow through the thin wall: no posture that they check meets it.
    path, ready, work, _ = plan(walled(chain, thickness=thickness), seed)
    assert len(path) > 2
    np.testing.assert_allclose(path[[0, -1]], SWING, atol=1e-12)
    low, high = ready.limits.lower - 1e-12, ready.limits.upper + 1e-12
    assert np.all((path >= low) & (path <= high))
    for a, b in itertools.pairwise(path):
        assert certified(ready, work, straight_curve(a, b)) == 1.0
        # Reversed, the same edge is as free.
        assert certified(ready, work, straight_curve(b, a)) == 1.0


def test_the_same_seed_gives_the_same_path_and_another_seed_another(chain):
    scene = walled(chain)
    first, again, other = (plan(scene, seed)[0] for seed in (4, 4, 5))
    np.testing.assert_array_equal(first, again)
    assert first.shape != other.shape or not np.array_equal(first, other)


def test_an_environment_far_away_changes_nothing(chain):
    scene = walled(chain)
    paths = []
    for x in (8.0, 12.0):
        cabinet = placed(BOX, [0.5, 0.5, 1.0], p=[x, 3.0, 1.0])
        paths.append(plan(with_obstacle(scene, cabinet))[0])
    np.testing.assert_array_equal(*paths)


def test_without_a_gap_there_is_no_path(chain):
    path, _, work, _ = plan(walled(chain, 0.0, 3.0, begin=0.3), iterations=200)
    assert path is None
    assert work.contacts.hits.sum() > 0


def test_shortcuts_take_full_turns_off(chain):
    ready, work, _ = prepared(bare(chain))
    trees = new_trees(0)
    # Twice around the forearm's axis for nothing.
    twist = np.array([0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0])
    path = np.linspace(SWING[0], SWING[1], 7) + np.arange(7)[:, None] * twist * (2 * np.pi / 6)
    trees.path[:7] = path
    assert shorten(ready, work, trees, 7, 0) == 2
    np.testing.assert_allclose(trees.path[:2], SWING, atol=1e-12)


def test_shortcuts_do_not_lengthen_a_path(chain):
    scene = walled(chain)
    ready, work, _ = prepared(scene)
    trees = new_trees(1)
    count = connect(ready, work, trees, SWING[:1], SWING[1:], 3000, 0)
    found = trees.path[:count].copy()
    shorter = plan(scene, 1)[0]
    assert length(SWING) < length(shorter) < length(found)


def test_a_path_starts_and_ends_at_the_nearest_of_several_postures(chain):
    ready, work, _ = prepared(bare(chain))
    trees = new_trees(0)
    starts = np.array([SWING[0] + 0.3, SWING[0]])
    # Full turns of the continuous joints 5 and 7 are the same posture.
    goals = np.array([SWING[1] - 0.4, SWING[1] + [0, 0, 0, 0, 2 * np.pi, 0, -2 * np.pi]])
    assert connect(ready, work, trees, starts, goals, 10, 0) == 2
    assert trees.ends.tolist() == [1, 1]
    np.testing.assert_allclose(trees.path[1], SWING[1], atol=1e-12)


def test_an_arm_without_a_closed_form_plans_too(rng):
    baxter = drake_arm("baxter").chain
    ready, work, _ = prepared(bare(baxter))
    drawn = (within_limits(rng, baxter) for _ in range(200))
    free = (q for q in drawn if posture_contact(ready, work, q) == NO_PAIR)
    ends = np.array([next(free), next(free)])
    trees = new_trees(0)
    count = connect(ready, work, trees, ends[:1], ends[1:], 3000, 0)
    assert count >= 2
    np.testing.assert_allclose(trees.path[[0, count - 1]], ends, atol=1e-12)
    for a, b in itertools.pairwise(trees.path[:count]):
        assert certified(ready, work, straight_curve(a, b)) == 1.0


def test_without_postures_there_is_no_path(chain):
    ready, work, _ = prepared(bare(chain))
    assert connect(ready, work, new_trees(0), SWING[:1], np.empty((0, 7)), 10, 0) == 0

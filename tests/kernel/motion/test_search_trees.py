"""The nearest node of a tree: by how far the arm reaches, blocked steps counted."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.motion.connect import connect
from tcs.kernel.motion.search_trees import (
    BLOCKED,
    CHUNK,
    COUNTED,
    count_blocked,
    nearest,
    new_trees,
    place_node,
)
from tests.kernel.arms import drake_arm
from tests.kernel.motion.test_paths import walled
from tests.kernel.motion.toys import SWING, prepared


@pytest.fixture(scope="module")
def scene():
    return prepared(walled(drake_arm("pr2 left").chain))[0]


def planted(postures):
    """Return trees, the first one with nodes at postures."""
    trees = new_trees(0)
    trees.nodes[0] = len(postures)
    trees.q[0, : len(postures)] = postures
    for n in range(len(postures)):
        place_node(trees, 0, n)
    return trees


def distances(scene, postures, target):
    """Return the distances of postures, joints without limits the short way round [rad]."""
    angle = postures - target
    turns = np.divide(
        angle, scene.limits.period, out=np.zeros_like(angle), where=scene.limits.period > 0.0
    )
    return np.sqrt(
        (scene.chain.weight * (angle - scene.limits.period * np.round(turns)) ** 2).sum(axis=1)
    )


@pytest.mark.parametrize("nodes", [1, CHUNK - 1, CHUNK, 3 * CHUNK + 5])
def test_nearest_node_is_that_of_plain_loops(scene, rng, nodes):
    postures = rng.uniform(-4.0, 4.0, (nodes, 7))
    trees = planted(postures)
    assert np.any(scene.limits.period > 0.0)
    for target in rng.uniform(-4.0, 4.0, (20, 7)):
        assert nearest(scene, trees, 0, target) == distances(scene, postures, target).argmin()


def test_a_node_falls_behind_another_once_too_many_steps_from_it_are_blocked(scene):
    # The second node is farther by a tenth, 21 % in the square, the third one by half.
    target, joint = np.zeros(7), np.eye(7)[0]
    trees = planted(np.outer([0.5, 0.55, 0.75], joint))
    for _ in range(int(0.21 / BLOCKED)):
        count_blocked(trees, 0, 0)
        assert nearest(scene, trees, 0, target) == 0
    count_blocked(trees, 0, 0)
    assert nearest(scene, trees, 0, target) == 1
    # Further steps do not count: the first node is never farther than the third.
    for _ in range(100):
        count_blocked(trees, 0, 0)
        count_blocked(trees, 0, 1)
    assert nearest(scene, trees, 0, target) == 0


def test_the_planner_counts_the_steps_that_are_blocked(scene):
    work, trees = prepared(walled(drake_arm("pr2 left").chain))[1], new_trees(0)
    assert connect(scene, work, trees, SWING[:1], SWING[1:], 3000, 0) > 0
    blocked = [trees.failures[side, : trees.nodes[side]] for side in range(2)]
    assert sum(int(one.sum()) for one in blocked) > 0
    for side in range(2):
        counted = np.minimum(blocked[side], COUNTED)
        # The same sum of the same numbers in single precision: not a bit differs.
        np.testing.assert_array_equal(
            trees.penalty[side, : trees.nodes[side]], np.float32(1.0 + BLOCKED * counted)
        )

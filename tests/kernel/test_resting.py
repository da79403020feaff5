"""The arm at rest at a stop: kernel against plain-loop reference."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.scores import BODY_BLOCKED
from tests.chosen import some_of
from tests.kernel.judge import chain_of
from tests.kernel.shapes import random_joints
from tests.kernel.toy import scores_of, size_of, toy_grid, toy_scene
from tests.reference.pairs import placed_scene


@pytest.mark.parametrize("seed", some_of(range(6), 0, 1))
def test_a_configuration_counts_where_the_arm_is_free_in_a_rest_posture(lowered, seed):
    rng, grid = np.random.default_rng(seed), toy_grid()
    scene = toy_scene(chain_of(seed, lowered), seed, obstacles=12)
    rests = np.array([random_joints(rng, scene.chain) for _ in range(2)])
    unchecked = scores_of(scene, grid)
    blocked = [np.any(unchecked.reason == BODY_BLOCKED, axis=1)]
    for count in (1, 2):
        resting = scene._replace(rest=rests[:count])
        scores = scores_of(resting, grid)
        found = np.any(scores.reason == BODY_BLOCKED, axis=1)
        for h in range(size_of(grid)):
            placed, expected = placed_scene(resting, grid, h, 0)
            if placed.clearance > 1e-6:  # at contact, rounding decides
                assert found[h] == expected, h
        for name in ("reason", "contact", "dexterity", "joints"):
            of_free = getattr(scores, name)[~found]
            np.testing.assert_array_equal(of_free, getattr(unchecked, name)[~found])
        blocked.append(found)
    never, of_one, of_two = blocked
    assert np.all(never <= of_two)
    assert np.all(of_two <= of_one)
    assert of_two.sum() < of_one.sum() < size_of(grid)

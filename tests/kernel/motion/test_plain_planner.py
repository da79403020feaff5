"""The compiled planner against a plain one: it finds a path wherever that one does."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tcs.kernel.motion.connect import connect
from tcs.kernel.motion.edges import NO_PAIR, posture_contact
from tcs.kernel.motion.search_trees import new_trees
from tests.chosen import some_of
from tests.kernel.arms import drake_arm
from tests.kernel.motion.plain_planner import plain_path
from tests.kernel.motion.toys import toy, within_limits
from tests.reference.motion import is_free_along, least_excess, straight_curve


@pytest.fixture(scope="module")
def chain():
    return drake_arm("pr2 left").chain


@pytest.mark.parametrize("seed", some_of(range(12), 1))
def test_where_the_plain_planner_finds_a_path_the_compiled_one_does(chain, seed):
    scene, work, plain = toy(chain, seed, obstacles=9)

    def touches(q):
        return least_excess(plain, q) <= 0.0

    rng = np.random.default_rng(seed)
    drawn = (within_limits(rng, chain) for _ in itertools.count())
    free = (q for q in drawn if posture_contact(scene, work, q) == NO_PAIR)
    start, goal = next(free), next(free)
    low = np.where(np.isfinite(scene.limits.lower), scene.limits.lower, -np.pi)
    high = np.where(np.isfinite(scene.limits.upper), scene.limits.upper, np.pi)
    simple = plain_path(touches, low, high, start, goal, seed)
    trees = new_trees(seed)
    count = connect(scene, work, trees, start[None], goal[None], 5000, 20)
    assert count > 0 or simple is None
    if count == 0:
        return
    path = trees.path[:count]
    for a, b in itertools.pairwise(path):
        assert is_free_along(straight_curve(a, b), 25, touches)

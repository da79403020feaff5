import numpy as np
import pytest

from tcs.placement.tables import tc_manipulability, tc_reachability
from tests.placement.tables.small import random_scores, set_scores, small_grid


def test_reachability_is_the_weighted_fraction():
    reached = np.array([[True, False, True], [False, False, False], [True, True, True]])
    np.testing.assert_array_equal(
        tc_reachability(reached, np.array([0.5, 0.25, 0.25])), [0.75, 0.0, 1.0]
    )


def test_manipulability_is_the_weighted_dexterity():
    dexterity = np.array([[0.5, 0.25], [0.0, 0.0]], dtype=np.float32)
    np.testing.assert_array_equal(tc_manipulability(dexterity, np.array([0.5, 0.5])), [0.375, 0.0])


def test_sums_are_those_of_plain_loops_to_the_last_bit():
    grid = small_grid()
    scores = random_scores(grid, 7, seed=3)
    for h in range(grid.size):
        expected = set_scores(scores, (h,))
        assert (scores.reachability()[h], scores.manipulability()[h]) == expected


@pytest.mark.parametrize("seed", range(5))
def test_growing_a_set_never_lowers_a_score(seed):
    grid = small_grid()
    scores = random_scores(grid, 5, seed)
    rng = np.random.default_rng(seed)
    for _ in range(50):
        a, b = rng.integers(0, grid.size, 2)
        alone, both = set_scores(scores, (a,)), set_scores(scores, (a, b))
        assert both[0] >= alone[0]
        assert both[1] >= alone[1]

import math

import numpy as np
import pytest

from tcs.errors import SelectionError
from tcs.placement.selection import UtilityWeights, utility


def test_utility_is_equation_five():
    weights = UtilityWeights(reachability=2.0, manipulability=4.0, travel=0.5)
    assert utility(0.5, 0.25, 3.0, weights) == 2.0 * 0.5 + 4.0 * 0.25 - 0.5 * 3.0
    many = utility(np.array([0.5, 1.0]), np.array([0.25, 0.0]), np.array([3.0, 2.0]), weights)
    np.testing.assert_array_equal(many, [0.5, 1.0])


def test_by_default_a_metre_costs_five_percent_of_a_task():
    weights = UtilityWeights()
    assert (weights.reachability, weights.manipulability, weights.travel) == (1.0, 1.0, 0.05)


@pytest.mark.parametrize("value", [-1e-9, math.nan, math.inf, 2e9, "1", "", None, True])
@pytest.mark.parametrize(
    ("name", "greek"),
    [("reachability", "alpha"), ("manipulability", "beta"), ("travel", "gamma")],
)
def test_impossible_weights_are_refused(name, greek, value):
    with pytest.raises(SelectionError, match=f"Weight {greek}"):
        UtilityWeights(**{name: value})


def test_numpy_numbers_are_weights_too():
    assert UtilityWeights(travel=np.float32(0.5)).travel == 0.5
    assert UtilityWeights(travel=np.int64(2)).travel == 2

import dataclasses

import numpy as np
import pytest

from tcs.model.grid import InitialConfiguration
from tcs.placement.scoring.sets import build_sets
from tcs.placement.selection import SelectionTables, TravelWeights, UtilityWeights, select
from tcs.placement.tables import BaseLattice
from tcs.placement.tables.sets import MOVES
from tests.placement.tables.small import random_scores, small_grid

GRID = small_grid(nx=5, ny=3, torsos=1)
"""x from -0.7 to 0.1 m, y from 0.1 to 0.5 m."""


def lattice(wall):
    """Two positions beyond the grid all around, with a wall across at x = -0.3 m."""
    free = np.ones((9, 7), dtype=np.bool_)
    free[4, wall] = False
    moves = np.zeros((4, 9, 7), dtype=np.bool_)
    for move, (dx, dy) in enumerate(MOVES):
        for i, j in np.ndindex(9, 7):
            if 0 <= i + dx < 9 and 0 <= j + dy < 7:
                moves[move, i, j] = free[i, j] and free[i + dx, j + dy]
    return BaseLattice(start=(-1.1, -0.3), step=(0.2, 0.2), moves=moves)


def selected(wall, route="around", **here):
    """The single on the far side of the wall from x = -0.6 m, the nearest to the right edge."""
    scores = random_scores(GRID, 2, seed=0, share=1.0)
    sets = dataclasses.replace(build_sets(scores, GRID), lattice=lattice(wall))
    values = {"base_x": -0.6, "base_y": 0.3, "base_yaw": 0.0, "torso": 0.0} | here
    return select(
        SelectionTables(sets, GRID),
        InitialConfiguration(**values),
        weights=UtilityWeights(travel=0.0),
        travel=TravelWeights(route=route),
    )


@pytest.fixture(scope="module")
def far():
    """A choice across the wall; without a cost of travel the wall does not change it."""
    choice = selected(slice(0, 0))
    assert any(member.base_x > -0.2 for member in choice.members)
    return choice


def test_a_path_inside_the_grid_causes_no_warning(far):
    assert far.warnings == ()
    assert selected(slice(3, 7)).indices == far.indices
    assert selected(slice(3, 7)).warnings == ()


def test_a_path_that_leaves_the_grid_is_reported(far):
    choice = selected(slice(2, 7))
    assert choice.indices == far.indices
    (warning,) = choice.warnings
    assert "leaves the scored grid (x -0.7 to 0.1 m, y 0.1 to 0.5 m) at (" in warning
    assert "-0.10) m" in warning
    assert selected(slice(2, 7), route="straight").warnings == ()


def test_a_path_from_outside_is_reported():
    (warning,) = selected(slice(0, 0), base_x=2.0).warnings
    assert "starts outside the scored grid" in warning

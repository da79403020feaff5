import numpy as np
import pytest

from tcs.errors import GridError
from tcs.placement.tables import Reason
from tcs.placement.tables.place_map import PlaceMap, best_per_place, rows_of_state
from tests.placement.tables.small import random_scores, small_grid

GRID = small_grid(nx=3, ny=2, bed=2, head=2)
SCORES = random_scores(GRID, 4, seed=3, share=0.3)


def assert_best_of(places, rows):
    """Check every position against plain loops over the rows."""
    reachability, manipulability = SCORES.reachability(), SCORES.manipulability()
    for i, x in enumerate(places.x):
        for j, y in enumerate(places.y):
            here = [
                h
                for h in rows
                if (GRID.configuration(h).base_x, GRID.configuration(h).base_y) == (x, y)
            ]
            assert places.reachability[i, j] == max(reachability[h] for h in here)
            assert places.manipulability[i, j] == max(manipulability[h] for h in here)
            blocked = [np.any(SCORES.reason[h] == Reason.BODY_BLOCKED) for h in here]
            assert places.free[i, j] == (not all(blocked))


def test_map_holds_the_best_of_each_position():
    assert_best_of(PlaceMap.of(SCORES, GRID), range(GRID.size))


@pytest.mark.parametrize("state", range(4))
def test_map_of_a_state_holds_the_best_within_it(state):
    size = GRID.size // 4
    rows = range(state * size, (state + 1) * size)
    assert_best_of(PlaceMap.of_state(SCORES, GRID, state), rows)


@pytest.mark.parametrize("state", [None, 0, 3])
def test_any_value_can_be_mapped(state):
    # What a viewer colours besides the two scores: here, the number of each configuration.
    rows = rows_of_state(GRID, state)
    numbers = np.arange(GRID.size)[rows]
    best = best_per_place(GRID, numbers, state)
    places = {}
    for h in numbers.tolist():
        at = GRID.configuration(h)
        places[at.base_x, at.base_y] = max(h, places.get((at.base_x, at.base_y), 0))
    x, y = (GRID.axis(name).values for name in ("base_x", "base_y"))
    assert best.tolist() == [[places[p, q] for q in y] for p in x]


@pytest.mark.parametrize("state", [-1, 4])
def test_a_state_that_does_not_exist_is_refused(state):
    with pytest.raises(GridError, match=f"no state {state} of the environment: it has 4"):
        rows_of_state(GRID, state)


def test_map_has_the_shape_of_the_grid():
    grid = small_grid(nx=5, ny=3)
    places = PlaceMap.of(random_scores(grid, 2, seed=0), grid)
    assert places.reachability.shape == places.manipulability.shape == places.free.shape == (5, 3)
    assert (len(places.x), len(places.y)) == (5, 3)

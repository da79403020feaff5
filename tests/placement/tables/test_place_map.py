import numpy as np

from tcs.output.draw import PlaceMap
from tcs.placement.tables import Reason
from tests.placement.tables.small import random_scores, small_grid


def test_map_holds_the_best_of_each_place():
    grid = small_grid(nx=3, ny=2, bed=2, head=2)
    scores = random_scores(grid, 4, seed=3, share=0.3)
    places = PlaceMap.of(scores, grid)
    reachability, manipulability = scores.reachability(), scores.manipulability()
    for i, x in enumerate(places.x):
        for j, y in enumerate(places.y):
            here = [
                h
                for h in range(grid.size)
                if (grid.configuration(h).base_x, grid.configuration(h).base_y) == (x, y)
            ]
            assert places.reachability[i, j] == max(reachability[h] for h in here)
            assert places.manipulability[i, j] == max(manipulability[h] for h in here)
            blocked = [np.any(scores.reason[h] == Reason.BODY_BLOCKED) for h in here]
            assert places.free[i, j] == (not all(blocked))


def test_map_has_the_shape_of_the_grid():
    grid = small_grid(nx=5, ny=3)
    places = PlaceMap.of(random_scores(grid, 2, seed=0), grid)
    assert places.reachability.shape == places.manipulability.shape == places.free.shape == (5, 3)
    assert (len(places.x), len(places.y)) == (5, 3)

"""Nodes that lead to the end of the line, after some are closed."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.approach.grid import (
    NOWHERE,
    PIECES,
    LineGrid,
    close_node,
    find_onward,
    new_grid,
)
from tcs.kernel.cache import jit

BRANCH, COLUMNS = 3, 60


@jit
def filled(grid: LineGrid, columns: int, most: int) -> None:
    find_onward(grid, BRANCH, columns, most)


@jit
def closed(grid: LineGrid, level: int, column: int, columns: int, most: int) -> None:
    close_node(grid, BRANCH, level, column, columns, most)


def random_grid(rng, fraction):
    grid = new_grid()
    grid.is_open[BRANCH, :, :COLUMNS] = rng.random((PIECES + 1, COLUMNS)) < fraction
    for level in range(PIECES + 1):
        at = np.flatnonzero(grid.is_open[BRANCH, level])
        grid.spans[BRANCH, level] = at[0], at[-1]
    return grid


def test_open_nodes_lead_to_the_nearest_ones_that_lead_on(rng):
    grid = random_grid(rng, 0.3)
    filled(grid, COLUMNS, 4)
    onward = grid.onward[BRANCH, :, :COLUMNS]
    for level in range(PIECES):
        ahead = np.flatnonzero(onward[level + 1] != NOWHERE)
        for i in range(COLUMNS):
            near = ahead[np.argsort(np.abs(ahead - i), kind="stable")]
            leads = grid.is_open[BRANCH, level, i] and abs(near[0] - i) <= 4
            assert onward[level, i] == (near[0] if leads else NOWHERE)


@pytest.mark.parametrize("most", [1, 5])
def test_closing_a_node_leaves_what_a_new_search_finds(rng, most):
    for _ in range(20):
        grid = random_grid(rng, rng.uniform(0.2, 0.6))
        filled(grid, COLUMNS, most)
        for _ in range(30):
            level = int(rng.integers(PIECES + 1))
            column = int(rng.choice(np.flatnonzero(grid.is_open[BRANCH, level])))
            closed(grid, level, column, COLUMNS, most)
            kept = grid.onward[BRANCH, :, :COLUMNS].copy()
            filled(grid, COLUMNS, most)
            np.testing.assert_array_equal(kept, grid.onward[BRANCH, :, :COLUMNS])
            if min(grid.is_open[BRANCH].sum(axis=1)) == 0:
                break

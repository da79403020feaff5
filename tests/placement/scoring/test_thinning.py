"""Candidates that can matter: what they stand for, and that no best set is lost with the others."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from tcs.errors import StoreError
from tcs.placement.scoring import sets as set_building
from tcs.placement.scoring.sets import build_sets
from tcs.placement.scoring.thinning import TILE, TOLERANCE
from tcs.placement.store import StateTables
from tests.placement.tables.small import all_sets, random_scores, small_grid

TABLES = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 2**32 - 1),
        "goals": st.integers(1, 6),
        "levels": st.sampled_from([0, 1, 2, 4]),
        "share": st.sampled_from([0.05, 0.3, 0.7, 1.0]),
    }
)


def thinned(scores, grid, **options):
    """The sets as of a table with too many candidates."""
    most = set_building.MOST_CANDIDATES
    set_building.MOST_CANDIDATES = 0
    try:
        return build_sets(scores, grid, **options)
    finally:
        set_building.MOST_CANDIDATES = most


@settings(deadline=None, max_examples=60)
@given(
    table=TABLES,
    step=st.sampled_from([0.02, 0.05, 0.2]),
    min_distance=st.sampled_from([0.0, 0.05, 0.2, 0.4]),
    bed=st.sampled_from([0, 2]),
    same_environment=st.booleans(),
)
def test_the_best_set_is_that_of_all_sets(table, step, min_distance, bed, same_environment):
    grid = small_grid(step=step, bed=bed)
    scores = random_scores(grid, **table)
    sets = thinned(scores, grid, min_distance=min_distance, same_environment=same_environment)
    every = all_sets(scores, grid, min_distance, "paper", same_environment)
    if not every:
        assert sets.sets == 0
        return
    greatest = max(sum(both) for both in every.values())
    assert sum(sets.scores_of(sets.best)) == greatest
    assert every[sets.best] == sets.scores_of(sets.best)
    best_single = max(sum(both) for members, both in every.items() if len(members) == 1)
    assert sum(sets.scores_of(sets.best_single)) == best_single
    # The rule compares with the same best single, so every kept set is one of all.
    greatest_single = max(both[1] for members, both in every.items() if len(members) == 1)
    assert sets.limits.manipulability == np.nextafter(greatest_single, np.inf)
    assert sets.sets <= len(every)
    assert sets.tile == TILE


@settings(deadline=None, max_examples=60)
@given(table=TABLES, step=st.sampled_from([0.02, 0.05, 0.2]), bed=st.sampled_from([0, 2]))
def test_a_candidate_nearby_stands_for_every_other_one(table, step, bed):
    grid = small_grid(step=step, bed=bed)
    scores = random_scores(grid, **table)
    sets = thinned(scores, grid, max_members=1)
    rows = sets.candidates
    at = grid.values(np.arange(grid.size))
    state = grid.state_of(np.arange(grid.size))
    for h in np.flatnonzero(scores.reached.any(axis=1)).tolist():
        near = np.hypot(at["base_x"][rows] - at["base_x"][h], at["base_y"][rows] - at["base_y"][h])
        same = (near < TILE * 2**0.5) & (state[rows] == state[h])
        reaches = scores.reached[rows] >= scores.reached[h]
        worth = scores.dexterity[rows] >= scores.dexterity[h] - np.float32(TOLERANCE)
        assert np.any(same & reaches.all(axis=1) & worth.all(axis=1))


def test_few_are_kept_where_all_reach_the_same():
    grid = small_grid(nx=40, ny=40, step=0.01)
    scores = random_scores(grid, 3, 5, levels=1, share=1.0)
    # 0.4 m by 0.4 m from -0.7 and 0.1 m on are 4 x 4 squares, or 5 x 5 cut by their borders.
    assert 16 <= len(thinned(scores, grid).candidates) <= 25 + 2


def test_tables_take_such_sets_and_no_others():
    grid = small_grid(nx=20, ny=20, step=0.01)
    scores = random_scores(grid, 3, 6)
    sets = thinned(scores, grid)
    assert len(sets.candidates) < np.count_nonzero(scores.reached.any(axis=1))
    assert StateTables.of(scores, sets).sets is sets
    other = random_scores(grid, 3, 7)
    with pytest.raises(StoreError, match="do not belong"):
        StateTables.of(other, sets)

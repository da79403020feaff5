"""The pool: neighbours on the grid stand for errors, and all its sets are compared by bits."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from tcs.placement.robustness import pool
from tcs.placement.robustness.kept_pairs import allowed_pairs
from tcs.placement.robustness.pool import best_sets, kept_by_neighbours, pool_of


def test_neighbours_within_two_spreads_are_weighed_plainly(chair_trials, rng):
    scored, grid = chair_trials.scored, chair_trials.grid
    kept = kept_by_neighbours(scored, grid)
    reached, sets = scored.scores.reached, scored.sets
    values = grid.values(np.arange(grid.size))
    for row in rng.choice(len(sets.candidates), 6, replace=False):
        here = {name: at[sets.candidates[row]] for name, at in values.items()}
        away = np.hypot(values["base_x"] - here["base_x"], values["base_y"] - here["base_y"])
        others = [name for name in values if name not in ("base_x", "base_y")]
        near = np.all([np.isclose(values[name], here[name]) for name in others], axis=0)
        near &= away <= 2 * pool.SPREAD + 1e-9
        weight = np.exp(-0.5 * (away[near] / pool.SPREAD) ** 2)
        np.testing.assert_allclose(kept[row], weight @ reached[near] / weight.sum(), atol=1e-12)


def test_the_pool_has_the_best_sets_and_few_neighbours(chair_trials):
    scored, grid = chair_trials.scored, chair_trials.grid
    sets = scored.sets
    assert np.array_equal(
        pool_of(scored, grid, len(sets.candidates)), np.arange(len(sets.candidates))
    )
    few = pool_of(scored, grid, 12)
    assert len(few) == 12
    assert np.all(np.diff(few) > 0)
    assert set(sets.best) <= set(sets.candidates[few].tolist())


@pytest.mark.parametrize("goals", [3, 17])
def test_all_pairs_are_compared(chair_trials, rng, goals):
    sets = chair_trials.scored.sets
    rows = np.sort(rng.choice(len(sets.candidates), 14, replace=False))
    reached = rng.uniform(size=(14, 40, goals)) < 0.85
    sets = _with_goals(sets, goals)
    found = best_sets(sets, rows, reached, 6)
    allowed = allowed_pairs(sets, rows, rows)
    pairs = [p for p in itertools.combinations(range(14), 2) if allowed[p]]
    rooms = {p: (reached[p[0]] | reached[p[1]]).all(axis=1).sum() for p in pairs}
    most = sorted(rooms.values(), reverse=True)[:6]
    chosen = [tuple(np.searchsorted(rows, pair)) for pair in found[2].tolist()]
    assert [rooms[p] for p in chosen[:6]] == most
    singles = reached.all(axis=2).sum(axis=1)
    (best,) = np.searchsorted(rows, found[1][0])
    assert singles[best] == singles.max()


def _with_goals(sets, goals):
    """Return the table with another number of goals, all reached by all: weights matter alone."""
    count = len(sets.candidates)
    return replace(
        sets,
        weights=np.full(goals, 1.0 / goals),
        reached=np.ones((count, goals), np.bool_),
        dexterity=np.ones((count, goals), np.float32),
    )

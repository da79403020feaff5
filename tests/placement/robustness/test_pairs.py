"""Kept pairs, enumerated and drawn, against a plain loop over all pairs."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import stats

from tcs.errors import SelectionError, TcsError
from tcs.placement.robustness import kept_pairs as pairs_module
from tcs.placement.robustness.kept_pairs import Pairs, kept_pairs, uniform_sets
from tcs.placement.scoring.sets import build_sets
from tests.placement.tables.small import random_scores, small_grid

GRID = small_grid(nx=6, ny=4, bed=2)
OPTIONS = ({}, {"rule": "code2015"}, {"same_environment": True}, {"min_distance": 0.0})


def table(seed=1, **options):
    return build_sets(random_scores(GRID, 5, seed=seed, share=0.4), GRID, **options)


def by_hand(sets):
    """Every kept pair with its scores, from the definition."""
    limits, xy = sets.limits, sets.cell_xy[sets.cell]
    for a, b in itertools.combinations(range(len(sets.candidates)), 2):
        if np.hypot(*(xy[a] - xy[b])) < sets.min_distance - 1e-9:
            continue
        if sets.same_environment and sets.state[a] != sets.state[b]:
            continue
        pair = tuple(int(sets.candidates[i]) for i in (a, b))
        r, m = sets.scores_of(pair)
        larger = max(sets.single_manipulability[a], sets.single_manipulability[b])
        if m >= limits.manipulability and r >= limits.reachability and m >= limits.gain * larger:
            yield a, b, r, m


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("chunk", [1, 10**6])
def test_all_kept_pairs(options, chunk, monkeypatch):
    monkeypatch.setattr(pairs_module, "CHUNK", chunk)
    sets = table(**options)
    found = Pairs.joined(kept_pairs(sets))
    rows = zip(*(found.first, found.second, found.reachability, found.manipulability), strict=True)
    assert sorted(rows) == sorted(by_hand(sets))
    assert len(found.first) == sets.kept_pairs


@pytest.mark.parametrize("what", ["least_reachability", "least_sum"])
def test_only_pairs_with_the_least_scores(what):
    sets = table()
    scores = sorted({r if what == "least_reachability" else r + m for _, _, r, m in by_hand(sets)})
    least = {what: scores[len(scores) // 2]}
    found = Pairs.joined(kept_pairs(sets, **least))
    expected = [
        (a, b)
        for a, b, r, m in by_hand(sets)
        if r >= least.get("least_reachability", 0.0) and r + m >= least.get("least_sum", 0.0)
    ]
    assert 0 < len(expected) < sets.kept_pairs
    assert sorted(zip(found.first.tolist(), found.second.tolist(), strict=True)) == expected


@pytest.mark.parametrize("members", [1, 2])
def test_sets_are_drawn_uniformly_from_all_of_equal_reachability(members):
    sets = table()
    count = 20_000
    drawn, choices = uniform_sets(sets, members, count, 0)
    singles = list(enumerate(sets.single_reachability))
    pool = [((a, b), r) for a, b, r, _ in by_hand(sets)]
    if members == 1:
        pool = [((a,), r) for a, r in singles]
    greatest = max(r for _, r in (singles if members == 1 else [*singles, *pool]))
    expected = {
        tuple(int(sets.candidates[i]) for i in rows) for rows, r in pool if r >= 0.98 * greatest
    }
    sampled, counts = np.unique(drawn, axis=0, return_counts=True)
    assert {tuple(map(int, row)) for row in sampled} == expected
    assert choices == len(expected) > 1
    # p below 0.001 occurs once in a thousand for a uniform draw; the seed is fixed.
    assert stats.chisquare(counts).pvalue > 1e-3
    assert np.array_equal(uniform_sets(sets, members, count, 0)[0], drawn)


def test_without_kept_pairs_none_is_drawn():
    sets = table(max_members=1)
    assert Pairs.joined(kept_pairs(sets)).first.size == 0
    with pytest.raises(SelectionError, match="No set of 2"):
        uniform_sets(sets, 2, 10, 0)
    with pytest.raises(TcsError, match="members is 3"):
        uniform_sets(sets, 3, 10, 0)

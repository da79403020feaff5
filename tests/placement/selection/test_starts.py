"""What selections of one kind share: the answers are those of the search, without it."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.placement.constraints import Constraints
from tcs.placement.scoring.sets import build_sets
from tcs.placement.selection import (
    SelectionTables,
    TravelWeights,
    UtilityWeights,
    best,
    select,
    starts,
)
from tests.placement.selection.test_choice import floor_with_walls
from tests.placement.tables.small import random_scores, small_grid

PREFERRED = Constraints(prefer=("base_yaw = 120 deg",))


@pytest.fixture(scope="module")
def sets_and_grid():
    grid = small_grid(nx=12, ny=8, yaws=3, torsos=1, bed=2, step=0.15)
    scores = random_scores(grid, 6, 3, levels=4, share=0.2)
    return build_sets(scores, grid, max_members=3), grid


@pytest.fixture
def tables(sets_and_grid):
    return SelectionTables(*sets_and_grid)


def at(x: float, y: float, bed: float = 0.0) -> InitialConfiguration:
    return InitialConfiguration(
        base_x=x, base_y=y, base_yaw=0.0, torso=0.0,
        environment=(("bed_height", bed),), environment_units=("m",),
    )  # fmt: skip


def places(count: int) -> list[InitialConfiguration]:
    where = np.random.default_rng(5).uniform(-2.5, 2.5, (count, 2))
    return [at(*xy, bed=0.15 * (i % 2)) for i, xy in enumerate(where)]


def same(one, other) -> bool:
    return dataclasses.replace(one, seconds=0.0) == dataclasses.replace(other, seconds=0.0)


@pytest.mark.parametrize(
    "asked",
    [
        {},
        {"weights": UtilityWeights(travel=0.0)},
        {"weights": UtilityWeights(reachability=0.2, travel=1.0, environment=0.3)},
        {"constraints": PREFERRED},
        {"travel": TravelWeights(metre=2.0, route="around"), "max_members": 2},
        {"max_members": 1},
    ],
    ids=["default", "free travel", "environment", "preference", "around", "single"],
)
def test_answers_are_those_of_the_search(sets_and_grid, tables, asked, monkeypatch):
    shared = [select(tables, here, **asked) for here in places(60)]
    monkeypatch.setattr(best, "starts_of", lambda *_: None)
    alone = SelectionTables(*sets_and_grid)
    assert all(
        same(one, select(alone, here, **asked))
        for one, here in zip(shared, places(60), strict=True)
    )


def test_places_from_which_other_cells_are_reached(sets_and_grid, monkeypatch):
    sets, grid = sets_and_grid
    walled = dataclasses.replace(sets, lattice=floor_with_walls(grid, 5, 0.65))
    tables, alone = SelectionTables(walled, grid), SelectionTables(walled, grid)
    around, outcomes, unreachable = TravelWeights(route="around"), [], set()
    x, y = (grid.axis(name).values for name in ("base_x", "base_y"))
    within = np.random.default_rng(2).uniform((x[0], y[0]), (x[-1], y[-1]), (60, 2))
    for here in [at(*xy) for xy in (*within, *within)]:
        try:
            choice = select(tables, here, travel=around)
        except SelectionError:
            continue
        outcomes.append((here, choice))
        unreachable.add(choice.unreachable)
    assert len(unreachable) > 2
    monkeypatch.setattr(best, "starts_of", lambda *_: None)
    assert all(same(select(alone, here, travel=around), choice) for here, choice in outcomes)


def test_the_search_is_needed_for_few(tables, monkeypatch):
    searched = []
    whole_search = best.best_set
    monkeypatch.setattr(best, "best_set", lambda *a: searched.append(1) or whole_search(*a))
    for here in places(100):
        select(tables, here)
    assert len(searched) < 40  # twice for each place without what is kept
    del searched[:]
    for here in places(100):
        select(tables, here)
    assert not searched


@pytest.mark.parametrize(
    "asked",
    [
        {"travel": TravelWeights(turn=0.1)},
        {"weights": UtilityWeights(travel=2.0 * starts.MOST)},
        {"constraints": Constraints(only=("base_x <= 0",))},
    ],
    ids=["turns", "large weights", "constraints"],
)
def test_other_kinds_share_nothing(tables, asked):
    for here in places(3):
        select(tables, here, **asked)
    assert not any(tables.index.starts.values())


def test_many_ties_are_left_to_the_search(tables, monkeypatch):
    expected = [select(tables, here) for here in places(20)]
    monkeypatch.setattr(starts, "MOST_NEAR", 0)
    other = SelectionTables(tables.sets, tables.grid)
    assert all(
        same(select(other, here), one) for here, one in zip(places(20), expected, strict=True)
    )


def test_the_kinds_that_are_kept_are_the_latest(tables):
    for number in range(2 * starts.KEPT):
        select(tables, at(0.5, 0.5))
        select(tables, at(0.5, 0.5), weights=UtilityWeights(travel=0.1 + number))
    assert len(tables.index.starts) == starts.KEPT
    assert UtilityWeights() in [kind[0] for kind in tables.index.starts]


def test_threads_share_them(sets_and_grid, tables):
    here = places(200)
    alone = SelectionTables(*sets_and_grid)
    expected = [select(alone, one) for one in here]
    with ThreadPoolExecutor(8) as pool:
        assert all(map(same, pool.map(lambda one: select(tables, one), here), expected))


def test_sets_that_only_rounding_tells_apart_are_compared_exactly():
    # Utilities of two sets that are equal but for rounding, by the operations of the search.
    rng, travel, differ = np.random.default_rng(0), 0.05, 0
    for _ in range(300):
        gains, leg, here = rng.uniform(1.0, 2.0, 2), rng.uniform(0.5, 2.0, 2), rng.uniform(0.0, 3.0)
        here_to_cell = np.array([here, here + (gains[1] - gains[0]) / travel + leg[0] - leg[1]])
        kept = [
            starts.KeptSet((cell,), gains[cell], 0.0, ((cell, (leg[cell],)),)) for cell in (0, 1)
        ]
        cells = starts.StartCells(np.full(2, starts.FAR), lambda cell, kept=kept: [kept[cell]])
        net = [one.net(here_to_cell, travel) for one in kept]
        near = cells.near(here_to_cell, travel, -np.inf)
        assert near is not None
        assert {(one,) for one in np.flatnonzero(np.array(net) == max(net))} <= {
            one.members for one in near
        }
        differ += net[0] != net[1]
    assert differ > 50

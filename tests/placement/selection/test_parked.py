"""Selection of sets whose stops may be off: against an exhaustive search, with windows made up."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from tcs.errors import SelectionError
from tcs.placement.constraints import Constraints, Region
from tcs.placement.selection import Top, UtilityWeights, select
from tcs.placement.selection.parked import MOST_SETS
from tcs.placement.tables import Window, WindowTable
from tests.placement.store.example import score_file
from tests.placement.tables.small import all_sets, small_grid

LEAST = (0.05, 0.05, 3.0)
WANTED = Window.wanted(LEAST)
SCORES_ONLY = UtilityWeights(travel=0.0, places=0.0, environment=0.0)


class MadeUp:
    """Finds windows that are made up: of a configuration and goal, a multiple of what is wanted."""

    def __init__(self, file, seed, share):
        rng = np.random.default_rng(seed)
        grid = file.configurations
        self.scale = np.where(rng.random((grid.size, 5)) < share, 1.5, 0.5)
        self.values = np.stack([*grid.values(np.arange(grid.size)).values()], axis=1)
        self.calls = 0

    def of(self, stop):
        h = int(np.argmin(np.abs(self.values - stop.values).max(axis=1)))
        return self.scale[h]

    def __call__(self, file, table, stop, least):
        self.calls += 1
        scale, found = self.of(stop), WindowTable.empty(stop.values.size, 5)
        wanted, least = least, WANTED if least is None else least
        if np.all(scale[stop.goals] >= 1.0):
            half = scale[stop.goals].min() * np.array(least)
            return found.added(stop.values, stop.goals, half, held=True)
        if wanted is None:
            return found.added(stop.values, stop.goals, (0.0, 0.0, 0.0), held=True)
        for goal in np.flatnonzero(stop.goals & (scale < 1.0)):
            mask = np.arange(5) == goal
            found = found.added(stop.values, mask, 0.5 * np.array(least), held=False)
        return found


def served(scores, members):
    """The goals that each member of a set serves, by plain loops."""
    found = {h: [] for h in members}
    for g in range(scores.goals):
        able = [h for h in members if scores.reached[h, g]]
        if able:
            found[max(able, key=lambda h: (scores.dexterity[h, g], -members.index(h)))].append(g)
    return found


def exhaustive(file, finder, key):
    """The best of all sets each of whose members has what is wanted for the goals it serves."""
    scores, best = file.nominal.scores, None
    kept = all_sets(scores, file.configurations, file.nominal.sets.min_distance)
    for members, both in kept.items():
        holds = all(
            finder.scale[h, g] >= 1.0 for h, of in served(scores, members).items() for g in of
        )
        if holds and (best is None or key(members, both) > key(best[0], best[1])):
            best = members, both
    return best


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("share", [0.3, 0.7])
def test_the_best_set_of_those_that_hold_is_selected(seed, share):
    file = score_file(grid=small_grid(nx=3, ny=2, bed=2))
    finder = MadeUp(file, seed, share)

    def by_goals(members, both):
        return round(both[0], 9), -len(members), both[1]

    def by_utility(_, both):
        return both[0] + both[1]

    for weights, key in ((None, by_goals), (SCORES_ONLY, by_utility)):
        expected = exhaustive(file, finder, key)
        found = select(file, weights=weights, parking=LEAST, find_windows=finder)
        assert found.indices == expected[0]
        assert all(window.holds(WANTED) for window in found.windows)
        assert found.parking.sets >= 1


def test_a_window_that_is_too_small_makes_another_set_the_best():
    file = score_file()
    best = select(file)
    finder = MadeUp(file, 0, 1.0)
    assert select(file, parking=LEAST, find_windows=finder).indices == best.indices
    finder = MadeUp(file, 0, 1.0)
    finder.scale[list(best.indices)] = 0.5
    other = select(score_file(), parking=LEAST, find_windows=finder)
    assert other.indices != best.indices
    assert not set(other.indices) & set(best.indices)
    assert other.fewer is None
    assert other.to_json("isotropy")["parking"] == {
        "x": 0.05, "y": 0.05, "yaw_deg": 3.0, "sets_looked_at": other.parking.sets,
    }  # fmt: skip


def test_windows_that_were_found_are_not_looked_for_again():
    file, finder = score_file(), MadeUp(score_file(), 1, 0.3)
    first = select(file, parking=LEAST, find_windows=finder)
    calls = finder.calls
    # Nobody finds windows now: all is known, what is missed too.
    again = select(file, parking=LEAST)
    assert (again.indices, again.windows) == (first.indices, first.windows)
    assert finder.calls == calls
    assert again.parking.sets == 1
    assert first.parking.sets > 1


def test_stored_windows_are_shown_whatever_is_requested():
    file = score_file()
    assert select(file).windows == ()
    best = select(file, parking=LEAST, find_windows=MadeUp(file, 0, 1.0))
    shown = select(file)
    assert shown.windows == best.windows
    member = shown.to_json("isotropy")["members"][0]
    assert member["window"] == {"x": 0.075, "y": 0.075, "yaw_deg": 4.5}


def test_neighbours_on_the_grid_are_a_window_that_is_known():
    # The grid has steps of 0.2 m in x and y: each neighbour within the window reaches the goals.
    file = score_file(share=0.9)
    found = select(file, parking=(0.2, 0.0, 0.0), find_windows=MadeUp(file, 0, 1.0))
    grid, scores = file.configurations, file.nominal.scores
    for h, goals in served(scores, found.indices).items():
        at = grid.indices(h)
        for by in (-1, 1):
            to = at.copy()
            to[grid.axes.index(grid.axis("base_x"))] += by
            if 0 <= to[grid.axes.index(grid.axis("base_x"))] < grid.axis("base_x").count:
                assert scores.reached[int(grid.flat(to)), goals].all()


def test_without_any_the_error_names_the_nearest():
    file = score_file(grid=small_grid(nx=3, ny=2))
    finder = MadeUp(file, 0, 0.0)
    with pytest.raises(SelectionError) as raised:
        select(file, parking=LEAST, find_windows=finder)
    text = str(raised.value)
    assert "no set may be 5 cm off in x, 5 cm in y, 3 degrees in heading at every stop" in text
    assert "Of the nearest to it, the stop at (" in text
    assert "m may be less than 3 mm off" in text
    assert finder.calls <= 2 * MOST_SETS + 2


def test_what_windows_cannot_answer_is_refused():
    file = score_file()
    with pytest.raises(SelectionError, match="not known yet"):
        select(file, parking=LEAST)
    with pytest.raises(SelectionError, match="Leave 'top' out"):
        select(file, parking=LEAST, top=Top(count=2))
    for wrong in ((0.05, 0.05), (0.6, 0.05, 3.0), (0.05, -0.01, 3.0), (0.05, 0.05, 181.0)):
        with pytest.raises(SelectionError, match="half widths"):
            select(file, parking=wrong)
    with pytest.raises(SelectionError, match="half widths"):
        select(file, parking=(0.05, math.nan, 3.0))


def test_windows_belong_to_the_scene_as_it_was_scored():
    file = score_file()
    finder = MadeUp(file, 0, 1.0)
    select(file, parking=LEAST, find_windows=finder)
    # Where something is in the way that was not scored, the windows may be less.
    forbidden = Constraints(forbid=(Region(((9.0, 9.0), (9.5, 9.0), (9.0, 9.5))),))
    assert select(file, constraints=forbidden).windows == ()
    with pytest.raises(SelectionError, match="as it was scored"):
        select(file, parking=LEAST, constraints=forbidden, find_windows=finder)


def test_a_window_that_was_asked_for_is_shown_rather_than_a_larger_one():
    file = score_file()
    best = select(file, max_members=1)
    finder = MadeUp(file, 0, 1.0)
    select(file, max_members=1, parking=LEAST, find_windows=finder)
    table = file.nominal.known_windows
    stop = table.values[0], table.goals[0]
    file.nominal.keep_windows(table.added(*stop, (0.5, 0.01, 3.0), held=True))
    assert select(file, max_members=1).windows == (Window(0.5, 0.01, 3.0),)
    parked = select(file, max_members=1, parking=LEAST)
    assert parked.indices == best.indices
    assert parked.windows[0].holds(WANTED)
    assert dataclasses.replace(file).tables[0] is file.tables[0]


def test_of_nothing_requested_the_best_set_is_shown_with_its_windows():
    file, best = score_file(), select(score_file())
    finder = MadeUp(file, 0, 1.0)
    finder.scale[best.indices[0]] = 0.5
    found = select(file, parking=(0.0, 0.0, 0.0), find_windows=finder)
    assert found.indices == best.indices
    assert found.windows[0] == Window(0.0, 0.0, 0.0)
    assert all(min(window) > 0.0 for window in found.windows[1:])
    assert select(file).windows == found.windows
    assert found.parking.sets == 1

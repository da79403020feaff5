"""The search for a window, on regions of offsets whose largest windows are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tcs.placement.parking.search import FINENESS, PROPORTIONS, WindowSearch, lattice
from tcs.placement.tables import Window
from tcs.placement.tables.windows import MARGIN

POSES = 20_000


def search_in(region, goals=1):
    """The search where a goal is missed outside a region: a function of offsets (n, 3)."""

    def missed(offsets):
        return np.repeat(~region(offsets)[:, None], goals, axis=1)

    return WindowSearch(missed, missed, np.random.default_rng(0))


def box(x, y, yaw):
    return lambda offsets: np.all(np.abs(offsets) <= [x, y, yaw], axis=1)


def drawn_inside(window, rng):
    return rng.uniform(-1.0, 1.0, (POSES, 3)) * np.array(window)


@pytest.mark.parametrize(
    "sides", [(0.05, 0.05, 0.05), (0.3, 0.02, 0.1), (0.006, 0.4, 1.0), (0.04, 0.05, 3.0)]
)
def test_a_box_is_found_up_to_the_margin(sides):
    window = search_in(box(*sides)).window()
    for found, true in zip(window, sides, strict=True):
        # The bisection ends within the fineness; the margin is left off.
        assert (1.0 - MARGIN) / FINENESS * true * (1.0 - 1e-9) <= found <= true


def test_the_widest_window_is_the_cap():
    window = search_in(lambda offsets: np.ones(len(offsets), np.bool_)).window()
    np.testing.assert_allclose(window, (0.5, 0.5, math.pi), rtol=1e-12)


def test_where_the_stop_itself_is_at_a_limit_there_is_no_window():
    assert search_in(lambda offsets: offsets[:, 0] >= 0.0).window() is None
    assert search_in(box(0.001, 0.5, 3.0)).window() is None


REGIONS = {
    "ball": lambda o: np.sum((o / [0.06, 0.1, 0.2]) ** 2, axis=1) <= 1.0,
    "wall": lambda o: o[:, 0] + 0.3 * o[:, 1] + 0.1 * o[:, 2] <= 0.05,
    "post": lambda o: np.hypot(o[:, 0] - 0.08, o[:, 1] - 0.05) >= 0.03,
    "tilted slab": lambda o: np.abs(o[:, 0] - 0.5 * o[:, 2]) <= 0.04,
    "corner": lambda o: ~np.all(o > [0.03, 0.04, 0.03], axis=1),
}


@pytest.mark.parametrize("region", REGIONS.values(), ids=REGIONS.keys())
def test_nothing_is_missed_inside_and_something_just_outside(region, rng):
    window = search_in(region).window()
    assert np.all(region(drawn_inside(window, rng)))
    wider = np.minimum(1.25 * np.array(window), (0.5, 0.5, math.pi))
    assert not np.all(region(drawn_inside(wider, rng)))


def test_a_hole_between_the_places_of_the_lattice_is_met_by_random_poses(rng):
    # A ball of 1.2 cm is met by one random pose in some hundreds, and by no place of the lattice.
    centre = np.array([0.0191, 0.0187, 0.0093])

    def region(o):
        return (np.linalg.norm((o - centre), axis=1) > 0.006) & box(0.06, 0.06, 0.06)(o)

    search = search_in(region)
    window = search.window()
    assert np.all(region(drawn_inside(window, rng)))
    assert any(np.linalg.norm(np.array(miss.at) - centre) <= 0.006 for miss in search.misses)


def test_what_is_wanted_is_held_or_the_miss_says_why(rng):
    wanted = Window(0.1, 0.02, 0.02)
    # In the usual proportions the window would be 5 cm wide at first, and grow in heading.
    region = box(0.12, 0.03, 0.03)
    window = search_in(region).window(wanted)
    assert window.holds(wanted)
    search = search_in(box(0.105, 0.03, 0.03))
    assert search.window(wanted) is None
    wide = np.array(wanted) / (1.0 - MARGIN)
    assert search.misses
    assert all(np.all(np.array(miss.at) <= wide + 1e-12) for miss in search.misses)


def test_the_goals_that_are_missed_are_named():
    def missed(offsets):
        return np.stack([offsets[:, 0] > 0.02, np.zeros(len(offsets), np.bool_)], axis=1)

    search = WindowSearch(missed, missed, np.random.default_rng(0))
    assert search.window(PROPORTIONS) is None
    assert {miss.goals for miss in search.misses} == {(0,)}


def test_the_lattice_has_corners_first_and_places_inside():
    places = lattice(5)
    assert np.all(np.abs(places[:8]) == 1.0)
    assert np.all(np.count_nonzero(np.abs(places[8:26]) == 1.0, axis=1) >= 1)
    assert np.any(np.abs(places).max(axis=1) < 1.0)
    assert len(np.unique(places, axis=0)) == len(places)

import itertools
import math

import numpy as np
import pytest

from tcs.errors import SelectionError, UnknownNameError
from tcs.model.grid import InitialConfiguration
from tcs.placement.scoring.sets import base_cells
from tcs.placement.selection import TravelWeights, shortest_tour
from tcs.placement.selection.distances import StraightDistances
from tcs.placement.selection.travel import legs_from
from tests.placement.tables.small import small_grid

GRID = small_grid(nx=3, ny=1, yaws=4, torsos=2, bed=2)


def legs(here, travel, flat):
    candidates = np.array(flat, dtype=np.int32)
    cell, xy = base_cells(GRID, candidates)
    return legs_from(here, GRID, candidates, cell, StraightDistances(xy), travel)


def state(yaw_deg=0.0, torso=0.0, bed=0.0):
    return InitialConfiguration(
        base_x=-0.7,
        base_y=0.1,
        base_yaw=math.radians(yaw_deg),
        torso=torso,
        environment=(("bed_height", bed),),
        environment_units=("m",),
    )


def test_by_default_only_driving_costs():
    everywhere = range(GRID.size)
    cost = legs(state(yaw_deg=77.0, torso=0.2, bed=0.12), TravelWeights(), everywhere).from_here
    # Grid steps of 0.2 m carry a rounding error of their own.
    np.testing.assert_allclose(cost, GRID.values(everywhere)["base_x"] + 0.7, atol=1e-15)


@pytest.mark.parametrize(
    ("yaw_deg", "expected_deg"),
    [(10, 10), (-10, 10), (350, 10), (190, 170), (180, 180), (-535, 175)],
)
def test_rotations_take_the_shorter_direction(yaw_deg, expected_deg):
    cost = legs(state(yaw_deg=yaw_deg), TravelWeights(turn=2.0), [0]).from_here
    # A few roundings of angles up to ten radians.
    assert cost[0] == pytest.approx(2.0 * math.radians(expected_deg), abs=1e-14)


def test_every_motion_has_its_weight():
    travel = TravelWeights(metre=10.0, turn=2.0, torso=3.0, environment=(("bed_height", 5.0),))
    there = int(GRID.flat([1, 2, 0, 1, 1]))  # bed 0.1, x 0.4 further, 90 deg, torso 0.15
    cost = legs(state(), travel, [there]).from_here
    expected = 10.0 * 0.4 + 2.0 * math.pi / 2 + 3.0 * 0.15 + 5.0 * 0.1
    # A dozen roundings of numbers below ten.
    assert cost[0] == pytest.approx(expected, abs=1e-14)


def test_costs_are_a_metric():
    travel = TravelWeights(metre=1.0, turn=0.7, torso=2.0, environment=(("bed_height", 3.0),))
    everywhere = np.arange(GRID.size)
    cost = legs(state(), travel, everywhere).between(everywhere[:, None], everywhere[None, :])
    np.testing.assert_array_equal(cost, cost.T)
    np.testing.assert_array_equal(np.diag(cost), 0.0)
    detour = (cost[:, :, None] + cost[None, :, :]).min(axis=1)
    # A detour through a third configuration is never shorter, up to rounding.
    assert np.all(cost <= detour + 1e-14)


def test_shortest_tour_tries_every_order():
    rng = np.random.default_rng(0)
    place = rng.normal(size=(5, 2))
    between = np.hypot(*(place[:, None] - place[None]).transpose(2, 0, 1))
    here = rng.normal(size=2)
    from_here = np.hypot(*(place - here).T)
    cost, order = shortest_tour(from_here, between)
    lengths = {
        visits: math.dist(here, place[visits[0]])
        + sum(math.dist(place[a], place[b]) for a, b in itertools.pairwise(visits))
        for visits in itertools.permutations(range(5))
    }
    assert order == min(lengths, key=lengths.get)
    # Six legs, each rounded twice.
    assert cost == pytest.approx(lengths[order], rel=1e-14)


def test_a_tie_keeps_the_first_order():
    assert shortest_tour([1.0, 1.0], np.array([[0.0, 2.0], [2.0, 0.0]])) == (3.0, (0, 1))


@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf, 1e10, "1", "", None, True])
@pytest.mark.parametrize("name", ["metre", "turn", "torso"])
def test_impossible_weights_are_refused(name, value):
    with pytest.raises(SelectionError, match=f"Weight of travel per {name} is"):
        TravelWeights(**{name: value})


def test_impossible_environment_weights_are_refused():
    with pytest.raises(SelectionError, match="along 'bed_height' is -1"):
        TravelWeights(environment=(("bed_height", -1),))
    with pytest.raises(SelectionError, match="twice"):
        TravelWeights(environment=(("bed_height", 1.0), ("bed_height", 2.0)))


def test_an_unknown_route_is_named():
    with pytest.raises(UnknownNameError, match=r"unknown route 'arround'.*Did you mean 'around'"):
        TravelWeights(route="arround")

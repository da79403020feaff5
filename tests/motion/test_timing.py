"""Timing against the limits, and the tour against all permutations."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tcs.motion.curves import Curve
from tcs.motion.timing import timed
from tcs.motion.tour import EXACT, REST, best_tour
from tests.motion.paths import bent, straight

VELOCITY, ACCELERATION = np.full(7, 2.0), np.full(7, 4.0)


@pytest.mark.parametrize(("length", "seconds"), [(0.25, 0.5), (3.0, 2.0)])
def test_a_straight_line_takes_the_time_of_a_trapezoid(length, seconds):
    # Without reaching the velocity limit 2 sqrt(s / a), else s / v + v / a. The intervals of the
    # parameter cost a little.
    duration = timed(straight(length), VELOCITY, ACCELERATION).duration
    assert seconds - 1e-9 <= duration < 1.02 * seconds


def test_samples_keep_the_limits_and_stop_at_both_ends():
    timing = timed(bent(), VELOCITY, ACCELERATION)
    np.testing.assert_array_equal(timing.positions[[0, -1]], bent().q[[0, -1]])
    assert np.all(timing.velocities[[0, -1]] == 0.0)
    assert np.all(np.abs(timing.velocities) <= VELOCITY + 1e-9)
    steps = np.diff(timing.times)[:, None]
    assert np.all(np.abs(np.diff(timing.velocities, axis=0) / steps) <= ACCELERATION + 1e-9)
    # Positions are the integral of the velocities, to the second order of the sampling step.
    mean = (timing.velocities[1:] + timing.velocities[:-1]) / 2
    np.testing.assert_allclose(np.diff(timing.positions, axis=0) / steps, mean, atol=0.1)


def test_random_curves_keep_the_limits(rng):
    for _ in range(20):
        knots = np.concatenate([[0.0], np.cumsum(rng.uniform(0.01, 1.0, 6))])
        curve = Curve(knots, rng.normal(size=(7, 7)), rng.normal(size=(7, 7)))
        timing = timed(curve, VELOCITY, ACCELERATION)
        assert np.all(np.abs(timing.velocities) <= VELOCITY * 1.001)
        rates = np.diff(timing.velocities, axis=0) / np.diff(timing.times)[:, None]
        assert np.all(np.abs(rates) <= ACCELERATION * 1.001)


def test_scaling_the_limits_scales_the_time():
    slow = timed(bent(), VELOCITY, ACCELERATION).duration
    fast = timed(bent(), 2.0 * VELOCITY, 4.0 * ACCELERATION).duration
    assert fast == pytest.approx(slow / 2.0, rel=1e-3)


def test_reversing_a_curve_reverses_its_points():
    curve = bent()
    back = curve.reverse()
    at = np.linspace(0.0, 1.0, 7)
    for piece in range(curve.pieces):
        np.testing.assert_allclose(
            back.points(curve.pieces - 1 - piece, at), curve.points(piece, 1.0 - at), atol=1e-12
        )


@pytest.mark.parametrize("goals", [1, 2, 4])
def test_the_tour_is_the_shortest_of_all(goals, rng):
    at = [rng.uniform(-1, 1, (size, 2)) for size in rng.integers(1, 4, goals)]

    def leg(a, b):
        starts, ends = (np.zeros((1, 2)) if g == REST else at[g] for g in (a, b))
        return np.linalg.norm(starts[:, None] - ends[None], axis=2)

    def length(tour):
        stops = [(REST, 0), *tour, (REST, 0)]
        return sum(leg(a, b)[m, n] for (a, m), (b, n) in itertools.pairwise(stops))

    tour = best_tour([len(postures) for postures in at], leg)
    assert sorted(goal for goal, _ in tour) == list(range(goals))
    orders = itertools.permutations(range(goals))
    choices = [
        length(list(zip(order, chosen, strict=True)))
        for order in orders
        for chosen in itertools.product(*(range(len(at[goal])) for goal in order))
    ]
    assert length(tour) == pytest.approx(min(choices))


def test_many_goals_are_each_visited_once(rng):
    at = rng.uniform(-1, 1, (EXACT + 3, 2))

    def leg(a, b):
        return np.array([[np.linalg.norm((a != REST) * at[a] - (b != REST) * at[b])]])

    tour = best_tour([1] * len(at), leg)
    assert sorted(goal for goal, _ in tour) == list(range(len(at)))
    assert best_tour([], leg) == ()

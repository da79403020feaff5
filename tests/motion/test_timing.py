"""Timing against the limits, and the tour against all permutations."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from tcs.motion.cubics import at_times, extremes
from tcs.motion.curves import Curve
from tcs.motion.limits import MotionLimits, rates
from tcs.motion.timing import SAMPLE_SECONDS, Timed, motion_along, timed
from tcs.motion.tour import EXACT, REST, best_tour
from tests.motion.paths import bent, straight

VELOCITY, ACCELERATION = np.full(7, 2.0), np.full(7, 4.0)
LIMITS = MotionLimits(VELOCITY, ACCELERATION, np.full(7, np.inf))


def motion(curve, limits=LIMITS):
    return motion_along(curve, limits, lambda _: True)


@pytest.mark.parametrize(("length", "seconds"), [(0.25, 0.5), (3.0, 2.0)])
def test_a_straight_line_takes_the_time_of_a_trapezoid(length, seconds):
    # Without reaching the velocity limit 2 sqrt(s / a), else s / v + v / a. The intervals of the
    # parameter cost a little.
    found = motion(straight(length))
    assert seconds - 1e-9 <= found.knots[-1] < 1.02 * seconds
    assert np.max(np.diff(found.knots)) <= SAMPLE_SECONDS + 1e-9


def assert_within(found, limits):
    """Check cubics against limits at many points between their knots, by scipy."""
    spline = CubicHermiteSpline(found.knots, found.q, found.dq)
    at = np.unique([np.linspace(a, b, 40) for a, b in itertools.pairwise(found.knots)])
    assert np.all(np.abs(spline(at, 1)) <= limits.velocity * (1.0 + 1e-9))
    assert np.all(np.abs(spline(at, 2)) <= limits.acceleration * (1.0 + 1e-9))
    assert np.all(spline(at) <= limits.upper + 1e-12)
    assert np.all(spline(at) >= limits.lower - 1e-12)


def test_the_cubics_keep_the_limits_and_stop_at_both_ends():
    found = motion(bent())
    np.testing.assert_array_equal(found.q[[0, -1]], bent().q[[0, -1]])
    assert np.all(found.dq[[0, -1]] == 0.0)
    assert_within(found, LIMITS)
    assert np.max(rates(found).acceleration) > 0.99 * ACCELERATION[0]


def test_random_curves_keep_the_limits_between_samples(rng):
    for _ in range(20):
        knots = np.concatenate([[0.0], np.cumsum(rng.uniform(0.01, 1.0, 6))])
        curve = Curve(knots, rng.normal(size=(7, 7)), rng.normal(size=(7, 7)))
        found = motion(curve)
        assert_within(found, LIMITS)
        assert found.knots[-1] < 1.05 * timed(curve, VELOCITY, ACCELERATION, 0.05).duration


def test_a_motion_along_a_joint_limit_does_not_cross_it():
    # The second joint arrives at its limit and rests there, as on lines of the tool.
    a, b = np.eye(7)[:2]
    q = np.array([0 * a, 0.5 * a + 0.1 * b, a + 0.1 * b])
    curve = Curve(np.array([0.0, 0.5, 1.0]), q, np.array([a + 0.4 * b, a, a]))
    limits = replace(LIMITS, upper=np.where(np.arange(7) == 1, 0.1, np.inf))
    assert_within(motion(curve, limits), limits)


def test_the_measure_of_a_check_finds_what_is_between_samples(rng):
    times = np.cumsum(np.append(0.0, rng.uniform(0.01, 0.1, 9)))
    timing = Timed(times, rng.normal(size=(10, 7)), rng.normal(size=(10, 7)))
    spline = CubicHermiteSpline(times, timing.positions, timing.velocities)
    at = np.unique([np.linspace(a, b, 2001)[:-1] for a, b in itertools.pairwise(times)])
    found, by_rates = extremes(timing), rates(Curve(times, timing.positions, timing.velocities))
    for one, expected in (
        (found.least, spline(at).min(axis=0)),
        (found.greatest, spline(at).max(axis=0)),
        (found.velocity, np.abs(spline(at, 1)).max(axis=0)),
        (found.acceleration, np.abs(spline(at, 2)).max(axis=0)),
        (by_rates.velocity.max(axis=0), found.velocity),
        (by_rates.acceleration.max(axis=0), found.acceleration),
    ):
        np.testing.assert_allclose(one, expected, rtol=2e-3, atol=1e-4)
    q, v = at_times(timing, at)
    np.testing.assert_allclose(q, spline(at), atol=1e-9)
    np.testing.assert_allclose(v, spline(at, 1), atol=1e-9)


def test_scaling_the_limits_scales_the_time():
    fast = replace(LIMITS, velocity=2.0 * VELOCITY, acceleration=4.0 * ACCELERATION)
    slow, quick = motion(bent()).knots[-1], motion(bent(), fast).knots[-1]
    assert quick == pytest.approx(slow / 2.0, rel=1e-3)


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

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcs.teleop import load_arm
from tcs.teleop.control.bounds import limit_rate_change, rate_bounds, scale_to_bounds, stops_in_time

PERIOD, ACCELERATION = 0.01, 5.0
CHANGE = PERIOD * ACCELERATION


@settings(max_examples=25, deadline=None)
@given(
    start=st.floats(-2.0, 2.0), before=st.floats(-3.0, 3.0), period=st.sampled_from([0.01, 0.02])
)
def test_a_joint_at_the_greatest_rate_stops_at_its_limit(iiwa, start, before, period):
    change = ACCELERATION * period
    joints, rates = np.full(7, start), np.full(7, before)
    lower, upper = rate_bounds(iiwa, joints, period, ACCELERATION)
    rates = np.clip(rates, lower, upper)
    for _ in range(600):
        lower, upper = rate_bounds(iiwa, joints, period, ACCELERATION)
        after, _ = limit_rate_change(rates, np.full(7, 3.0), change)
        if stops_in_time(iiwa, joints, after, period, ACCELERATION):
            assert ((after >= lower) & (after <= upper)).all()
        after = np.clip(after, lower, upper)
        # Sums of rates are rounded to 1e-15.
        assert np.abs(after - rates).max() <= change + 1e-12
        joints, rates = joints + period * after, after
        assert (joints <= iiwa.upper + 1e-12).all()
    # 4.1 rad at up to 3 rad/s take 2 s at most: all have arrived, and rest.
    np.testing.assert_allclose(joints, iiwa.upper, atol=1e-9)
    np.testing.assert_allclose(rates, 0.0, atol=1e-9)


def test_the_stopping_distance_is_the_distance_to_the_limit(iiwa):
    for n in range(1, 5):
        for part in (0.0, 0.3, 0.9):
            speeds = (np.arange(n, -1, -1) + part) * CHANGE
            room = PERIOD * speeds.sum()
            joints = iiwa.upper - room
            _, upper = rate_bounds(iiwa, joints, PERIOD, ACCELERATION)
            np.testing.assert_allclose(upper, speeds[0], rtol=1e-9)


def test_each_joint_may_have_its_own_acceleration(iiwa, ready):
    each = np.linspace(0.5, 5.0, 7)
    lower, upper = rate_bounds(iiwa, ready, PERIOD, each)
    for i, one in enumerate(each):
        alone = rate_bounds(iiwa, ready, PERIOD, float(one))
        assert (lower[i], upper[i]) == (alone[0][i], alone[1][i])


def test_a_joint_without_limits_is_not_held():
    arm = load_arm("pr2")
    lower, upper = rate_bounds(arm, np.zeros(7), PERIOD, ACCELERATION)
    assert (upper[~arm.bounded] > 100.0).all()
    assert (lower[~arm.bounded] < -100.0).all()


def test_all_joints_slow_down_by_one_factor():
    rates = np.array([1.0, -2.0, 0.0, 0.5, 0.0, 0.0, 0.0])
    bound = np.full(7, 1.0)
    assert scale_to_bounds(rates, -bound, bound) == (0.5, 1)
    assert scale_to_bounds(0.1 * rates, -bound, bound) == (1.0, -1)
    bound[3] = 0.0
    assert scale_to_bounds(rates, -bound, bound) == (0.0, 3)


def test_rates_change_along_a_straight_line():
    before, wanted = np.zeros(7), np.array([1.0, -0.5, 0, 0, 0, 0, 0])
    after, arrived = limit_rate_change(before, wanted, 0.05)
    assert not arrived
    np.testing.assert_allclose(after, 0.05 * wanted)
    after, arrived = limit_rate_change(after, 1.04 * after, 0.05)
    assert arrived


@pytest.mark.parametrize("rate", [0.3, -0.3])
def test_a_joint_at_its_limit_stays(iiwa, rate):
    at = (iiwa.upper if rate > 0 else iiwa.lower).copy()
    assert not np.clip(np.full(7, rate), *rate_bounds(iiwa, at, PERIOD, ACCELERATION)).any()
    assert not stops_in_time(iiwa, at, np.full(7, rate), PERIOD, ACCELERATION)


@given(seed=st.integers(0, 10**6))
def test_rates_that_stop_in_time_are_within_the_bounds(iiwa, seed):
    rng = np.random.default_rng(seed)
    joints = iiwa.upper - rng.exponential(0.1, 7)
    rates, acceleration = rng.normal(size=7), rng.uniform(0.1, 10.0, 7)
    lower, upper = rate_bounds(iiwa, joints, PERIOD, acceleration)
    for one in np.diag(rates):
        if stops_in_time(iiwa, joints, one, PERIOD, acceleration):
            assert ((one >= lower) & (one <= upper)).all()

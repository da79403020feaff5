"""Motions within jerk limits: the limits, the ends, straight lines, and how near the path is."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import tcs
from tcs.errors import TcsError
from tcs.motion import check_plan, load_plan, save_plan
from tcs.motion.curves import Curve
from tcs.motion.limits import MotionLimits
from tcs.motion.limits import rates as rates_of
from tcs.motion.smoothing import smoothed
from tests.motion.paths import bent, straight

LIMITS = MotionLimits(np.full(7, 2.0), np.full(7, 4.0), np.full(7, 16.0))


def always(_):
    """Accept every motion."""
    return True


def test_a_straight_line_takes_the_time_of_a_trapezoid_and_a_window():
    # s / v + v / a, and 2 a / j.
    motion = smoothed(straight(3.0), LIMITS, always)
    assert 2.5 <= motion.knots[-1] < 1.05 * 2.5
    np.testing.assert_allclose(motion.q[:, 1:], 0.0, atol=1e-15)


def test_random_motions_keep_every_limit_and_begin_and_end_at_rest(rng):
    for _ in range(10):
        knots = np.concatenate([[0.0], np.cumsum(rng.uniform(0.01, 1.0, 6))])
        curve = Curve(knots, rng.normal(size=(7, 7)), rng.normal(size=(7, 7)))
        limits = replace(LIMITS, jerk=rng.uniform(2.0, 200.0, 7))
        motion = smoothed(curve, limits, always)
        np.testing.assert_array_equal(motion.q[[0, -1]], curve.q[[0, -1]])
        # Derivatives by differences of a grid ten times as fine as the knots, rest at both ends.
        at = np.linspace(0.0, 1.0, 10, endpoint=False)
        points = np.concatenate([motion.points(piece, at) for piece in range(motion.pieces)])
        points = np.concatenate([points[:1], points[:1], points, motion.q[[-1, -1, -1]]])
        step, rates = motion.knots[1] / 10.0, [points]
        for limit in (limits.velocity, limits.acceleration, limits.jerk):
            rates.append(np.diff(rates[-1], axis=0) / step)
            assert np.all(np.abs(rates[-1]) <= limit * 1.001 + 1e-6)
        for found, expected in zip(rates_of(motion), rates[1:], strict=True):
            np.testing.assert_allclose(found.max(axis=0), np.abs(expected).max(axis=0), rtol=0.08)


def test_joints_without_a_jerk_limit_do_not_slow_the_others_down():
    free = np.full(7, np.inf)
    free[3] = 16.0
    motion = smoothed(bent(), replace(LIMITS, jerk=free), always)
    assert motion.knots[-1] == pytest.approx(smoothed(bent(), LIMITS, always).knots[-1], rel=0.05)


def test_a_motion_that_is_not_accepted_is_made_slower_until_it_follows_the_path():
    def cuts(motion):
        # The bend is where both joints move; the parabola is 0.1 from the corner at (1, 0).
        q = np.concatenate(
            [motion.points(n, np.linspace(0.0, 1.0, 5)) for n in range(motion.pieces)]
        )
        return 0.1 - np.min(np.abs(1.0 - q[:, 0]) + np.abs(q[:, 1]))

    fast = smoothed(bent(), LIMITS, always)
    cut = cuts(fast)
    near = smoothed(bent(), LIMITS, lambda motion: abs(cuts(motion)) < abs(cut) / 10.0)
    assert abs(cut) > 1e-3
    assert abs(cuts(near)) < abs(cut) / 10.0
    assert fast.knots[-1] < near.knots[-1] < 2.0 * fast.knots[-1]
    assert smoothed(bent(), LIMITS, lambda _: False) is None


@pytest.fixture(scope="module")
def gentle(two_goals):
    """The plan of `two_goals` with a jerk of at most 10 rad/s^3."""
    return tcs.plan(tcs.load(two_goals), [0], jerk=10.0, seed=3)


def test_a_plan_within_jerk_limits_does_what_the_other_does(gentle, planned, tmp_path):
    assert (gentle.goals_done, gentle.false) == (planned.goals_done, 0)
    assert [s.type for s in gentle.stops[0].segments] == [s.type for s in planned.stops[0].segments]
    assert planned.stops[0].duration < gentle.stops[0].duration < 2.0 * planned.stops[0].duration
    path = tmp_path / "plan.json"
    save_plan(path, gentle)
    plain = json.loads(path.read_text())
    assert plain["jerk_limits"] == [10.0] * 7
    # Against half the limit, the re-check finds nothing else at fault.
    plain["jerk_limits"] = [5.0] * 7
    path.write_text(json.dumps(plain))
    found = check_plan(load_plan(path))
    assert (found.is_sound, replace(found, jerk=1.0).is_sound) == (False, True)
    assert 1.4 < found.jerk <= 2.001


def test_a_plan_without_jerk_limits_is_not_judged_by_them(planned, tmp_path):
    path = tmp_path / "plan.json"
    save_plan(path, planned)
    assert (planned.jerk_limits, check_plan(load_plan(path)).jerk) == (None, None)


@pytest.mark.parametrize("jerk", [0.0, -1.0, float("nan"), 1e9])
def test_a_jerk_out_of_range_is_refused(jerk, two_goals):
    with pytest.raises(TcsError, match=r"the jerk is .* rad/s\^3, but must be in \[0.1, 100000\]"):
        tcs.plan(tcs.load(two_goals), [0], jerk=jerk)


def test_the_command_takes_a_jerk(two_goals, tcs_plan):
    ran = tcs_plan(two_goals, "--jerk", 0)
    assert (ran.exit_code, "must be in [0.1, 100000]" in " ".join(ran.stderr.split())) == (1, True)

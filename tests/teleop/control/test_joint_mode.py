"""Joint mode: every joint goes to its set-point on its own, and rests there."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.teleop import Command, Mode, Settings, Teleoperation
from tests.teleop.driving import drive, off

STEP = Settings().acceleration * Settings().period
BOTH = ["paper", "clamped"]


def joint_session(iiwa, ready, limits="clamped"):
    return Teleoperation(iiwa, ready, Settings(limits=limits), Mode.JOINT)


@pytest.mark.parametrize("limits", BOTH)
def test_the_joints_come_to_rest_at_the_set_point(iiwa, ready, limits):
    wanted = ready + np.array([0.3, -0.2, 0.01, 0.4, 0.0, -0.0001, -0.5])
    steps = drive(joint_session(iiwa, ready, limits), Command(joints=tuple(wanted)), 2.5)
    # Sums of some hundred steps, each rounded.
    np.testing.assert_allclose(steps[-1].joints, wanted, atol=1e-12)
    assert np.abs(steps[-1].rates).max() < 1e-9
    assert not steps[-1].stopped
    path = np.array([step.joints for step in steps])
    # No joint passes its set-point, and none moves that has none of its own.
    assert (np.abs(path - ready) <= np.abs(wanted - ready) + 1e-12).all()
    assert np.abs(np.diff(path[:, 3])).max() <= 0.5 * 0.01 + 1e-12


def test_a_set_point_that_changes_on_the_way_is_followed_without_jumps(iiwa, ready):
    rng = np.random.default_rng(4)
    session, before = joint_session(iiwa, ready), np.zeros(7)
    for _ in range(20):
        wanted = rng.uniform(-3.0, 3.0, 7)
        for step in drive(session, Command(joints=wanted), 0.2):
            assert np.abs(step.rates - before).max() <= STEP + 1e-12
            assert iiwa.limit_violation(step.joints) == ""
            before = step.rates
    last = drive(session, Command(joints=ready), 8.0)[-1]
    np.testing.assert_allclose(last.joints, ready, atol=1e-12)


def test_a_set_point_beyond_a_limit_ends_there_with_a_reason(iiwa, ready):
    wanted = ready.copy()
    wanted[3] = -2.5
    last = drive(joint_session(iiwa, ready), Command(joints=wanted), 3.0)[-1]
    assert last.joints[3] == pytest.approx(iiwa.lower[3], abs=1e-9)
    assert last.reason == "joint 4 is at its limit: the set-point is beyond."
    assert last.limits[3] == -1


def test_a_singular_posture_does_not_matter(iiwa, ready):
    # The stretched arm ends end-effector control in paper mode.
    last = drive(joint_session(iiwa, ready, "paper"), Command(joints=(0.0,) * 7), 4.0)[-1]
    np.testing.assert_allclose(last.joints, 0.0, atol=1e-12)
    assert last.singular


def test_without_a_set_point_the_joints_come_to_rest(iiwa, ready):
    session = joint_session(iiwa, ready)
    drive(session, Command(joints=ready + 1.0), 0.5)
    for stop in (Command(), Command(joints=ready + 1.0, clutch=True)):
        steps = drive(session, stop, 0.3)
        assert not steps[-1].rates.any()
        # 0.5 rad/s ends within six steps of 0.1 rad/s.
        assert np.abs(steps[-1].joints - steps[0].joints).max() < 0.03
        drive(session, Command(joints=ready + 1.0), 0.2)


def test_the_tool_stays_when_the_mode_changes(iiwa, ready):
    session = joint_session(iiwa, ready)
    drive(session, Command(joints=ready + 0.3), 3.0)
    steps = drive(session, Command(mode=Mode.END_EFFECTOR), 1.0)
    assert off(steps, steps[0].p) < 1e-9


@pytest.mark.parametrize(
    "joints", [(0.0,) * 6, (np.nan,) * 7, "ready", (None,) * 7, (10**400,) * 7]
)
def test_a_set_point_that_is_no_posture_is_rejected(iiwa, ready, joints):
    step = joint_session(iiwa, ready).step(Command(joints=joints))
    assert step.reason.startswith("command rejected: its set-point must be 7 finite numbers [rad]")
    np.testing.assert_array_equal(step.joints, ready)

"""Pose device: 1:1 motion while the trigger is held, and nothing in every other case."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tcs.output.view.teleop.controls import STOP
from tcs.output.view.teleop.gamepad import gamepad_state
from tcs.output.view.teleop.pose_device import INDEX, TIMEOUT, PoseState, pose_state
from tcs.teleop import Mode


class Hand:
    """A controller that a test moves; each frame of the headset has a new number."""

    def __init__(self, desk):
        self.desk, self.number = desk, 0.0
        self.p, self.R, self.trigger, self.side_button = np.zeros(3), np.eye(3), False, False

    def frame(self):
        self.number += 1.0
        self.desk.pose = PoseState(
            self.number, self.p.copy(), self.R.copy(), self.trigger, self.side_button
        )


@pytest.fixture
def hand(desk, monkeypatch):
    monkeypatch.setattr("tcs.output.view.teleop.live.time.perf_counter", Clock())
    return Hand(desk)


class Clock:
    """A clock that the steps of a page advance: three readings a step, one of them counted."""

    def __init__(self):
        self.now, self.readings = 0.0, 0

    def __call__(self):
        return self.now


@pytest.fixture
def drive(page, hand):
    """Advance the page, with a frame of the headset at each step unless it is lost."""
    import tcs.output.view.teleop.live as live

    def driven(steps, *, frames=True):
        for _ in range(steps):
            live.time.perf_counter.now += page.session.settings.period
            if frames:
                hand.frame()
            page.step()

    driven(2)
    return driven


def move(hand, drive, displacement, seconds=1.0, rotation=(0.0, 0.0, 0.0)):
    """Move the hand at a constant velocity."""
    count = round(seconds * 100)
    turn = Rotation.from_rotvec(np.array(rotation) / count).as_matrix()
    for _ in range(count):
        hand.p += np.array(displacement) / count
        hand.R = turn @ hand.R
        drive(1)


def test_the_tool_follows_the_hand_1_to_1(page, hand, drive):
    hand.trigger = True
    drive(1)
    start = page.last
    move(hand, drive, [0.02, 0.12, -0.1], rotation=[0.0, 0.0, 0.3])
    drive(60)
    # The commanded motion approaches the hand with a time constant of 0.05 s.
    np.testing.assert_allclose(page.last.p - start.p, [0.02, 0.12, -0.1], atol=1e-3)
    turned = Rotation.from_matrix(page.last.R @ start.R.T).as_rotvec()
    np.testing.assert_allclose(turned, [0.0, 0.0, 0.3], atol=3e-3)
    assert np.abs(page.last.rates).max() < 1e-2


def test_nothing_moves_while_the_trigger_is_released(page, hand, drive):
    start = page.last.joints.copy()
    move(hand, drive, [0.3, 0.0, 0.0])
    np.testing.assert_array_equal(page.last.joints, start)


def test_releasing_stops_the_arm_and_pressing_again_begins_there(page, hand, drive):
    hand.trigger = True
    move(hand, drive, [0.0, 0.1, 0.0], 0.5)
    hand.trigger = False
    drive(20)
    rest = page.last.p.copy()
    assert not page.last.rates.any()
    move(hand, drive, [0.0, -0.2, 0.1])
    np.testing.assert_allclose(page.last.p, rest, atol=1e-9)
    hand.trigger = True
    drive(30)
    # The hand's motion with the clutch open is not made up for.
    np.testing.assert_allclose(page.last.p, rest, atol=1e-9)


def lose_frames(page, hand, drive):
    drive(round(TIMEOUT * 100) + 2, frames=False)


def lose_device(page, hand, drive):
    hand.desk.pose = None
    drive(1, frames=False)


def jump(page, hand, drive):
    hand.p = hand.p + 0.5
    drive(1)


@pytest.mark.parametrize("lose", [lose_frames, lose_device, jump])
def test_a_lost_device_stops_the_arm_until_its_trigger_was_released(
    page, hand, drive, lose, reasons
):
    hand.trigger = True
    move(hand, drive, [0.0, 0.1, 0.0], 0.5)
    assert page.last.rates.any()
    lose(page, hand, drive)
    assert page.last.stopped
    drive(20, frames=lose is jump)
    assert not page.last.rates.any()
    assert reasons[-1].startswith("XR controller")
    rest = page.last.joints.copy()
    # The device comes back with its trigger held.
    move(hand, drive, [0.0, 0.1, 0.0], 0.3)
    np.testing.assert_array_equal(page.last.joints, rest)
    hand.trigger = False
    drive(2)
    hand.trigger = True
    move(hand, drive, [0.0, 0.1, 0.0], 0.3)
    assert np.abs(page.last.joints - rest).max() > 0.01


def test_a_closed_page_stops_the_arm(page, hand, drive):
    hand.trigger = True
    move(hand, drive, [0.0, 0.1, 0.0], 0.5)
    hand.desk.watched = False
    drive(20, frames=False)
    assert not page.last.rates.any()


def test_space_continues_without_a_lost_device(page, hand, drive, desk):
    hand.trigger = True
    move(hand, drive, [0.0, 0.05, 0.0], 0.3)
    lose_device(page, hand, drive)
    desk.press(STOP)
    drive(2, frames=False)
    assert not page.last.stopped


def test_a_trigger_held_from_the_beginning_moves_nothing(page, hand, drive, desk):
    page.operator.pose_device.__init__(0.01)
    hand.trigger = True
    start = page.last.joints.copy()
    move(hand, drive, [0.0, 0.2, 0.0])
    np.testing.assert_array_equal(page.last.joints, start)


def test_motion_that_the_arm_cannot_follow_is_dropped(page, hand, drive):
    hand.trigger = True
    drive(1)
    # Beyond the arm's length: it stops on the way.
    move(hand, drive, [1.0, 0.0, 0.0], 3.0)
    drive(30)
    ends = page.last.p.copy()
    move(hand, drive, [-0.1, 0.0, 0.0])
    drive(30)
    assert (page.last.p - ends)[0] == pytest.approx(-0.1, abs=0.02)


def test_the_side_button_selects_the_mode_and_a_roll_turns_the_group(page, hand, drive):
    hand.side_button = True
    drive(3)
    hand.side_button = False
    drive(20)
    assert page.last.mode is Mode.NULL_SPACE
    hand.trigger = True
    drive(1)
    start = page.last
    # Clockwise, seen by the operator: about -z of the controller, which points away.
    move(hand, drive, [0.0, 0.0, 0.0], 0.5, rotation=[0.0, 0.0, -0.6])
    drive(50)
    assert page.last.joints[0] - start.joints[0] > 0.05
    assert np.linalg.norm(page.last.p - start.p) < 1e-4


@pytest.mark.parametrize(
    ("index", "axes"),
    [
        (0, (1.0, 0, 0, 0, 0, 0, 0, 1.0)),
        (INDEX, (1.0, 0, 0, 0, 0, 0, 1.0)),
        (INDEX, (1.0, float("nan"), 0, 0, 0, 0, 0, 1.0)),
        (INDEX, (1.0, 0, 0, 0, 0, 0, 0, 0.0)),
        (None, ()),
    ],
)
def test_what_is_no_pose_is_none(index, axes):
    assert pose_state(index, axes, (1.0, 0.0)) is None


def test_a_pose_is_no_gamepad():
    axes = (7.0, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0)
    assert gamepad_state(INDEX, axes, (1.0, 0.0)) is None
    found = pose_state(INDEX, axes, (1.0,))
    assert (found.trigger, found.side_button) == (True, False)
    np.testing.assert_array_equal(found.p, [0.1, 0.2, 0.3])

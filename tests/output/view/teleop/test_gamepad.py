from __future__ import annotations

import pytest

from tcs.output.view.teleop.gamepad import (
    DEAD_ZONE,
    STUCK_AFTER,
    Gamepad,
    GamepadState,
    gamepad_state,
)

NOTHING = (0.0,) * 17


def pushed(*axes, buttons=()):
    values = [0.0] * 17
    for button in buttons:
        values[button] = 1.0
    return GamepadState((*axes, *(0.0,) * (4 - len(axes))), tuple(values))


@pytest.fixture
def active():
    """A gamepad that has been at rest."""
    pad = Gamepad()
    for now in (0.0, 0.01):
        pad.update(pushed(), now)
    return pad


def test_meshcat_without_a_gamepad_gives_none():
    assert gamepad_state(None, (), ()) is None
    # Meshcat's report after a gamepad was removed.
    assert gamepad_state(0, [], []) is None
    assert gamepad_state(1, [0.5], [1.0]) == GamepadState((0.5,), (1.0,))


@pytest.mark.parametrize(
    ("pad", "linear", "angular"),
    [
        (pushed(0.0, -1.0), (1, 0, 0), (0, 0, 0)),
        (pushed(-1.0, 0.0), (0, 1, 0), (0, 0, 0)),
        (pushed(0.0, 0.0, 0.0, -1.0), (0, 0, 1), (0, 0, 0)),
        (pushed(0.0, 0.0, -1.0, 0.0), (0, 0, 0), (0, 0, 1)),
        (pushed(0.0, -1.0, buttons=[4]), (0, 0, 0), (0, 1, 0)),
        (pushed(-1.0, 0.0, buttons=[4]), (0, 0, 0), (-1, 0, 0)),
    ],
    ids=["ahead", "left", "up", "turn left", "tip down", "roll left"],
)
def test_sticks_move_the_tool(active, pad, linear, angular):
    command = active.update(pad, 0.02)
    assert command.linear == pytest.approx(linear)
    assert command.angular == pytest.approx(angular)
    assert command.lost == ""


def test_dead_zone_has_no_edge(active):
    def ahead(push):
        return active.update(pushed(0.0, -push), 1.0).linear[0]

    assert ahead(DEAD_ZONE) == 0.0
    assert ahead(DEAD_ZONE + 0.01) == pytest.approx(0.01 / (1 - DEAD_ZONE))
    assert ahead(1.0) == 1.0


def test_cross_clutch_and_clicks(active):
    command = active.update(pushed(buttons=[15, 1, 0]), 0.02)
    assert (command.turn, command.clutch) == (1, True)
    assert 0 in command.clicks
    assert active.update(pushed(buttons=[15, 1, 0]), 0.03).clicks == ()
    assert active.update(pushed(buttons=[14]), 0.04).turn == -1


def test_input_while_it_connects_moves_nothing():
    pad = Gamepad()
    for now in range(10):
        command = pad.update(pushed(0.0, -1.0), 0.01 * now)
        assert command.linear == (0.0, 0.0, 0.0)
        assert command.lost == ""
    pad.update(pushed(), 0.2)
    assert pad.update(pushed(0.0, -1.0), 0.21).linear[0] == 1.0


def test_a_lost_gamepad_stops_the_arm_until_it_is_back_and_at_rest(active):
    assert "gamepad lost" in active.update(None, 0.02).lost
    assert "gamepad lost" in active.update(None, 9.0).lost
    back = active.update(pushed(0.0, -1.0), 9.1)
    assert back.lost
    assert back.linear == (0.0, 0.0, 0.0)
    assert active.update(pushed(), 9.2).lost == ""
    assert active.update(pushed(0.0, -1.0), 9.3).linear[0] == 1.0


def test_the_operator_can_continue_without_it(active):
    active.update(None, 0.02)
    active.dismiss()
    assert active.update(None, 0.03).lost == ""


def test_a_constant_stick_counts_as_lost_after_a_while(active):
    push = pushed(0.0, -1.0)
    assert active.update(push, 1.0).linear[0] == 1.0
    assert active.update(push, 1.0 + STUCK_AFTER - 0.01).linear[0] == 1.0
    constant = active.update(push, 1.0 + STUCK_AFTER + 0.01)
    assert "no change from the gamepad" in constant.lost
    assert constant.linear == (0.0, 0.0, 0.0)
    assert active.update(pushed(0.0, -0.9), 7.0).lost
    assert active.update(pushed(), 7.1).lost == ""


def test_a_changing_stick_may_be_pushed_for_long(active):
    for i in range(100):
        push = 0.9 + 0.01 * (i % 2)
        assert active.update(pushed(0.0, -push), 0.5 * i).linear[0] > 0.8


def test_a_gamepad_with_fewer_buttons_or_axes_is_no_error():
    pad = Gamepad()
    for now in (0.0, 0.01, 0.02):
        command = pad.update(GamepadState((0.0,), ()), now)
    assert command.linear == (0.0, 0.0, 0.0)


def test_a_button_pressed_while_it_comes_is_no_click():
    pad = Gamepad()
    assert pad.update(pushed(buttons=[0]), 0.0).clicks == ()
    assert pad.update(pushed(buttons=[0]), 0.01).clicks == ()


def test_a_gamepad_that_never_moved_the_arm_is_not_reported_lost():
    pad = Gamepad()
    pad.update(pushed(0.0, -1.0), 0.0)
    assert pad.update(None, 0.01).lost == ""

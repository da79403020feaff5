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
def heeded():
    """A gamepad that has been at rest."""
    pad = Gamepad()
    for now in (0.0, 0.01):
        pad.look(pushed(), now)
    return pad


def test_meshcat_without_a_gamepad_gives_none():
    assert gamepad_state(None, (), ()) is None
    # What Meshcat tells after a gamepad has gone.
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
def test_sticks_move_the_tool(heeded, pad, linear, angular):
    asked = heeded.look(pad, 0.02)
    assert asked.linear == pytest.approx(linear)
    assert asked.angular == pytest.approx(angular)
    assert asked.lost == ""


def test_dead_zone_has_no_edge(heeded):
    def ahead(push):
        return heeded.look(pushed(0.0, -push), 1.0).linear[0]

    assert ahead(DEAD_ZONE) == 0.0
    assert ahead(DEAD_ZONE + 0.01) == pytest.approx(0.01 / (1 - DEAD_ZONE))
    assert ahead(1.0) == 1.0


def test_cross_clutch_and_clicks(heeded):
    asked = heeded.look(pushed(buttons=[15, 1, 0]), 0.02)
    assert (asked.turn, asked.clutch) == (1, True)
    assert 0 in asked.clicks
    assert heeded.look(pushed(buttons=[15, 1, 0]), 0.03).clicks == ()
    assert heeded.look(pushed(buttons=[14]), 0.04).turn == -1


def test_what_it_does_while_it_comes_moves_nothing():
    pad = Gamepad()
    for now in range(10):
        asked = pad.look(pushed(0.0, -1.0), 0.01 * now)
        assert asked.linear == (0.0, 0.0, 0.0)
        assert asked.lost == ""
    pad.look(pushed(), 0.2)
    assert pad.look(pushed(0.0, -1.0), 0.21).linear[0] == 1.0


def test_lost_gamepad_holds_until_it_is_back_and_let_go_of(heeded):
    assert "gamepad lost" in heeded.look(None, 0.02).lost
    assert "gamepad lost" in heeded.look(None, 9.0).lost
    back = heeded.look(pushed(0.0, -1.0), 9.1)
    assert back.lost
    assert back.linear == (0.0, 0.0, 0.0)
    assert heeded.look(pushed(), 9.2).lost == ""
    assert heeded.look(pushed(0.0, -1.0), 9.3).linear[0] == 1.0


def test_a_person_can_go_on_without_it(heeded):
    heeded.look(None, 0.02)
    heeded.give_up()
    assert heeded.look(None, 0.03).lost == ""


def test_a_stick_that_says_the_same_for_long_is_nobody(heeded):
    push = pushed(0.0, -1.0)
    assert heeded.look(push, 1.0).linear[0] == 1.0
    assert heeded.look(push, 1.0 + STUCK_AFTER - 0.01).linear[0] == 1.0
    silent = heeded.look(push, 1.0 + STUCK_AFTER + 0.01)
    assert "silent" in silent.lost
    assert silent.linear == (0.0, 0.0, 0.0)
    assert heeded.look(pushed(0.0, -0.9), 7.0).lost
    assert heeded.look(pushed(), 7.1).lost == ""


def test_a_hand_that_moves_may_push_for_long(heeded):
    for i in range(100):
        push = 0.9 + 0.01 * (i % 2)
        assert heeded.look(pushed(0.0, -push), 0.5 * i).linear[0] > 0.8


def test_a_gamepad_with_fewer_buttons_or_axes_is_no_error():
    pad = Gamepad()
    for now in (0.0, 0.01, 0.02):
        asked = pad.look(GamepadState((0.0,), ()), now)
    assert asked.linear == (0.0, 0.0, 0.0)


def test_a_button_pressed_while_it_comes_is_no_click():
    pad = Gamepad()
    assert pad.look(pushed(buttons=[0]), 0.0).clicks == ()
    assert pad.look(pushed(buttons=[0]), 0.01).clicks == ()


def test_a_gamepad_that_never_moved_the_arm_is_not_missed():
    pad = Gamepad()
    pad.look(pushed(0.0, -1.0), 0.0)
    assert pad.look(None, 0.01).lost == ""

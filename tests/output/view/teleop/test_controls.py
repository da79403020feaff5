from __future__ import annotations

import numpy as np
import pytest

from tcs.output.view.teleop.controls import (
    BACK,
    CLUTCH,
    DEAD_LINEAR,
    MOST_LINEAR,
    MOVES,
    NEXT_MODE,
    RATE_SLIDERS,
    SPEED,
    STOP,
    TAP,
    TURN_DOWN,
    TURN_SPEED,
    TURN_UP,
    OperatorInput,
    buttons,
    group_button,
    sliders,
)
from tcs.output.view.teleop.gamepad import GamepadState
from tcs.teleop import Mode
from tests.output.view.teleop.conftest import MODES

X = RATE_SLIDERS[0]


@pytest.fixture
def operator(desk):
    return OperatorInput(desk, MODES, 4)


def twist(received):
    return np.array([*received.command.linear, *received.command.angular])


def test_every_button_has_its_own_key_and_none_hides_the_controls():
    keys = list(buttons(4).values())
    assert len(keys) == len(set(keys))
    # H hides the browser's own controls.
    assert "KeyH" not in keys


@pytest.mark.parametrize("name", MOVES)
def test_a_press_moves_the_tool_for_a_moment(operator, desk, name):
    axis, direction, _ = MOVES[name]
    assert not twist(operator.read(0.0)).any()
    desk.press(name)
    expected = np.zeros(6)
    expected[axis] = direction * desk.sliders[SPEED if axis < 3 else TURN_SPEED]
    np.testing.assert_allclose(twist(operator.read(1.0)), expected)
    np.testing.assert_allclose(twist(operator.read(1.0 + 0.9 * TAP)), expected)
    assert not twist(operator.read(1.0 + 1.01 * TAP)).any()


def test_a_held_key_continues_by_its_repeats(operator, desk):
    for i in range(50):
        desk.press("ahead")
        assert twist(operator.read(0.1 * i))[0] > 0.0


@pytest.mark.parametrize("name", MOVES)
def test_a_key_moves_the_tool_until_it_is_released(operator, desk, name):
    axis, direction, _ = MOVES[name]
    expected = np.zeros(6)
    expected[axis] = direction * desk.sliders[SPEED if axis < 3 else TURN_SPEED]
    desk.held = frozenset({name})
    for now in (0.0, 0.01, 5.0):
        np.testing.assert_allclose(twist(operator.read(now)), expected)
    desk.held = frozenset()
    assert not twist(operator.read(5.01)).any()


@pytest.mark.parametrize("switch", [STOP, BACK, NEXT_MODE])
def test_a_key_that_outlasts_a_stop_or_a_mode_has_no_effect_until_it_is_released(
    operator, desk, switch
):
    desk.held = frozenset({"ahead", TURN_UP})
    assert operator.read(0.0).command.linear[0] > 0.0
    desk.press(switch)
    for now in (0.1, 0.2, 9.0):
        command = operator.read(now).command
        assert not np.any(command.linear)
        assert not command.sign
    desk.held = frozenset({"ahead"})
    operator.read(9.1)
    desk.held = frozenset({"ahead", TURN_UP})
    command = operator.read(9.2).command
    assert not np.any(command.linear)
    assert command.sign == (1 if switch == NEXT_MODE else 0)


def test_a_key_held_while_no_browser_is_connected_has_no_effect(operator, desk):
    desk.watched, desk.held = False, frozenset({"ahead"})
    assert not twist(operator.read(0.0)).any()
    desk.watched = True
    assert not twist(operator.read(0.1)).any()
    desk.held = frozenset()
    operator.read(0.2)
    desk.held = frozenset({"ahead"})
    assert twist(operator.read(0.3))[0] > 0.0


def test_sliders_move_and_have_a_dead_zone(operator, desk):
    desk.sliders[X] = 0.9 * DEAD_LINEAR
    assert not twist(operator.read(0.0)).any()
    desk.sliders[X] = 0.1
    assert twist(operator.read(0.1))[0] == pytest.approx(0.1)


def test_commands_do_not_exceed_the_greatest_rates(operator, desk):
    desk.sliders[X] = desk.sliders[SPEED] = MOST_LINEAR
    desk.press("ahead")
    assert twist(operator.read(0.0))[0] == MOST_LINEAR


def test_space_stops_the_arm_and_resets_the_sliders(operator, desk):
    desk.sliders[X] = 0.2
    desk.press("up")
    assert twist(operator.read(0.0)).any()
    desk.press(STOP)
    assert not twist(operator.read(0.01)).any()
    assert not twist(operator.read(0.02)).any()
    assert desk.sliders[X] == 0.0
    # The speed sliders are not reset.
    assert desk.sliders[SPEED] == sliders()[SPEED][3]


def test_modes_alternate_and_groups_move_only_in_null_space_mode(operator, desk):
    desk.press(TURN_UP)
    received = operator.read(0.0)
    assert received.command.sign == 0
    assert "null-space mode" in received.hint
    desk.press(NEXT_MODE)
    assert operator.read(0.01).command.sign == 0
    desk.press(group_button(2))
    desk.press(TURN_DOWN)
    command = operator.read(0.02).command
    assert (command.mode, command.group, command.sign) == (Mode.NULL_SPACE, 2, -1)
    later = operator.read(0.02 + 1.01 * TAP).command
    assert (later.group, later.sign) == (None, 0)
    desk.press(NEXT_MODE)
    operator.read(1.0)
    desk.press(TURN_UP)
    command = operator.read(1.01).command
    assert (command.mode, command.group, command.sign) == (Mode.POSE, None, 1)
    desk.press(NEXT_MODE)
    assert operator.read(2.0).command.mode is Mode.END_EFFECTOR


def test_tool_rates_are_not_sent_while_the_tool_is_held(operator, desk):
    desk.sliders[X] = 0.2
    desk.press(NEXT_MODE)
    operator.read(0.0)
    desk.press("ahead")
    received = operator.read(0.01)
    assert not twist(received).any()
    assert "holds the tool" in received.hint


def test_a_single_mode_gives_a_hint(desk):
    operator = OperatorInput(desk, (Mode.END_EFFECTOR,), 4)
    desk.press(NEXT_MODE)
    received = operator.read(0.0)
    assert received.command.mode is Mode.END_EFFECTOR
    assert "only" in received.hint


def test_clutch_stays_until_it_is_pressed_again(operator, desk):
    desk.press(CLUTCH)
    assert operator.read(0.0).command.clutch
    assert operator.read(5.0).command.clutch
    desk.press(CLUTCH)
    assert not operator.read(6.0).command.clutch


def test_without_a_browser_the_arm_stops_and_sliders_are_reset(operator, desk):
    desk.sliders[X] = 0.2
    operator.read(0.0)
    desk.watched = False
    received = operator.read(0.01)
    assert received.command.clutch
    assert not twist(received).any()
    assert "no browser" in received.lost
    desk.watched = True
    assert not twist(operator.read(0.02)).any()


def test_gamepad_input_of_a_closed_browser_is_ignored(operator, desk):
    rest, push = GamepadState((0.0,) * 4, ()), GamepadState((0.0, -1.0, 0.0, 0.0), ())
    desk.pad = rest
    operator.read(0.0)
    operator.read(0.01)
    desk.pad = push
    assert twist(operator.read(0.02))[0] == pytest.approx(desk.sliders[SPEED])
    desk.watched = False
    operator.read(0.03)
    desk.watched = True
    for now in (0.04, 0.05, 9.0):
        assert not twist(operator.read(now)).any()
    desk.pad = rest
    operator.read(9.1)
    desk.pad = push
    assert twist(operator.read(9.2))[0] > 0.0


def test_a_lost_gamepad_stops_the_arm_until_space(operator, desk):
    desk.pad = GamepadState((0.0,) * 4, ())
    operator.read(0.0)
    operator.read(0.01)
    desk.sliders[X] = 0.2
    desk.pad = None
    received = operator.read(0.02)
    assert received.command.clutch
    assert "gamepad lost" in received.lost
    desk.press("ahead")
    assert "gamepad lost" in operator.read(0.5).lost
    desk.press(STOP)
    operator.read(1.0)
    assert operator.read(1.01).lost == ""
    desk.press("ahead")
    assert twist(operator.read(1.1))[0] > 0.0


def test_gamepad_chooses_mode_and_group(operator, desk):
    def push(*pressed):
        desk.pad = GamepadState((0.0,) * 4, tuple(float(i in pressed) for i in range(17)))

    push()
    operator.read(0.0)
    push()
    operator.read(0.01)
    push(0)
    assert operator.read(0.02).command.mode is Mode.NULL_SPACE
    push(13)
    operator.read(0.03)
    assert operator.group == 3
    push(12)
    operator.read(0.04)
    push(15)
    command = operator.read(0.05).command
    assert (command.group, command.sign) == (0, 1)


def test_back_to_the_start_holds_for_a_step(operator, desk):
    desk.sliders[X] = 0.2
    desk.press(BACK)
    received = operator.read(0.0)
    assert received.back
    assert not twist(received).any()
    assert not operator.read(0.01).back

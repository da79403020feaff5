"""Rules of contact between gripper and cup."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tcs_studies.pick_and_place.cup import (
    CLOSING_TIME,
    FINGER_THICKNESS,
    OPENING,
    SAFE_DROP,
    STABLE_TILT,
    Cup,
    CupState,
)
from tcs_studies.pick_and_place.slave import orientation
from tcs_studies.pick_and_place.task import CUP_RADIUS, GRASP_HEIGHT, ITCM_HIGH, TABLE_HEIGHT

PERIOD = 0.02
AHEAD = np.eye(3)


def touched(cup, p, R=AHEAD, close=False, times=1):
    for _ in range(times):
        cup.advance(R, np.asarray(p, dtype=float), close=close)
    return cup


def cup_at(x=0.75, y=0.15):
    cup = Cup(ITCM_HIGH, PERIOD)
    cup.p[:2] = x, y
    return cup


def held(depth=0.02):
    """Return a cup between the fingers, and the position of the tool that holds it."""
    cup = cup_at()
    tool = cup.p + np.array([depth, 0.0, 0.0])
    return touched(cup, tool, close=True, times=round(1.1 * CLOSING_TIME / PERIOD)), tool


def test_a_gripper_far_away_or_above_does_nothing():
    for p in ([0.5, 0.15, GRASP_HEIGHT], [0.75, 0.15, GRASP_HEIGHT + 0.09]):
        cup = touched(cup_at(), p)
        assert cup.state is CupState.STANDING
        np.testing.assert_array_equal(cup.p, ITCM_HIGH.cup)


def test_a_slow_finger_pushes_the_cup_by_the_shortest_way():
    cup = cup_at()
    # The inner side of the left finger overlaps the cup by 3 mm.
    y = 0.15 - (OPENING - CUP_RADIUS + 0.003)
    touched(cup, [0.75, y, GRASP_HEIGHT])
    assert cup.state is CupState.STANDING
    np.testing.assert_allclose(cup.p, [0.75, 0.147, GRASP_HEIGHT], atol=1e-12)


def test_a_push_above_the_tipping_height_or_too_fast_topples_it():
    y = 0.15 - (OPENING - CUP_RADIUS + 0.003)
    assert touched(cup_at(), [0.75, y, GRASP_HEIGHT + 0.06]).state is CupState.TOPPLED
    fast = 0.15 - (OPENING - CUP_RADIUS + 0.012)
    assert touched(cup_at(), [0.75, fast, GRASP_HEIGHT]).state is CupState.TOPPLED


def test_a_cup_pushed_over_the_edge_falls():
    cup = cup_at(x=0.66)
    R = orientation(0.0, 0.0, math.pi / 2)
    outside = OPENING + FINGER_THICKNESS + CUP_RADIUS
    # A finger beside the cup moves over the edge, at x = 0.65 m, in small steps.
    for x in np.arange(0.66, 0.65, -0.004):
        touched(cup, [x + outside, 0.15, GRASP_HEIGHT], R=R)
    assert cup.state is CupState.STANDING
    for x in np.arange(0.65, 0.64, -0.004):
        touched(cup, [x + outside, 0.15, GRASP_HEIGHT], R=R)
    assert cup.state is CupState.FALLEN


def test_fingers_hold_a_cup_between_them_and_carry_it():
    cup, tool = held()
    assert cup.state is CupState.HELD
    assert cup.opening == CUP_RADIUS
    touched(cup, tool + np.array([0.0, 0.1, 0.05]), close=True)
    np.testing.assert_allclose(cup.p, ITCM_HIGH.cup + np.array([0.0, 0.1, 0.05]), atol=1e-12)
    assert cup.bottom_below_tool == pytest.approx(tool[2] - TABLE_HEIGHT)


def test_an_empty_grasp_holds_nothing():
    cup = cup_at()
    touched(cup, cup.p - [0.1, 0.0, 0.0], close=True, times=60)
    assert cup.state is CupState.STANDING
    assert cup.opening == 0.0


@pytest.mark.parametrize(
    ("rise", "state"),
    [(0.0, "standing"), (SAFE_DROP - 0.001, "standing"), (SAFE_DROP + 0.001, "toppled")],
)
def test_a_released_cup_lands_upright_from_low_down_only(rise, state):
    cup, tool = held()
    touched(cup, tool + np.array([0.0, 0.0, rise]), close=False, times=10)
    assert cup.state == state
    if state == "standing":
        assert cup.p[2] == GRASP_HEIGHT


def test_a_tilted_cup_topples_when_it_is_released():
    cup, tool = held()
    touched(cup, tool, R=orientation(1.1 * STABLE_TILT, 0.0, 0.0), close=False, times=10)
    assert cup.state is CupState.TOPPLED


def test_a_cup_released_beside_the_table_falls():
    cup, tool = held()
    touched(cup, tool - [0.2, 0.0, 0.0], close=False, times=10)
    assert cup.state is CupState.FALLEN


def test_a_cup_held_by_the_tips_slips_out_when_lifted():
    cup, tool = held(depth=-0.008)
    assert cup.state is CupState.HELD
    touched(cup, tool + np.array([0.0, 0.0, 0.05]), close=True)
    assert cup.state is CupState.TOPPLED

"""One repetition: what happens in it, and what the operator learns."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tcs.teleop.control.latency import Latency
from tcs_studies.pick_and_place.cup import CupState
from tcs_studies.pick_and_place.master import Coupling
from tcs_studies.pick_and_place.operator import Experience, _misdirected
from tcs_studies.pick_and_place.phases import VARIED, Traits
from tcs_studies.pick_and_place.repetition import Outcome, _Performance, measure, perform
from tcs_studies.pick_and_place.slave import Control, orientation
from tcs_studies.pick_and_place.task import FARTHEST, ITCM_HIGH

TRAITS = Traits()


@pytest.fixture(scope="module")
def setting(tiago):
    return tiago.setting(ITCM_HIGH, Control.POSITION_FIRST, Coupling())


@pytest.fixture(scope="module")
def done(setting):
    return perform(setting, TRAITS, Experience(), np.random.default_rng(2))


def test_the_cup_is_placed_and_the_gripper_retreats(done):
    assert done.outcome is Outcome.DONE
    closed, opened = done.actions
    assert 0.0 < closed < opened < done.time[-1]
    distance = np.linalg.norm(done.tool - done.place, axis=1)
    assert distance[-1] > FARTHEST >= distance[-2]
    assert distance.min() < 0.06


def test_its_measures_add_up(done):
    found = measure(done)
    assert found.tct == done.time[-1]
    assert found.approach + found.transfer + found.retreat == pytest.approx(found.tct)
    assert found.csa_rate == pytest.approx(found.csa / found.tct)
    # The path of the hand is at least the way from start to cup to place, scaled.
    way = np.linalg.norm(done.tool[-1] - done.tool[0]) / Coupling().scale
    assert found.cst > way
    assert found.sal < -1.0
    assert found.actions == 2.0


def test_the_same_random_numbers_give_the_same_repetition(setting, done):
    again = perform(setting, TRAITS, Experience(), np.random.default_rng(2))
    np.testing.assert_array_equal(again.tool, done.tool)


def test_a_repetition_ends_at_the_time_limit(setting):
    short = perform(setting, TRAITS, Experience(), np.random.default_rng(2), time_limit=3.0)
    assert short.outcome is Outcome.TIMEOUT
    assert short.time[-1] == pytest.approx(3.0)


def test_latency_delays_the_arm(setting):
    late = replace(setting, coupling=Coupling(latency=Latency(0.5)))
    slow, fast = (
        perform(one, TRAITS, Experience(), np.random.default_rng(0), time_limit=2.0)
        for one in (late, setting)
    )
    moved = [
        int(np.argmax(np.linalg.norm(one.tool - one.tool[0], axis=1) > 0.005))
        for one in (fast, slow)
    ]
    # 0.4 s later on the way to the slave, within a period of the slave.
    assert moved[1] - moved[0] == pytest.approx(0.4 / 0.02, abs=2)


def test_the_cup_is_carried_while_it_is_held(setting):
    state = _Performance(setting, TRAITS, Experience(), np.random.default_rng(2))
    seen = set()
    for sample in range(900):
        state._advance(sample)
        seen.add(state._cup.state)
        if state._cup.state is CupState.HELD:
            # A held cup never goes below the table by more than the lag of the arm.
            assert state._cup.p[2] > 0.405
    assert seen == {CupState.STANDING, CupState.HELD}


def test_an_uncompensated_angle_misdirects_the_hand():
    off = np.array([0.1, 0.0, 0.05])
    angle = math.radians(-50.0)
    np.testing.assert_allclose(_misdirected(off, angle), orientation(0.0, 0.0, -angle) @ off)
    np.testing.assert_array_equal(_misdirected(off, 0.0), off)


def test_the_angle_is_learnt_up_to_the_adaptation():
    experience, angle = Experience(), -1.0
    errors = []
    for _ in range(200):
        experience.learn(TRAITS, angle)
        errors.append(abs(TRAITS.adaptation * angle - experience.turn))
    assert errors == sorted(errors, reverse=True)
    assert experience.turn == pytest.approx(TRAITS.adaptation * angle, abs=1e-3)


def test_operators_differ_in_the_varied_traits_only():
    drawn = Traits.drawn(np.random.default_rng(0), Traits(speed=0.2))
    assert all(getattr(drawn, name) != getattr(TRAITS, name) for name in VARIED)
    assert drawn.patience == TRAITS.patience
    assert drawn.speed > 0.1

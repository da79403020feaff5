"""Scripted operators with a point as the arm: behaviour while it moves and when it stops."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from tcs.teleop.control.session import Step
from tcs.teleop.control.settings import Command, Mode, Settings
from tcs.teleop.line import Line
from tcs_studies.operators import (
    Experience,
    GaussMarkovProcess,
    OperatorTraits,
    Recovery,
    ScriptedOperator,
)

LINE = Line((0.0, 0.0, 1.0), (1.0, 0.0, 1.0))
SETTINGS = Settings(limits="paper")
STEADY = replace(OperatorTraits(), misjudging=1e-9, tremor=0.0)


class Point:
    """A tool that follows commands, up to a wall that some recovery opens."""

    def __init__(self, opens=lambda point: False, wall=0.75):
        self.p, self.turned, self.time, self.sideways = np.array(LINE.start), 0.0, 0.0, 0.0
        self.opens, self.wall = opens, wall
        self.commands = []

    def step(self, command):
        self.time += SETTINGS.period
        self.commands.append(command)
        stopped = False
        if not command.clutch and command.group is None:
            after = self.p + np.asarray(command.linear) * SETTINGS.period
            stopped = after[0] > self.wall and not self.opens(self)
            if stopped:
                after[0] = min(after[0], self.wall)
                # At the wall the whole motion ends, as in the paper, unless it leads away.
                after = self.p if command.linear[0] > 0.0 else after
            self.p = after
        elif command.group == 0 and not command.clutch:
            self.turned += command.sign * SETTINGS.group_rate * SETTINGS.period
        return Step(
            time=self.time,
            joints=np.zeros(7),
            rates=np.zeros(7),
            R=np.eye(3),
            p=self.p,
            target_R=np.eye(3),
            target_p=self.p,
            mode=Mode.END_EFFECTOR,
            limits=np.zeros(7, np.int8),
            singular=False,
            singular_value=0.1,
            worst_joint=0,
            stopped=bool(stopped),
            reason="wall" if stopped else "",
        )


def drive(point, approach, *, traits=STEADY, habits=None, seed=0, seconds=60.0):
    habits = Experience() if habits is None else habits
    operator = ScriptedOperator(
        traits,
        habits,
        LINE,
        approach=approach,
        mode=Mode.END_EFFECTOR,
        settings=SETTINGS,
        rng=np.random.default_rng(seed),
    )
    path = []
    step = point.step(Command())
    while step.time < seconds and np.linalg.norm(step.p - LINE.end) > 0.02:
        step = point.step(operator.command(step))
        path.append(step.p)
    return np.array(path), habits


FREE = {"wall": 2.0}


@pytest.mark.parametrize("approach", Recovery)
def test_a_steady_operator_follows_the_line(approach):
    point = Point(**FREE)
    path, _ = drive(point, approach)
    assert np.abs(path[:, 1:] - [0.0, 1.0]).max() < 1e-6
    # 1 m at 0.06 m/s, the last 6 cm slower, and a quarter of a second of reaction.
    assert point.time == pytest.approx(1.0 / 0.06 + 0.25, abs=1.0)


def test_until_the_arm_stops_all_controllers_get_the_same_commands():
    """The same seed gives the same commands with every controller."""
    paths = []
    for approach in Recovery:
        point = Point()
        drive(point, approach, traits=OperatorTraits(), seconds=12.0, seed=4)
        paths.append(np.array([command.linear for command in point.commands]))
    np.testing.assert_array_equal(*paths)


def test_noise_causes_errors_that_the_operator_corrects():
    path, _ = drive(Point(**FREE), Recovery.HAND, traits=OperatorTraits(), seed=1)
    off = np.linalg.norm(path[:, 1:] - [0.0, 1.0], axis=1)
    # Misjudgement of 8 mm per coordinate gives errors of millimetres.
    assert 0.002 < off.max() < 0.05


def test_no_reaction_before_the_reaction_time():
    point = Point(**FREE)
    drive(point, Recovery.HAND, traits=replace(STEADY, reaction=0.4), seconds=2.0)
    speed = [np.linalg.norm(command.linear) for command in point.commands]
    first = next(i for i, value in enumerate(speed) if value > 1e-6)
    assert first * SETTINGS.period == pytest.approx(0.4, abs=0.03)


def test_the_hand_moves_on_for_the_reaction_time_when_the_arm_stops():
    point = Point(wall=0.3)
    drive(point, Recovery.GROUP, traits=replace(STEADY, reaction=0.3), seconds=12.0)
    pushing = [c.linear[0] > 0.05 for c in point.commands]
    first = pushing.index(True)
    last = first + pushing[first:].index(False)
    reached = 0.3 / 0.06 + 0.3 + STEADY.muscle
    assert last * SETTINGS.period == pytest.approx(reached + 0.3, abs=0.15)


def test_the_novel_controller_moves_group_1_with_the_clutch_between():
    point = Point(opens=lambda point: abs(point.turned) > 0.3)
    path, habits = drive(point, Recovery.GROUP)
    assert np.linalg.norm(path[-1] - LINE.end) < 0.021
    assert np.abs(path[:, 1:] - [0.0, 1.0]).max() < 1e-6
    kinds = ["clutch" if c.clutch else "group" if c.group == 0 else "hand" for c in point.commands]
    changes = [kinds[0], *(b for a, b in itertools.pairwise(kinds) if a != b)]
    assert changes == ["hand", "clutch", "group", "clutch", "hand"]
    assert kinds.count("clutch") * SETTINGS.period == pytest.approx(2.0, abs=0.05)
    # The successful recovery is remembered, to the length of a step.
    assert habits.turns[0] == pytest.approx(point.turned, abs=0.01)


def test_a_successful_recovery_is_tried_first_the_next_time():
    def opens(point):
        return point.turned > 1.0

    tried, habits = Point(opens=opens), Experience()
    drive(tried, Recovery.GROUP, habits=habits, seconds=120.0)
    again = Point(opens=opens)
    drive(again, Recovery.GROUP, habits=habits, seed=1, seconds=120.0)
    assert habits.turns[0] > 1.0
    assert again.time < tried.time
    groups = [c.sign for c in again.commands if c.group == 0]
    # The right direction at once; at most one more try where a period was missing.
    assert set(groups) == {1}


def test_the_direction_is_reversed_if_it_does_not_help():
    """The group can move by 0.5 rad in that direction only: the operator tries the other one."""

    class Limited(Point):
        def step(self, command):
            step = super().step(command)
            if command.group == 0 and abs(self.turned) > 0.5 and self.turned * command.sign > 0:
                self.turned = math.copysign(0.5, self.turned)
                step = replace(step, stopped=True, reason="limit")
            return step

    for seed in range(4):
        point = Limited(opens=lambda point: point.turned < -0.4)
        path, _ = drive(point, Recovery.GROUP, seed=seed, seconds=120.0)
        assert np.linalg.norm(path[-1] - LINE.end) < 0.021, seed


def test_end_effector_control_searches_with_the_hand_alone():
    def beside(point):
        return np.linalg.norm(point.p[1:] - [0.0, 1.0]) > 0.03 or point.p[0] > 0.76

    point = Point(opens=beside)
    path, habits = drive(point, Recovery.HAND, seconds=120.0)
    assert np.linalg.norm(path[-1] - LINE.end) < 0.021
    assert np.linalg.norm(path[:, 1:] - [0.0, 1.0], axis=1).max() > 0.03
    assert all(c.group is None and not c.clutch for c in point.commands)
    assert any(np.linalg.norm(c.angular) > 0.1 for c in point.commands)
    assert 0 in habits.motions


def test_recoveries_grow():
    point = Point()
    drive(point, Recovery.GROUP, seconds=60.0)
    runs, length = [], 0
    for command in point.commands:
        if command.group == 0:
            length += 1
        elif length:
            runs.append(length * SETTINGS.period * SETTINGS.group_rate)
            length = 0
    # The first four add up to less than half a turn, then the direction is reversed. A period
    # more or less at either end.
    expected = STEADY.first_turn * STEADY.growth ** np.arange(4)
    np.testing.assert_allclose(runs[:4], expected, atol=0.01)


def test_drawn_operators_differ_and_depend_on_the_seed():
    first, second, again = (OperatorTraits.drawn(np.random.default_rng(seed)) for seed in (1, 2, 1))
    assert first == again
    assert first.speed != second.speed
    many = [OperatorTraits.drawn(np.random.default_rng(seed)).speed for seed in range(400)]
    # A standard error of 0.2 / 20 about the usual speed.
    assert np.median(many) == pytest.approx(OperatorTraits().speed, rel=0.04)
    assert np.std(np.log(many)) == pytest.approx(0.2, abs=0.03)


@pytest.mark.parametrize("period", [0.01, 0.05])
def test_the_variance_of_the_process_does_not_depend_on_the_period(period):
    wander = GaussMarkovProcess(np.random.default_rng(0), std=0.5, memory=0.3, period=period)
    values, rates = [], []
    for _ in range(20_000):
        wander.advance()
        values.append(wander.value)
        rates.append(wander.rate)
    # Correlated over 0.6 s: some hundred independent samples a coordinate, 3 % in all at 4 sigma.
    assert np.std(values) == pytest.approx(0.5, rel=0.12)
    assert np.std(rates) == pytest.approx(0.5 / 0.3, rel=0.12)
    # Its rate is the slope of its value: over two periods, less what the rate itself changes by.
    slope = np.gradient(np.array(values), period, axis=0)[1:-1]
    assert np.std(slope - np.array(rates)[1:-1]) < 0.5 * np.sqrt(period / 0.3) * np.std(rates) * 2.0


def test_a_tiny_time_constant_is_valid():
    habits = Experience(motions={0: np.zeros(6)})
    point = Point()
    drive(point, Recovery.HAND, habits=habits, seconds=25.0)
    assert all(np.isfinite([*c.linear, *c.angular]).all() for c in point.commands)

"""Phases of a trial, and the work on the device in each."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import DataFileError
from tcs.teleop import Command, Settings, Teleoperation
from tcs.teleop.line import Line
from tcs.teleop.runs.recorder import run_from_steps
from tcs_studies.experiment.metrics import DEVICE_MASS, effort, work_steps
from tcs_studies.experiment.phases import Phase, attempt_work, solution_part, work_over_time

READY = [0.0, 0.6, 0.0, -1.4, 0.0, 1.0, 0.0]
TIME = np.arange(400) / 100.0


def test_the_sum_of_the_steps_is_the_kinetic_energy_of_a_hand_that_speeds_up():
    # 1 m/s^2 for 4 s: every step of work is positive, and their sum is m (v1^2 - v0^2) / 2.
    hand = np.outer(0.5 * TIME**2, [0.6, 0.8, 0.0])
    speed = np.diff(hand[:, 0], axis=0)[[0, -1]] * 100.0 / 0.6
    energy = 0.5 * DEVICE_MASS * (speed[1] ** 2 - speed[0] ** 2)
    assert work_steps(TIME, hand).sum() == pytest.approx(energy, rel=1e-9)
    assert effort(TIME, hand) == work_steps(TIME, hand).mean()


def test_without_a_stop_there_is_no_solution():
    assert solution_part(np.zeros(5, bool), np.linspace(0, 1, 5)) is None


def test_a_solution_that_is_not_found_lasts_until_the_end():
    stopped = np.array([0, 0, 1, 0, 1, 0], bool)
    assert solution_part(stopped, np.array([0, 0.5, 0.7, 0.6, 0.72, 0.73])) == (2, 5)


@pytest.fixture(scope="module")
def forward_and_stop(iiwa):
    """Forward 0.1 m/s until the arm is stretched and stops, back and up, and forward again."""
    session = Teleoperation(iiwa, READY, Settings(limits="paper"))
    commands = [Command(linear=(0.2, 0, 0))] * 300
    commands += [Command(linear=(0.0, 0.0, -0.1))] * 150
    commands += [Command(linear=(0.1, 0, 0))] * 250
    rows = [(one, session.step(one)) for one in commands]
    start = rows[0][1].p
    ends = {"line_start": start.tolist(), "line_end": [start[0] + 0.35, *start[1:]]}
    return run_from_steps(iiwa, rows, ends)


def test_phases_share_time_and_work_without_remainder(forward_and_stop):
    run = forward_and_stop
    assert run.stopped.any()
    found = work_over_time(run, run.line)
    phases = found.phases()
    assert list(phases) == list(Phase)
    assert sum(one.seconds for one in phases.values()) == pytest.approx(found.seconds)
    assert sum(one.work for one in phases.values()) == pytest.approx(found.work.sum())
    assert sum(one.steps for one in phases.values()) == len(run) - 2
    begin, _ = found.solution
    assert begin == pytest.approx(run.time[np.argmax(run.stopped)] - run.time[0])
    # The hand speeds up at the start, and turns twice in the solution.
    assert phases[Phase.SOLUTION].work > phases[Phase.START].work


def test_a_run_without_a_line_has_no_phases(iiwa, forward_and_stop):
    from dataclasses import replace

    assert forward_and_stop.line == Line(*map(tuple, forward_and_stop.metadata.values()))
    for metadata in ({}, {"line_start": [0, 0, 0], "line_end": "there"}):
        with pytest.raises(DataFileError, match="no line"):
            attempt_work(replace(forward_and_stop, metadata=metadata), 0.02)

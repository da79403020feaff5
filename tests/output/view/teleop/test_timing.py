from __future__ import annotations

import pytest

from tcs.output.view.teleop.timing import MOST_AT_ONCE, Durations, StepClock


class Clock:
    """A clock that each sleep advances slightly too far."""

    def __init__(self, over=1e-4):
        self.now, self.over = 100.0, over

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds + self.over


def paced(over=1e-4):
    clock = Clock(over)
    return clock, StepClock(0.01, clock, clock.sleep)


def test_steps_do_not_drift():
    clock, pace = paced()
    steps = sum(pace.wait()[0] for _ in range(1000))
    assert steps == 1000
    # The schedule is absolute, so the excess does not accumulate over 1000 steps.
    assert clock.now == pytest.approx(100.0 + 10.0 + 1e-4, abs=1e-6)


def test_a_sleep_that_ends_early_takes_one_step():
    _, pace = paced(over=-1e-4)
    assert [pace.wait() for _ in range(5)] == [(1, 0)] * 5


def test_a_late_loop_makes_up_for_a_few_steps_and_drops_the_rest():
    clock, pace = paced()
    pace.wait()
    clock.now += 0.03
    assert pace.wait() == (3, 0)
    clock.now += 1.0
    taken, dropped = pace.wait()
    assert taken == MOST_AT_ONCE
    assert taken + dropped == 100
    assert pace.wait() == (1, 0)


def test_timing_reports_medians_and_dropped_steps():
    times = Durations()
    assert times.summary() == "none"
    for i in range(101):
        times.add(1e-3 * i)
    assert times.summary() == "median 50.00 ms, p99 99.00 ms"
    assert times.count == 101


def test_the_oldest_of_many_durations_are_dropped(monkeypatch):
    monkeypatch.setattr("tcs.output.view.teleop.timing._KEPT", 10)
    times = Durations()
    for i in range(100):
        times.add(float(i))
    assert times.count <= 20
    assert times.taken[-1] == 99.0

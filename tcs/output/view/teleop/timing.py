"""Steps of equal length in real time, and statistics of durations."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

MOST_AT_ONCE = 5
"""Greatest number of steps that a late loop makes up for at once. The others are dropped: the arm
pauses for their time, and never takes a larger step."""
_KEPT = 100_000
"""Least number of latest durations kept: a quarter of an hour at 100 Hz."""


class StepClock:
    """Clock of steps on an absolute schedule, so that it does not drift."""

    def __init__(
        self,
        period: float,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Start the clock.

        Args:
            period: Time from one step to the next [s].
            clock: Returns the time [s].
            sleep: Waits for a time [s].
        """
        self._period, self._clock, self._sleep = period, clock, sleep
        self._begun = clock()
        self._steps = 0

    def wait(self) -> tuple[int, int]:
        """Wait until a step is due; return the numbers of steps to take, 1 or more, and to drop."""
        ahead = self._begun + (self._steps + 1) * self._period - self._clock()
        if ahead > 0.0:
            self._sleep(ahead)
        due = int((self._clock() - self._begun) / self._period) - self._steps
        # A sleep may end slightly early; the step is taken nevertheless.
        due = max(due, 1)
        taken = min(due, MOST_AT_ONCE)
        self._steps += due
        return taken, due - taken


@dataclass
class Durations:
    """Durations of a repeated action."""

    taken: array[float] = field(default_factory=lambda: array("d"))
    """The durations [s]."""

    def add(self, seconds: float) -> None:
        """Add a duration; beyond the capacity the oldest are dropped."""
        self.taken.append(seconds)
        if len(self.taken) > 2 * _KEPT:
            del self.taken[:_KEPT]

    @property
    def count(self) -> int:
        """Number of durations kept."""
        return len(self.taken)

    def summary(self) -> str:
        """Return median and 99th percentile as text."""
        if not self.taken:
            return "none"
        middle, late = np.percentile(np.array(self.taken), (50.0, 99.0)) * 1e3
        return f"median {middle:.2f} ms, p99 {late:.2f} ms"

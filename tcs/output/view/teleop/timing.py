"""Steps of equal length in real time, and durations."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

MOST_AT_ONCE = 5
"""Steps that a late loop catches up at once. Later ones are dropped: the arm then stands still for
as long, and never takes a larger step."""
_KEPT = 100_000
"""Durations that are kept: the last quarter of an hour at 100 Hz."""


class StepClock:
    """Clock of steps; without drift, as each step has its own due time."""

    def __init__(
        self,
        period: float,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Begin now.

        Args:
            period: From one step to the next [s].
            clock: Source of the time [s].
            sleep: Waits for so long [s].
        """
        self._period, self._clock, self._sleep = period, clock, sleep
        self._begun = clock()
        self._steps = 0

    def wait(self) -> tuple[int, int]:
        """Wait until a step is due; return how many to take, 1 or more, and how many to drop."""
        ahead = self._begun + (self._steps + 1) * self._period - self._clock()
        if ahead > 0.0:
            self._sleep(ahead)
        due = int((self._clock() - self._begun) / self._period) - self._steps
        # A sleep may end a hair early; the step is due all the same.
        due = max(due, 1)
        taken = min(due, MOST_AT_ONCE)
        self._steps += due
        return taken, due - taken


@dataclass
class Durations:
    """Durations of a repeated action."""

    taken: array[float] = field(default_factory=lambda: array("d"))
    """[s]."""

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
        """Return median and 99th percentile in words."""
        if not self.taken:
            return "none"
        middle, late = np.percentile(np.array(self.taken), (50.0, 99.0)) * 1e3
        return f"median {middle:.2f} ms, p99 {late:.2f} ms"

"""Work on the device over time, and the phases of a trial: START, SOLUTION, FINISH.

The null-space paper shows a trial as four steps (Figures 6 and 7): the start, the joint limit, a
solution that avoids it, and the finish; Figures 10 and 11 show the work on the device over time,
with the SOLUTION part in grey. It does not say where that part begins and ends; see
`solution_part`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from tcs.errors import DataFileError
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.teleop.line import Line
from tcs.teleop.runs.recorder import last_attempt
from tcs.teleop.runs.run import Run
from tcs_studies.experiment.metrics import completion_time, work_steps

PAST = 0.05
"""Fraction of the line by which the tool must have passed the farthest stop to have left it."""


class Phase(StrEnum):
    """Part of a trial."""

    START = "start"
    """From the start of the line until the arm first stops: at the joint limit."""
    SOLUTION = "solution"
    """Until the tool has passed all stops."""
    FINISH = "finish"
    """The rest of the line."""


@dataclass(frozen=True, slots=True)
class PhaseWork:
    """Duration of a phase and work on the device in it."""

    seconds: float
    """Duration [s]."""
    work: float
    """Sum of the absolute work of the steps [J]."""
    steps: int
    """Number of steps."""


@dataclass(frozen=True, eq=False)
class WorkOverTime:
    """Absolute work on the device from sample to sample: Figure 10."""

    time: FloatArray
    """Time of each step since the beginning [s], shape (k,)."""
    work: FloatArray
    """Absolute work of each step [J], shape (k,)."""
    solution: tuple[float, float] | None
    """Beginning and end of the SOLUTION part [s]; None if the arm never stopped."""
    seconds: float
    """Duration of the whole [s]."""

    def to_json(self) -> dict[str, Any]:
        """Return phases and total as plain values."""
        return {
            "seconds": self.seconds,
            "work": float(self.work.sum()),
            "solution": None if self.solution is None else list(self.solution),
            "phases": {
                phase.value: {"seconds": part.seconds, "work": part.work, "steps": part.steps}
                for phase, part in self.phases().items()
            },
        }

    def phases(self) -> Mapping[Phase, PhaseWork]:
        """Return duration and work of each phase; without a stop, all belongs to START."""
        begin, end = self.solution or (self.seconds, self.seconds)
        inner = (self.time >= begin) & (self.time < end)
        parts = {
            Phase.START: (begin, self.time < begin),
            Phase.SOLUTION: (end - begin, inner),
            Phase.FINISH: (self.seconds - end, self.time >= end),
        }
        return {
            phase: PhaseWork(float(seconds), float(self.work[inside].sum()), int(inside.sum()))
            for phase, (seconds, inside) in parts.items()
        }


def attempt_work(run: Run, radius: float) -> WorkOverTime:
    """Return the steps of work of the last attempt of a run at its line.

    Args:
        run: The run, with a line in its metadata.
        radius: Radius of the sphere at the end of the line, where the attempt ends [m].

    Raises:
        DataFileError: If the run has no line, or the attempt has fewer than three samples.
    """
    if run.line is None:
        raise DataFileError(
            "run: its metadata contain no line, which divides it into phases. Record one with "
            "`tcs teleop --line --save RUN`, or `tcs teleop experiment --runs`."
        )
    return work_over_time(run, run.line, attempt(run, run.line, radius))


def work_over_time(run: Run, line: Line, samples: slice = slice(None)) -> WorkOverTime:
    """Return the steps of work of a run over time.

    Args:
        run: The run.
        line: The line that it followed.
        samples: The samples to use.

    Raises:
        DataFileError: If there are fewer than three samples.

    Source:
        Null-space paper, eq. (16) and Figure 10.
    """
    hand, _ = run.hand()
    time = run.time[samples] - run.time[samples][0]
    part = solution_part(run.stopped[samples], line.fraction_at(run.position[samples]))
    return WorkOverTime(
        time=time[1:-1],
        work=work_steps(time, hand[samples]),
        solution=None if part is None else (float(time[part[0]]), float(time[part[1]])),
        seconds=float(time[-1]),
    )


def solution_part(stopped: BoolArray, fractions: FloatArray) -> tuple[int, int] | None:
    """Return the first sample of the SOLUTION part and the first one after it.

    It begins when the arm first stops, and ends when the tool is beyond the farthest point at
    which the arm stopped, by `PAST` of the line, after the last stop; if that does not happen, with
    the last sample.

    Args:
        stopped: Whether the arm did not follow the command, shape (n,).
        fractions: Position of the tool along the line as a fraction of it, shape (n,).

    Returns:
        Two sample numbers; None if the arm never stopped.

    >>> stopped = np.array([0, 0, 1, 1, 0, 1, 0, 0, 0], bool)
    >>> solution_part(stopped, np.array([0, 0.4, 0.7, 0.7, 0.9, 0.75, 0.78, 0.81, 0.9]))
    (2, 7)
    """
    stops = np.flatnonzero(stopped)
    if not stops.size:
        return None
    passed = np.flatnonzero(fractions[stops[-1] :] > fractions[stops].max() + PAST)
    end = stops[-1] + passed[0] if passed.size else len(stopped) - 1
    return int(stops[0]), int(end)


def attempt(run: Run, line: Line, radius: float) -> slice:
    """Return the samples of the last attempt of a run at a line, until its end is reached.

    Args:
        run: The run; an attempt begins with the first command after the arm was put back.
        line: The line.
        radius: Radius of the sphere at the end of the line [m].
    """
    first = last_attempt(run)
    took = completion_time(run.time[first:], run.position[first:], line, radius=radius)
    if took is None:
        return slice(first, len(run))
    return slice(first, int(np.searchsorted(run.time, run.time[first] + took, side="right")))

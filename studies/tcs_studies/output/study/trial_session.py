"""Live trials of a study: the page of one condition, and the end of each trial."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from tcs.output.view.teleop.session import LiveOptions, LiveSession
from tcs.teleop import Command, Step
from tcs.teleop.line import GOAL_RADIUS
from tcs.teleop.runs.run import Run
from tcs_studies.study.study_file import Study

_SLICE = 0.1
"""Interval at which the end of a trial is checked [s]."""
_PAUSE = 1.5
"""Time for which the end of a trial stays visible [s]."""


class TrialSession:
    """The live page of one condition of a study.

    Attributes:
        url: Address of the page.
    """

    def __init__(
        self, study: Study, condition: str, *, port: int | None, on_stop: Callable[[str], None]
    ) -> None:
        """Open the page.

        Args:
            study: The study.
            condition: Name of a condition that has a behaviour at joint limits.
            port: Port of the page; None for the first free one.
            on_stop: Called with the reason whenever the arm stops.

        Raises:
            OutputError: If the port cannot be used.
            TcsError: If the robot or the line of the study cannot be used.
        """
        plan, entry = study.plan, study.condition(condition)
        assert entry.limits is not None
        self._course, self._time_limit = study.course, plan.time_limit
        self._session = LiveSession(
            LiveOptions(
                robot=plan.robot, behaviour=entry.limits, condition=condition,  # type: ignore[arg-type]
                torso_height=plan.torso_height or None, course=study.course,
            ),
            port=port, on_stop=on_stop, record=True, on_step=self._watch,
        )  # fmt: skip
        self.url = self._session.url
        self._first: float | None = None
        self._is_over = False

    def run(self, duration: float | None = None) -> Run | None:
        """Return the run of one trial, from the start posture to the end of the line.

        A trial ends at the end of the line, or when its time limit is over since the first motion.

        Args:
            duration: Longest wait for its end [s]; None to wait until interrupted.

        Returns:
            The run; None if the wait was over before.
        """
        self._first, self._is_over = None, False
        self._session.begin()
        end = None if duration is None else time.monotonic() + duration
        while not self._is_over:
            if end is not None and time.monotonic() >= end:
                return None
            self._session.page.run(_SLICE)
        run = self._session.run()
        self._session.page.run(_PAUSE)
        return run

    def close(self) -> None:
        """Close the page: its port is free again."""
        self._session.close()

    def _watch(self, command: Command, step: Step) -> None:
        """Find the end of the trial; an arm that was put back to the start begins again."""
        if np.array_equal(step.joints, self._course.joints):
            self._first = None
            return
        if self._first is None:
            self._first = step.time
        left = float(np.linalg.norm(step.p - np.asarray(self._course.line.end)))
        if left <= GOAL_RADIUS or step.time - self._first >= self._time_limit:
            self._is_over = True

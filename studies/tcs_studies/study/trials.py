"""Runs of trials: check that a run is the trial that is due, and take its measures."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from tcs.errors import DataFileError, one_line
from tcs.teleop.line import GOAL_RADIUS, Course
from tcs.teleop.runs.recorder import last_attempt
from tcs.teleop.runs.run import ARRAYS, SCRIPTED_TYPE, Run
from tcs_studies.experiment.trial import TrialMeasures, measure
from tcs_studies.study.steps import Step
from tcs_studies.study.study_file import Study

_SAME_LINE = 1e-6
"""Greatest difference of the ends of two lines that are the same [m]."""
_LEAST = 16
"""Least number of samples of an attempt, as the filter of the measures needs."""


def check_run(study: Study, step: Step, run: Run, where: str) -> None:
    """Check that a run is of the robot, the line and the condition of a trial, and can be measured.

    Args:
        study: The study.
        step: The trial.
        run: The run.
        where: Name of the run in messages.

    Raises:
        DataFileError: If it is not.
    """
    metadata = run.metadata
    entry = study.condition(step.condition or "")
    expected = {"robot": study.plan.robot, "condition": entry.name, "limits": entry.limits}
    if entry.limits is None:
        # Another program, or a mode of the live page with another device, drives this condition.
        del expected["limits"]
        if metadata.get("condition") not in study.conditions:
            del expected["condition"]
    elif is_scripted(run):
        # The settings of a scripted operator belong to its condition.
        del expected["limits"]
    for key, value in expected.items():
        if metadata.get(key) != value:
            raise DataFileError(
                f"{where}: its {key} is '{one_line(str(metadata.get(key)))}', but the next trial "
                f"needs '{value}'. Give the run of that trial."
            )
    if not _is_on(metadata, study):
        raise DataFileError(
            f"{where} was not recorded on the line of the study. Record it with `tcs study "
            "record`, or with `tcs teleop --line --save`."
        )
    try:
        trial_measures(study, run)
    except DataFileError as error:
        raise DataFileError(f"{where}: {error}") from None


def _is_on(metadata: Mapping[str, Any], study: Study) -> bool:
    """Return whether the metadata of a run name the line of a study."""
    try:
        ends = np.array([metadata["line_start"], metadata["line_end"]], dtype=np.float64)
    except (KeyError, OverflowError, TypeError, ValueError):
        return False
    line = np.array([study.line.start, study.line.end])
    return ends.shape == line.shape and bool((np.abs(ends - line) <= _SAME_LINE).all())


def is_scripted(run: Run) -> bool:
    """Return whether a run is of a scripted operator."""
    return run.metadata.get("operator_type") == SCRIPTED_TYPE


def trial_measures(study: Study, run: Run) -> TrialMeasures:
    """Return the measures of a trial, those of the experiment with scripted operators.

    Raises:
        DataFileError: If the run has too few samples, or the hand did not move.
    """
    attempt = attempt_of(run, study.course, study.plan.time_limit)
    return measure(attempt, study.course, time_limit=study.plan.time_limit)


def attempt_of(run: Run, course: Course, time_limit: float) -> Run:
    """Return the last attempt of a run, until the end of the line or the time limit.

    An attempt begins with the first command after the arm was put back to the start. A scripted
    operator's run is one attempt.

    Args:
        run: The run.
        course: The line and the start posture.
        time_limit: Time limit of a trial [s].

    Raises:
        DataFileError: If it has too few samples.
    """
    first = 0 if is_scripted(run) else last_attempt(run)
    time = run.time[first:] - run.time[first]
    ahead = np.linalg.norm(run.position[first:] - np.asarray(course.line.end), axis=1)
    ended = np.flatnonzero((ahead <= GOAL_RADIUS) | (time >= time_limit))
    stop = first + int(ended[0]) + 1 if len(ended) else len(run)
    if stop - first < _LEAST:
        raise DataFileError(
            f"its last attempt at the line has {stop - first} samples; at least {_LEAST} are "
            "needed. Was the arm put back to the start at the end? Record the trial again."
        )
    arrays = {name: getattr(run, name)[first:stop].copy() for name in ARRAYS}
    return dataclasses.replace(run, **arrays)

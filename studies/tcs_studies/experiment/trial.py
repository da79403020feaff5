"""One trial: a scripted operator follows the line with one controller; a run records it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.errors import TcsError
from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import Arm
from tcs.teleop.control.latency import NO_LATENCY, DelayLine, Latency
from tcs.teleop.control.session import Teleoperation
from tcs.teleop.control.settings import Command, Mode, Settings
from tcs.teleop.line import GOAL_RADIUS, Course, Line
from tcs.teleop.runs.recorder import last_attempt, run_from_steps
from tcs.teleop.runs.run import SCRIPTED_TYPE, Run
from tcs_studies.experiment.metrics import (
    Accuracy,
    completion_time,
    effort,
    resampled,
    spectral_arc_length,
    steering_angle,
    steering_translation,
    trajectory_accuracy,
)
from tcs_studies.experiment.phases import work_over_time
from tcs_studies.operators import Experience, OperatorTraits, Recovery, ScriptedOperator

TIME_LIMIT = 120.0
"""Time limit of a trial [s] (paper, experiment information, part 3)."""


@dataclass(frozen=True, slots=True)
class Condition:
    """A controller, and the recovery of an operator when the arm stops."""

    name: str
    title: str
    """Title for readers."""
    mode: Mode
    """Mode in which the hand moves the tool."""
    approach: Recovery
    """Recovery when the arm stops."""
    settings: Settings
    """Settings of the controller."""


END_EFFECTOR = Condition(
    "end-effector", "end-effector control", Mode.END_EFFECTOR, Recovery.HAND,
    Settings(limits="paper"),
)  # fmt: skip
NOVEL = Condition(
    "novel", "novel controller", Mode.END_EFFECTOR, Recovery.GROUP, Settings(limits="paper")
)
ASSISTED = Condition(
    "assisted", "automatic assistance", Mode.ASSISTED, Recovery.HAND, Settings(limits="clamped")
)
CONDITIONS = (END_EFFECTOR, NOVEL, ASSISTED)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialMeasures:
    """Measures of a trial, or their means over several trials."""

    accuracy: float
    """Greatest distance between barycentre and line [m]."""
    time: float
    """Completion time, or the time limit if the end was not reached [s]."""
    effort: float
    """Mean absolute work on the device from sample to sample [J]."""
    work: float
    """Sum of that work over the trial [J], which is independent of the hand's time at rest."""
    steering_angle: float
    """Total rotation of the hand [rad]."""
    steering_translation: float
    """Total translation of the hand [m]."""
    arc_length: float
    """Spectral arc length of the hand's speed."""
    stops: float
    """Number of stops of the arm."""
    turned: float
    """Total rotation of joint 1 by motion of joint group 1 [rad]."""
    finished: float
    """1 if the end was reached in time, else 0."""
    planes_met: float
    """Number of planes with samples, of 30."""
    start_time: float
    """Time until the arm first stopped: the START phase [s]."""
    start_work: float
    """Absolute work on the device in that phase [J]."""
    solution_time: float
    """Time from the first stop until the tool has passed all stops: the SOLUTION phase [s]."""
    solution_work: float
    """Absolute work on the device in that phase [J]."""
    finish_time: float
    """Time on the rest of the line: the FINISH phase [s]."""
    finish_work: float
    """Absolute work on the device in that phase [J]."""


MEASURES = tuple(TrialMeasures.__dataclass_fields__)


def run_trial(
    arm: Arm,
    course: Course,
    condition: Condition,
    traits: OperatorTraits,
    habits: Experience,
    rng: np.random.Generator,
    *,
    time_limit: float = TIME_LIMIT,
    latency: Latency = NO_LATENCY,
    metadata: Mapping[str, Any] | None = None,
) -> Run:
    """Return the run of an operator until the end of the line is reached or the time is over.

    Args:
        arm: The arm.
        course: Line and start posture.
        condition: The controller.
        traits: Traits of the operator.
        habits: Successful recoveries with this controller; updated in place.
        rng: Random generator.
        time_limit: Time limit of the trial [s].
        latency: Latency of commands and pictures. The run holds each command with the step that
            executes it.
        metadata: Further metadata of the run.

    Raises:
        TcsError: If the start posture is beyond a limit, the tool is not at the start of the line,
            or an end of the line is out of reach.
    """
    check_course(arm, course)
    session = Teleoperation(arm, course.joints, condition.settings, condition.mode)
    operator = ScriptedOperator(
        traits, habits, course.line, approach=condition.approach, mode=condition.mode,
        settings=condition.settings, rng=rng,
    )  # fmt: skip
    command = Command()
    step = session.step(command)
    rows = [(command, step)]
    period = condition.settings.period
    commands = DelayLine(latency.command, period, command)
    pictures = DelayLine(latency.picture, period, step)
    end = np.asarray(course.line.end)
    while step.time < time_limit and np.linalg.norm(step.p - end) > GOAL_RADIUS:
        command = commands.send(operator.command(pictures.send(step)))
        step = session.step(command)
        rows.append((command, step))
    origin = {
        "robot": arm.name,
        "torso_height": arm.torso_height,
        "condition": condition.name,
        "operator_type": SCRIPTED_TYPE,
        "line_start": list(course.line.start),
        "line_end": list(course.line.end),
        **latency.to_json(),
    }
    return run_from_steps(arm, rows, {**origin, **(metadata or {})})


def check_course(arm: Arm, course: Course) -> None:
    """Check that an arm can start on a line, and that both ends are within its length.

    Raises:
        TcsError: If the start posture is beyond a limit, the tool is not at the start of the line,
            or an end of the line is out of reach.
    """
    outside = arm.limit_violation(course.joints)
    if outside:
        raise TcsError(f"start posture: {outside}. Give one within them.")
    tool = arm.link_poses(course.joints)[-1, :3, 3]
    off = float(np.linalg.norm(tool - course.line.start))
    if off > GOAL_RADIUS:
        raise TcsError(
            f"start posture: the tool is {off:.3f} m from the line's start; it must be within "
            f"{GOAL_RADIUS:g} m. Give a posture with the tool at the start."
        )
    shoulder = arm.frames[0, :3, 3]
    length = float(np.linalg.norm(arm.frames[1:, :3, 3], axis=1).sum())
    for what, point in (("start", course.line.start), ("end", course.line.end)):
        away = float(np.linalg.norm(shoulder - point))
        if away > length:
            raise TcsError(
                f"line out of reach: its {what} is {away:.2f} m from the first joint of "
                f"'{arm.name}', whose arm is {length:.2f} m long. Give a shorter line, or find one "
                "with `find_course`."
            )


def measure(run: Run, course: Course, *, time_limit: float = TIME_LIMIT) -> TrialMeasures:
    """Return the measures of a trial.

    Steering is filtered and resampled as in the ITCM thesis; effort is not, as in the null-space
    paper.

    Args:
        run: The trial.
        course: The line and the start posture.
        time_limit: Completion time to report if the end was not reached [s].
    """
    line = course.line
    path = trajectory_accuracy(run.position, line)
    took = completion_time(run.time, run.position, line, radius=GOAL_RADIUS)
    hand, angles = run.hand()
    _, steered = resampled(run.time, np.hstack([hand, np.unwrap(angles, axis=0)]))
    time, smooth = resampled(run.time, hand)
    speed = np.linalg.norm(np.diff(smooth, axis=0), axis=1) / np.diff(time)
    stops = np.flatnonzero(np.diff(run.stopped.astype(int)) == 1)
    turning = (run.group == 0) & ~run.clutch
    mean_work = effort(run.time, hand)
    phases = work_over_time(run, line).phases()
    return TrialMeasures(
        accuracy=path.worst,
        time=time_limit if took is None else took,
        effort=mean_work,
        work=mean_work * (len(run) - 2),
        steering_angle=steering_angle(steered[:, 3:]),
        steering_translation=steering_translation(steered[:, :3]),
        arc_length=spectral_arc_length(speed, 1.0 / float(time[1] - time[0])),
        stops=float(len(stops)),
        turned=float(np.abs(run.rates[turning, 0]).sum() * run.step),
        finished=0.0 if took is None else 1.0,
        planes_met=float(path.planes_met),
        **{f"{phase}_time": part.seconds for phase, part in phases.items()},
        **{f"{phase}_work": part.work for phase, part in phases.items()},
    )


def mean_measures(trials: list[TrialMeasures]) -> TrialMeasures:
    """Return the mean of each measure over trials."""
    means: dict[str, float] = {
        name: float(np.mean([getattr(trial, name) for trial in trials])) for name in MEASURES
    }
    return TrialMeasures(**means)


def sampled_path(run: Run, count: int = 200) -> FloatArray:
    """Return at most `count` points of the tool's path, evenly spaced in time [m], shape (k, 3)."""
    rows = np.linspace(0, len(run) - 1, min(count, len(run))).astype(int)
    return np.asarray(run.position[rows])


@dataclass(frozen=True, slots=True)
class LineResult:
    """The paper's metrics of the last attempt of a run at a line."""

    time: float | None
    """Completion time [s]; None if the end was not reached."""
    distance_left: float
    """Distance from the last tool position to the end [m]."""
    accuracy: Accuracy | None
    """Trajectory accuracy until completion; None if the end was not reached."""


def line_result(run: Run, line: Line) -> LineResult:
    """Return the metrics of the last attempt of a run at a line.

    Args:
        run: The run; an attempt begins with the first command after the arm was put back.
        line: The line.
    """
    first = last_attempt(run)
    time, position = run.time[first:], run.position[first:]
    left = float(np.linalg.norm(position[-1] - line.end))
    took = completion_time(time, position, line, radius=GOAL_RADIUS)
    if took is None:
        return LineResult(None, left, None)
    return LineResult(took, left, trajectory_accuracy(position[time - time[0] <= took], line))

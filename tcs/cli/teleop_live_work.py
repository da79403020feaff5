"""What `tcs teleop` and `tcs teleop replay` do: an arm or a run becomes a page in the browser."""

from __future__ import annotations

import math
import time
import webbrowser
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import typer

import tcs
from tcs.cli import talk
from tcs.cli.places import check_page, check_writable
from tcs.cli.teleop_work import torso_lift
from tcs.errors import DataFileError, TcsError
from tcs.files.writing import whole_file
from tcs.model.robots import RobotFile, load_robot
from tcs.output.view import open_meshcat
from tcs.output.view.teleop import (
    LivePage,
    Recorder,
    Replay,
    RobotDisplay,
    RunView,
    replay_page,
    start_posture,
)
from tcs.output.view.teleop.robot_display import draw_course
from tcs.teleop import Arm, Mode, Settings, load_arm
from tcs.teleop.control.settings import LimitBehaviour
from tcs.teleop.experiment.course import Course, find_course
from tcs.teleop.experiment.metrics import PLANES, completion_time, trajectory_accuracy
from tcs.teleop.experiment.trial import GOAL_RADIUS
from tcs.teleop.line import Line
from tcs.teleop.runs.files import check_format, load_run, save_run
from tcs.teleop.runs.recorder import begun_at
from tcs.teleop.runs.run import Run

MODES: Mapping[str, tuple[Mode, ...]] = {
    "end-effector": (Mode.END_EFFECTOR,),
    "novel": (Mode.END_EFFECTOR, Mode.NULL_SPACE, Mode.POSE),
    "assisted": (Mode.ASSISTED, Mode.NULL_SPACE, Mode.POSE),
    "drake": (Mode.DRAKE, Mode.NULL_SPACE, Mode.POSE),
}
"""Between which modes a person can change, by condition."""
_KEYS = (
    "W/S ahead, A/D sideways, R/F up and down, U/O roll, I/K tip, J/L turn; M next mode, "
    "1-4 joint group, Q/E turn it; C clutch, space all to zero, X back to the start."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """The live page as the command line gives it."""

    robot: str
    behaviour: LimitBehaviour
    condition: str
    start_deg: tuple[float, ...] | None
    lift: float | None
    line: bool
    save: Path | None


def drive(asked: Asked, *, port: int | None, browser: bool, duration: float | None) -> None:
    """Let a person drive an arm until Ctrl-C, or for `duration` [s], and save what was driven.

    Raises:
        OutputError: If it cannot listen at that port, or the run not be written.
        TcsError: If the robot cannot be used, or the start posture is beyond a limit.
    """
    if asked.save is not None:
        check_format(asked.save)
        check_writable(asked.save)
    robot = load_robot(asked.robot)
    arm = load_arm(robot, torso_height=torso_lift(robot, asked.lift))
    start = None if asked.start_deg is None else _start(arm, asked.start_deg)
    meshcat = open_meshcat(port)
    stage = RobotDisplay(arm, meshes=True)
    course = None
    if asked.line:
        talk.say("looking for a line that needs the arm reshaped; that takes some seconds.")
        course = find_course(arm)
        start = course.joints
    settings = Settings(limits=asked.behaviour)
    recorder = Recorder(arm)
    page = LivePage(
        meshcat,
        stage,
        arm,
        start_posture(arm, stage) if start is None else start,
        settings=settings,
        modes=MODES[asked.condition],
        tell=typer.echo,
        on_step=None if asked.save is None and course is None else recorder.add,
    )
    if course is not None:
        ends = np.array(course.line.start), np.array(course.line.end)
        draw_course(meshcat, *ends, GOAL_RADIUS)
    talk.say(f"{robot.title}, {asked.condition}, limits as in {asked.behaviour}. {_KEYS}")
    talk.say(f"open {meshcat.web_url()} in a browser; Ctrl-C ends.")
    if browser:
        webbrowser.open(meshcat.web_url())
    begun = time.perf_counter()
    try:
        page.run(duration)
    except KeyboardInterrupt:
        talk.say(f"closed after {time.perf_counter() - begun:.0f} s.")
    finally:
        run = recorder.run(_metadata(asked, arm, course))
        if asked.save is not None:
            _save(asked.save, run)
    if course is not None and run is not None:
        typer.echo(_followed(run, course.line))
    late = f"; {page.dropped} steps dropped, as the loop was late" if page.dropped else ""
    talk.say(
        f"{page.steps.count} control steps: {page.steps.summary()}; {page.pictures.count} "
        f"pictures: {page.pictures.summary()}{late}."
    )


def _start(arm: Arm, degrees: tuple[float, ...]) -> Any:
    """Return a start posture [rad], shape (7,)."""
    start = arm.checked([math.radians(value) for value in degrees], "start posture")
    outside = arm.limit_violation(start)
    if outside:
        raise TcsError(f"start posture: {outside}. Give one within them with --start-deg.")
    return start


def _metadata(asked: Asked, arm: Arm, course: Course | None) -> dict[str, Any]:
    """Return what a run says about itself."""
    said: dict[str, Any] = {
        "tcs": tcs.__version__,
        "robot": asked.robot,
        "lift": arm.torso_height,
        "condition": asked.condition,
        "limits": asked.behaviour,
        "operator_kind": "whoever drove the live page",
    }
    if course is not None:
        said |= {"line_start": list(course.line.start), "line_end": list(course.line.end)}
    return said


def _save(path: Path, run: Run | None) -> None:
    """Write what was driven, if it is a run."""
    if run is None:
        talk.say(f"no browser has looked, so nothing was driven: '{path}' is not written.")
        return
    save_run(path, run)
    typer.echo(f"wrote {path}: {len(run)} samples, {run.time[-1] - run.time[0]:.1f} s")


def _followed(run: Run, line: Line) -> str:
    """Return how well a line was followed in the last try, as the paper measures it."""
    time, position = run.time[begun_at(run) :], run.position[begun_at(run) :]
    took = completion_time(time, position, line, radius=GOAL_RADIUS)
    if took is None:
        away = float(np.linalg.norm(position[-1] - line.end))
        return f"the end of the line was not reached: {1e3 * away:.0f} mm are left."
    accuracy = trajectory_accuracy(position[time - time[0] <= took], line)
    return (
        f"the line took {took:.1f} s; the mean path was {1e3 * accuracy.worst:.1f} mm off it at "
        f"worst ({accuracy.planes_met} of {PLANES} planes met)."
    )


def _film(path: Path, robot: str | None) -> tuple[RunView, RobotFile]:
    """Return what a file holds, and its robot.

    Raises:
        DataFileError: If it cannot be read, or does not say whose run it is.
    """
    run = load_run(path)
    named = robot or run.metadata.get("robot")
    if not isinstance(named, str):
        raise DataFileError(f"run '{path}' does not say whose it is. Name its robot with --robot.")
    lift = run.metadata.get("lift", 0.0)
    if isinstance(lift, bool) or not isinstance(lift, int | float) or not math.isfinite(lift):
        raise DataFileError(f"run '{path}': its 'lift' is {lift!r}, but must be a number [m].")
    file = load_robot(named)
    try:
        return RunView(load_arm(file, torso_height=lift), run), file
    except DataFileError as error:
        raise DataFileError(f"run '{path}': {error}") from None


def play(
    path: Path, robot: str | None, *, port: int | None, browser: bool, duration: float | None
) -> None:
    """Play a run until Ctrl-C, or for `duration` [s].

    Raises:
        OutputError: If it cannot listen at that port.
        DataFileError: If the file holds no run of that robot.
    """
    film, file = _film(path, robot)
    meshcat = open_meshcat(port)
    replay = Replay(meshcat, RobotDisplay(film.arm, meshes=True), film)
    typer.echo(f"{file.title}: {_summary(film)}")
    talk.say(f"open {meshcat.web_url()} in a browser; Ctrl-C ends.")
    if browser:
        webbrowser.open(meshcat.web_url())
    try:
        replay.run(duration)
    except KeyboardInterrupt:
        talk.say("closed.")


def export(path: Path, robot: str | None, page: Path, *, meshes: bool) -> dict[str, Any]:
    """Write a run as one page and return what was written.

    Raises:
        OutputError: If it cannot be written there.
        DataFileError: If the file holds no run of that robot.
    """
    check_page(page)
    film, file = _film(path, robot)
    notes = [_summary(film)]
    if meshes:
        notes.append(
            "This page holds the robot's meshes in another format: every triangle in its place, no "
            f"textures. Its robot file says of them: {file.source}"
        )
    stage = RobotDisplay(film.arm, meshes=meshes)
    text = replay_page(open_meshcat(), stage, film, title=file.title, notes=notes).encode()
    with whole_file(page, "Page") as stream:
        stream.write(text)
    return {
        "file": str(page),
        "bytes": len(text),
        "samples": len(film.run),
        "seconds": film.length,
        "meshes": meshes,
        "source": file.source if meshes else None,
    }


def report_page(result: dict[str, Any]) -> None:
    """Print what was written, and whose meshes went into it."""
    typer.echo(
        f"wrote {result['file']}: {result['bytes'] / 1e6:.1f} MB, {result['seconds']:.1f} s of "
        f"{result['samples']} samples"
    )
    if result["meshes"]:
        typer.echo(
            "It holds the robot's meshes; mind their licence when you pass it on. Its robot file "
            f"says of them: {result['source']}"
        )


def _summary(film: RunView) -> str:
    """Return what a run is, in one line."""
    said = film.run.metadata
    words = [f"{film.length:.1f} s, {len(film.run)} samples"]
    words += [f"controller {said['condition']}"] if "condition" in said else []
    if said.get("operator_kind") == "scripted":
        words.append(f"scripted operator {said.get('operator', '')}".strip() + ", not a person")
    return "; ".join(words)

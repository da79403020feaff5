"""The folder of an experiment with the teleoperated arm: page, tables, line, runs and maps."""

from __future__ import annotations

import csv
import io
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tcs.capability import save_map
from tcs.files.writing import make_folder, whole_file
from tcs.output.report.html import as_html
from tcs.output.report.markdown import as_markdown
from tcs.teleop import Arm
from tcs.teleop.line import Course
from tcs_studies.experiment.course import find_course
from tcs_studies.experiment.maps import ControllerMaps, check_map_robot, controller_maps
from tcs_studies.experiment.trial import MEASURES
from tcs_studies.experiment.within_subject import (
    Experiment,
    ExperimentPlan,
    run_experiment,
    trial_rows,
)
from tcs_studies.output.report.experiment.page import experiment_page

FILES = ("experiment.html", "experiment.md", "trials.csv", "line.json")


def make_experiment_folder(arm: Arm, out: Path, *, runs: bool, maps: bool) -> Path | None:
    """Make the folder of an experiment, after a check that its files can be written.

    Args:
        arm: The arm.
        out: The folder.
        runs: Whether the runs of counted trials are to be saved.
        maps: Whether capability maps are to be made.

    Returns:
        The folder of the run files; None where trials are not saved.

    Raises:
        OutputError: If the folder cannot be made.
        RobotError: If maps are to be made and the robot has no head file.
    """
    if maps:
        check_map_robot(arm)
    # After the checks, so that an error leaves no empty folder.
    folder = out / "runs" if runs else None
    make_folder(folder or out)
    return folder


def write_experiment(
    arm: Arm,
    plan: ExperimentPlan,
    out: Path,
    *,
    line_seed: int = 0,
    runs: bool = False,
    maps: bool = False,
    command: str,
    jobs: int = 1,
    on_progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Run an experiment, write its folder and return a summary as plain containers.

    Args:
        arm: The arm.
        plan: Operators, trials, seed and conditions.
        out: The folder for `FILES`, and for runs and maps if requested.
        line_seed: Seed of the search for the line.
        runs: Whether to save the runs of counted trials.
        maps: Whether to write the capability map of each controller.
        command: The command that repeats the experiment.
        jobs: Number of processes; the results do not depend on it.
        on_progress: Called with the numbers of pairs of operator and controller done and in total.

    Raises:
        OutputError: If a file cannot be written.
        TcsError: If no line is found for the robot.
    """
    began = time.monotonic()
    folder = make_experiment_folder(arm, out, runs=runs, maps=maps)
    course = find_course(arm, line_seed)
    experiment = run_experiment(arm, course, plan, runs=folder, jobs=jobs, on_progress=on_progress)
    by_controller = controller_maps(experiment) if maps else None
    seconds = time.monotonic() - began
    page = experiment_page(experiment, by_controller, seconds=seconds, command=command)
    line = _line(arm, course)
    contents = (
        as_html(page).encode(),
        as_markdown(page).encode(),
        _trials(experiment),
        (json.dumps(line, indent=2) + "\n").encode(),
    )
    for name, content in zip(FILES, contents, strict=True):
        with whole_file(out / name, "Report") as stream:
            stream.write(content)
    files = [str(out / name) for name in FILES]
    for one in () if by_controller is None else by_controller.maps:
        path = out / f"map-{one.condition}.tcm"
        save_map(path, one.capability)
        files.append(str(path))
    return {
        "scripted": True,
        **line,
        "operators": plan.operators,
        "seed": plan.seed,
        **plan.latency.to_json(),
        "seconds": seconds,
        **_numbers(experiment, by_controller),
        "files": files,
        "runs": None if folder is None else str(folder),
    }


def _line(arm: Arm, course: Course) -> dict[str, Any]:
    """Return the line as plain containers."""
    return {
        "robot": arm.name,
        "torso_height": arm.torso_height,
        "start": course.line.start,
        "end": course.line.end,
        "joints": course.joints.tolist(),
        "blocking_joint": course.blocking + 1,
        "opening_turns_deg": np.degrees(course.turns).round(6).tolist(),
    }


def _numbers(experiment: Experiment, maps: ControllerMaps | None) -> dict[str, Any]:
    """Return medians, tests and maps as plain containers."""
    return {
        "medians": {
            condition: {
                name: float(np.median(experiment.sample(condition, name))) for name in MEASURES
            }
            for condition in experiment.drives
        },
        "tests": {name: test.to_json() for name, test in experiment.tested().items()},
        "variance": {name: found.to_json() for name, found in experiment.varied().items()},
        "maps": None
        if maps is None
        else [
            {
                "condition": one.condition,
                "cells": len(one.capability.cells),
                "samples": one.samples,
                "shared_fraction": one.shared_fraction,
                "mean_score": one.mean_score,
                "best": None if one.best is None else one.best.to_json(),
            }
            for one in maps.maps
        ],
    }


def _trials(experiment: Experiment) -> bytes:
    """Return every trial as CSV, in SI units."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["scripted_operator", "controller", "order", "training", "trial", *MEASURES])
    for row in trial_rows(experiment, MEASURES):
        writer.writerow([f"{x:.9g}" if isinstance(x, float) else x for x in row])
    return text.getvalue().encode()

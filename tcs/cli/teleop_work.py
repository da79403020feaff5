"""What the commands on the driven arm do: load, call the library, write, and tell."""

from __future__ import annotations

import csv
import io
import json
import shlex
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tcs.cli import reports, talk
from tcs.errors import GridError

if TYPE_CHECKING:
    from tcs.model.robots import RobotFile
    from tcs.teleop.experiment.maps import ControllerMaps
    from tcs.teleop.experiment.within_subject import Experiment

FILES = ("experiment.html", "experiment.md", "trials.csv", "line.json")


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """The experiment as the command line gives it."""

    robot: str
    operators: int
    trials: int
    training: int
    lift: float | None
    line_seed: int
    seed: int
    out: Path
    runs_as: str | None
    maps: bool

    def command(self) -> str:
        """Return the command that makes it again."""
        words = ["tcs teleop experiment", f"--robot {shlex.quote(self.robot)}"]
        words += [f"--operators {self.operators} --trials {self.trials}"]
        words += [f"--training {self.training} --seed {self.seed} --line-seed {self.line_seed}"]
        if self.lift is not None:
            words.append(f"--lift {self.lift:g}")
        words += ["--maps"] if self.maps else []
        return " ".join(words)


def experiment(
    asked: Asked, *, jobs: int, on_progress: Callable[[int, int], None]
) -> dict[str, Any]:
    """Run the experiment, write its folder and return what it says.

    Raises:
        OutputError: If something cannot be written there.
        TcsError: If there is no line for the robot.
    """
    from tcs.capability import save_map
    from tcs.cli.places import check_writable
    from tcs.files.writing import make_folder, whole_file
    from tcs.model.robots import load_robot
    from tcs.output.report import as_html, as_markdown
    from tcs.output.report.teleop import experiment_page
    from tcs.teleop.arm import load_arm
    from tcs.teleop.experiment.course import find_course
    from tcs.teleop.experiment.maps import check_map_robot, controller_maps
    from tcs.teleop.experiment.within_subject import ExperimentPlan, run_experiment
    from tcs.teleop.runs.files import check_format

    began = time.monotonic()
    plan = ExperimentPlan(
        operators=asked.operators, trials=asked.trials, training=asked.training, seed=asked.seed
    )
    runs = None
    if asked.runs_as is not None:
        runs = asked.out / "runs"
        check_format(runs / f"run{asked.runs_as}")
    robot = load_robot(asked.robot)
    arm = load_arm(robot, torso_height=torso_lift(robot, asked.lift))
    if asked.maps:
        check_map_robot(arm)
    # Only now: what is refused leaves no empty folder behind.
    make_folder(runs or asked.out)
    for name in FILES:
        check_writable(asked.out / name)
    course = find_course(arm, asked.line_seed)
    done = run_experiment(
        arm, course, plan, runs=runs, runs_as=asked.runs_as or ".csv", jobs=jobs,
        on_progress=on_progress,
    )  # fmt: skip
    maps = controller_maps(done) if asked.maps else None
    seconds = time.monotonic() - began
    page = experiment_page(done, maps, seconds=seconds, command=asked.command())
    line = {
        "robot": arm.name,
        "lift": arm.torso_height,
        "start": course.line.start,
        "end": course.line.end,
        "joints": course.joints.tolist(),
        "blocking_joint": course.blocking + 1,
        "opening_turns_deg": np.degrees(course.turns).round(6).tolist(),
    }
    contents = (
        as_html(page).encode(),
        as_markdown(page).encode(),
        _trials(done),
        (json.dumps(line, indent=2) + "\n").encode(),
    )
    for name, content in zip(FILES, contents, strict=True):
        with whole_file(asked.out / name, "Report") as stream:
            stream.write(content)
    files = [str(asked.out / name) for name in FILES]
    for one in () if maps is None else maps.maps:
        path = asked.out / f"map-{one.condition}.tcm"
        save_map(path, one.capability)
        files.append(str(path))
    return {
        "scripted": True,
        **line,
        "operators": plan.operators,
        "seed": plan.seed,
        "seconds": seconds,
        **_numbers(done, maps),
        "files": files,
        "runs": None if runs is None else str(runs),
    }


def torso_lift(robot: RobotFile, asked: float | None) -> float:
    """Return the lift asked for, or the middle of the torso's range [m]; 0 without a torso.

    Raises:
        GridError: If the torso cannot be there.
    """
    low = high = 0.0
    if robot.torso_joint is not None:
        low, high = robot.joint_limits()[robot.torso_joint]
    lift = 0.5 * (low + high) if asked is None else asked
    if not low <= lift <= high:
        raise GridError(
            f"robot '{robot.name}': lift {lift:g} m is out of range; its torso goes from {low:g} "
            f"to {high:g} m."
        )
    return lift


def report(result: dict[str, Any]) -> None:
    """Print medians, tests and what was written."""
    from tcs.output.report.teleop_tables import NAMES, SCALE
    from tcs.teleop.experiment.within_subject import SCRIPTED

    out = talk.paper()
    out.print(f"{result['operators']} {SCRIPTED}, robot {result['robot']}, seed {result['seed']}")
    conditions = list(result["medians"])
    table = reports.new_table("median", *(f">{name}" for name in conditions), ">EE vs NV p", ">r")
    for name, text in NAMES.items():
        scale = SCALE.get(name, 1.0)
        cells = [f"{scale * result['medians'][c][name]:.3g}" for c in conditions]
        test = result["tests"].get(name)
        cells += ["", ""] if test is None else [f"{test['p']:.2g}", f"{test['effect']:.3f}"]
        table.add_row(text, *cells)
    out.print(table)
    for one in result["maps"] or ():
        best = one["best"]
        where = "no base pose holds the grasp"
        if best is not None:
            place = f"x {best['x']:.2f} m, y {best['y']:.2f} m, {best['yaw_deg']:.1f} deg"
            where = f"best base pose {place}, score {best['score']:.3f}"
        out.print(f"map of {one['condition']}: {one['cells']:,} cells; {where}")
    out.print(f"wrote {', '.join(result['files'])}")
    if result["runs"]:
        out.print(f"runs in {result['runs']}")


def _numbers(done: Experiment, maps: ControllerMaps | None) -> dict[str, Any]:
    from tcs.teleop.experiment.trial import MEASURES

    return {
        "medians": {
            condition: {name: float(np.median(done.sample(condition, name))) for name in MEASURES}
            for condition in done.drives
        },
        "tests": {name: test.to_json() for name, test in done.tested().items()},
        "variance": {name: found.to_json() for name, found in done.varied().items()},
        "maps": None
        if maps is None
        else [
            {
                "condition": one.condition,
                "cells": len(one.capability.cells),
                "samples": one.samples,
                "shared": one.shared,
                "mean_score": one.mean_score,
                "best": None if one.best is None else one.best.to_json(),
            }
            for one in maps.maps
        ],
    }


def _trials(done: Experiment) -> bytes:
    """Return every trial as CSV, in SI units."""
    from tcs.teleop.experiment.trial import MEASURES
    from tcs.teleop.experiment.within_subject import trial_rows

    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ["scripted_operator", "controller", "place_in_order", "training", "trial", *MEASURES]
    )
    for row in trial_rows(done, MEASURES):
        writer.writerow([f"{x:.9g}" if isinstance(x, float) else x for x in row])
    return text.getvalue().encode()

"""Run the trajectory-following experiment on other lines and arms, and map what was driven.

Usage: python benchmarks/lines.py [--lines iiwa7/1 iiwa7/2 pr2/0 tiago/0] [--operators 6]
           [--trials 3] [--training 4] [--seed 0] [--maps tiago/0] [--jobs 2]

A line is named by its robot and the seed of the search for it. `--maps` names the line whose trials
become one capability map for each controller. The operators are scripted, not people. The results
depend on the seeds alone, not on the machine.
"""

from __future__ import annotations

import math
import time

from table import cell, header, parser, record_table, row, save

from tcs.model.robots import load_robot
from tcs.output.report.blocks import Table
from tcs.teleop.arm import load_arm, torso_height_of
from tcs_studies.experiment.course import find_course
from tcs_studies.experiment.maps import controller_maps
from tcs_studies.experiment.trial import END_EFFECTOR, NOVEL
from tcs_studies.experiment.within_subject import (
    Experiment,
    ExperimentPlan,
    run_experiment,
)
from tcs_studies.output.report.experiment.tables import maps_blocks, median_of

LINES = ("iiwa7/1", "iiwa7/2", "pr2/0", "tiago/0")
TITLES = {"accuracy": "accuracy [mm]", "time": "time [s]", "effort": "effort [µJ]"}


def main() -> None:
    """Run the experiment on every line, print the tables and record them."""
    command_line = parser(__doc__)
    command_line.add_argument("--lines", nargs="*", default=LINES, metavar="ROBOT/SEED")
    command_line.add_argument("--maps", default="tiago/0", metavar="ROBOT/SEED")
    command_line.add_argument("--operators", type=int, default=6)
    command_line.add_argument("--trials", type=int, default=3)
    command_line.add_argument("--training", type=int, default=4)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header("statsmodels")
    plan = ExperimentPlan(
        operators=options.operators,
        trials=options.trials,
        training=options.training,
        seed=options.seed,
    )
    for line in options.lines:
        name, seed = line.split("/")
        robot = load_robot(name)
        arm = load_arm(robot, torso_height=torso_height_of(robot))
        course = find_course(arm, int(seed))
        begun = time.perf_counter()
        experiment = run_experiment(arm, course, plan, jobs=options.jobs)
        row(line, f"{time.perf_counter() - begun:.0f} s on {options.jobs} processes")
        medians(f"{name}, {seed}", experiment)
        if line == options.maps:
            maps(experiment)
    save(options)


def medians(line: str, experiment: Experiment) -> None:
    """Print and record the line, and the medians of all controllers on it."""
    course, controllers = experiment.course, list(experiment.drives)
    turns = [math.degrees(turn) for turn in course.turns]
    cells = {
        "length [m], limiting joint": f"{course.line.length:.2f}, {course.blocking + 1}",
        "rotations of joint 1 that free the path [deg]": f"{min(turns):.0f} to {max(turns):.0f}",
    }
    for measure in experiment.comparison().hypotheses:
        values = [median_of(experiment, one, measure) for one in controllers]
        cells[f"{TITLES[measure]}: {' / '.join(controllers)}"] = " / ".join(values)
        if measure == "accuracy":
            both = [median_of(experiment, one.name, measure) for one in (NOVEL, END_EFFECTOR)]
            cells["novel / end-effector"] = f"{float(both[0]) / float(both[1]):.2f}"
    finished = [f"{100.0 * experiment.sample(c, 'finished').mean():.0f}" for c in controllers]
    cells["completed trials [%]"] = " / ".join(finished)
    for column, text in cells.items():
        row(f"{line}: {column}", text)
        cell("lines", line, column, text)


def maps(experiment: Experiment) -> None:
    """Print and record the capability map of each controller."""
    found = controller_maps(experiment)
    _, table = maps_blocks(experiment, found)
    assert isinstance(table, Table)
    for cells in table.texts():
        print("  ".join(cells))
    record_table("maps", table)


if __name__ == "__main__":
    main()

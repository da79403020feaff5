"""Measure whom the best sets of two rows serve, among as many drawn people as the survey has.

Usage: python benchmarks/population.py [--scores DIR] [--bodies 6068] [--sets 10]
           [--seed 0] [--jobs 2]

Score files are read from DIR, where missing ones are written.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from table import cell, header, parser, record, row, save

import tcs
from tcs.files.writing import make_folder
from tcs.model.people import draw_bodies
from tcs.output.words import goal_text, percentage
from tcs.output.words.success import part_text
from tcs.placement.population import Population
from tcs.placement.scoring import default_path

ROBOT = "pr2"
ROWS = (("shaving", "wheelchair"), ("bathing", "bed"))


def main() -> None:
    """Count the people of both rows, without and with errors, print and record the tables."""
    command_line = parser(__doc__)
    command_line.add_argument("--scores", type=Path, default=Path("out/scores"))
    command_line.add_argument("--bodies", type=int, default=6068)
    command_line.add_argument("--sets", type=int, default=10)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    make_folder(options.scores)
    served, left_out, goals = [], [], []
    for task, environment in ROWS:
        name = f"{task} / {environment}"
        file = scored(task, environment, options)
        for errors in (False, True):
            found, seconds, processor = counted(file, options, errors=errors)
            line = name + (", under errors" if errors else "")
            served.append([line, *served_cells(found)])
            row(line, "  ".join(served[-1][1:]))
            cell("times", line, "time [s]", f"{seconds:.1f}")
            cell("times", line, "processor time [s]", f"{processor:.0f}")
            if not errors:
                left_out += [[name, *cells] for cells in part_cells(found)]
                goals += [[name, *cells] for cells in goal_cells(found)]
    columns = ("best set", "goals, mean", "set that serves most", "two sets together", "any set")
    record("served", ["row", *columns], served)
    record("left_out", ["row", "people with", "people", "served by the best set"], left_out)
    record("goals", ["row", "goal", "not reached", "gripper touches something there"], goals)
    save(options)


def scored(task: str, environment: str, options: argparse.Namespace) -> tcs.ScoreFile:
    """Return the score file of a row, written if it is missing."""
    path = options.scores / default_path(task, environment, ROBOT)
    if not path.exists():
        tcs.save(path, tcs.score(task, environment, ROBOT, jobs=options.jobs, paper=True))
    return tcs.load(path)


def counted(
    file: tcs.ScoreFile, options: argparse.Namespace, *, errors: bool
) -> tuple[Population, float, float]:
    """Return the population, and the time and processor time that it took [s]."""
    begun, processor = time.perf_counter(), time.process_time()
    found = tcs.population(
        file,
        draw_bodies(options.bodies, seed=options.seed),
        top=tcs.Top(count=options.sets),
        errors=errors,
        seed=options.seed,
        jobs=options.jobs,
    )
    return found, time.perf_counter() - begun, time.process_time() - processor


def served_cells(found: Population) -> list[str]:
    """Return whom the sets serve."""
    plain = found.to_json()
    any_set = np.logical_or.reduce([one.served for one in found.sets])
    return [
        interval(plain),
        percentage(plain["mean"]),
        interval(plain["sets"][plain["serves_most"]]),
        interval(plain["two_sets"]),
        percentage(float(any_set.mean())),
    ]


def interval(one: dict) -> str:
    """Return a fraction with its interval."""
    low, high = one["ci95"]
    return f"{percentage(one['served'])} ({percentage(low)} to {percentage(high)})"


def part_cells(found: Population) -> list[list[str]]:
    """Return the people by limits of measures, if somebody is not served."""
    if found.kept.all():
        return []
    parts = found.to_json()["not_served"]["parts"]
    return [[part_text(one), f"{one['bodies']:,}", percentage(one["served"])] for one in parts]


def goal_cells(found: Population) -> list[list[str]]:
    """Return the goals that the best set does not reach for somebody."""
    return [
        [
            goal_text(one["goal"], one["name"]),
            percentage(one["not_reached"]),
            percentage(one["gripper_touches"]),
        ]
        for one in found.to_json()["not_served"]["goals"]
    ]


if __name__ == "__main__":
    main()

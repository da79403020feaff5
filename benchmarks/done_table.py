"""What the best set does of every task, with every robot: at exact poses and as tasks are meant.

Usage: python benchmarks/done_table.py [--robots ROBOT ...] [--rows TASK:ENVIRONMENT ...] [--again]

Each row is scored twice with approach, without and with what its goals let free; a cell holds the
reachability of the best set of at most two base poses both times [%]. Cells that were saved before
are left out, so that an interrupted run continues where it was, unless `--again` is given.
"""

from __future__ import annotations

import argparse
import sys
import time

from table import cell, header, parser, row, save, saved_rows

import tcs
from tcs.model.robots import robot_names
from tcs.model.tasks import load_task
from tcs.placement.scoring import task_environment_pairs

TABLE = "exact, as meant [%]"


def main() -> int:
    """Score what was not scored before."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", nargs="+", choices=robot_names(), default=robot_names())
    command_line.add_argument(
        "--rows", nargs="+", metavar="TASK:ENVIRONMENT", help="all if left out"
    )
    command_line.add_argument("--again", action="store_true", help="also what was saved before")
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    chosen = options.rows or [":".join(pair) for pair in task_environment_pairs()]
    for name in chosen:
        measure(name, options)
    return 0


def measure(name: str, options: argparse.Namespace) -> None:
    """Measure one row with the robots, and save it after each of them."""
    task, environment = name.split(":")
    line = f"{task.replace('_', ' ')}, {environment}"
    saved = saved_rows(TABLE, ["", *robot_names()]).get(line)
    cells = dict.fromkeys(robot_names(), "")
    if saved is not None:
        cells = dict(zip(robot_names(), saved[1:], strict=True))
    for robot, text in cells.items():
        cell(TABLE, line, robot, text)
    for robot in options.robots:
        if cells[robot] and not options.again:
            row(f"{line}, {robot}", f"{cells[robot]} (saved before)")
            continue
        begun = time.perf_counter()
        exact = done(task, environment, robot, is_exact=True, jobs=options.jobs)
        meant = done(task, environment, robot, is_exact=False, jobs=options.jobs)
        text = f"{100.0 * exact:.0f}, {100.0 * meant:.0f}"
        cell(TABLE, line, robot, text)
        row(f"{line}, {robot}", f"{text} ({time.perf_counter() - begun:.0f} s)")
        save(options, keep=True)


def done(task: str, environment: str, robot: str, *, is_exact: bool, jobs: int) -> float:
    """Return the reachability of the best set of a row with approach, 0 if nothing is reached."""
    given = load_task(task)
    file = tcs.score(given.exact() if is_exact else given, environment, robot, jobs=jobs)
    best = file.nominal.sets.best
    return file.nominal.sets.scores_of(best)[0] if best else 0.0


if __name__ == "__main__":
    sys.exit(main())

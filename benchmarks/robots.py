"""Measure every shipped robot at the same tasks: time, reached goals, and missed goals.

Usage: python benchmarks/robots.py [--robots pr2,panda] [--tasks shaving,feeding] [--repeats 5]
                                   [--pairs 500] [--dense 1000]

Each robot does each task in the wheelchair on the paper's grid; a robot without a torso joint has a
third of the configurations. The robots alternate, so that a load peak affects all of them. Nothing
here is a test: tests never depend on time.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time

from table import cell, header, parser, recall_text, row, save, spread, verification_text

from tcs.model.robots import robot_names
from tcs.placement.scoring import load_job, score, sweep, verify

ENVIRONMENT = "wheelchair"
RECALL = 0.998
"""Least recall expected of every arm."""


def main() -> int:
    """Run every measurement and print it; the exit code is 1 when an answer was false."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", default=",".join(robot_names()))
    command_line.add_argument("--tasks", default="shaving,feeding")
    command_line.add_argument("--repeats", type=int, default=5)
    command_line.add_argument("--pairs", type=int, default=500)
    command_line.add_argument("--dense", type=int, default=1000)
    command_line.add_argument("--jobs", type=int, default=2)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    row("seed, threads", f"{options.seed}, {options.jobs}")
    works = list(itertools.product(options.tasks.split(","), options.robots.split(",")))
    times(works, options.repeats, options.jobs)
    # A list, so that one false answer does not hide the others.
    sound = all([verification(*work, options) for work in works])
    save(options)
    return 0 if sound else 1


def times(works: list[tuple[str, str]], repeats: int, jobs: int) -> None:
    """Measure the scoring of every task with every robot, and print the reasons."""
    lowered = {}
    for task, robot in works:
        job = load_job(task, ENVIRONMENT, robot)
        lowered[task, robot] = job.lowered(job.scene()), job.task.weights
    taken: dict[tuple[str, str], list[float]] = {work: [] for work in works}
    reasons = {}
    for _ in range(repeats):
        for work in works:
            swept = sweep(*lowered[work], jobs=jobs)
            taken[work].append(swept.scoring_seconds)
            (reasons[work],) = swept.tables
    for (task, robot), seconds in taken.items():
        scores = reasons[task, robot]
        counts = ", ".join(f"{name} {n}" for name, n in scores.reason_counts().items())
        row(f"{task}, {robot}: scoring_seconds", spread(seconds))
        line = f"{robot}, {task}"
        cell(
            "robots", line, "configurations x goals", f"{scores.configurations:,} x {scores.goals}"
        )
        cell("robots", line, "reached", f"{scores.reason_counts()['reached']:,}")
        cell("robots", line, "scoring", spread(seconds))
        row("", f"{scores.configurations} x {scores.goals}: {counts}")


def verification(task: str, robot: str, options: argparse.Namespace) -> bool:
    """Re-check one task with Drake and the dense scan; return whether all answers are true."""
    begun = time.perf_counter()
    found = verify(
        score(task, ENVIRONMENT, robot, jobs=options.jobs),
        pairs=options.pairs,
        dense=options.dense,
        seed=options.seed,
    )
    row(f"verify {task}, {robot}", verification_text(found, time.perf_counter() - begun))
    line = f"{robot}, {task}"
    cell(
        "robots", line, "false, of those re-checked", f"{found.false_reached} of {found.checked:,}"
    )
    cell("robots", line, "missed, of those scanned", f"{found.missed} of {found.dense_checked:,}")
    cell("robots", line, "recall (95 % interval)", recall_text(found, 4))
    if found.recall is not None and found.recall < RECALL:
        row("", f"recall is below {RECALL}")
    return found.is_sound


if __name__ == "__main__":
    sys.exit(main())

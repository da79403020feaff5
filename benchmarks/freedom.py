"""Recall of goals with freedom, against a dense scan of the freedom.

Usage: python benchmarks/freedom.py [--robots pr2,jaco] [--freedoms rotation,orientation]
           [--configurations 1000] [--seed 0]

The goals are those of *shaving* in the wheelchair, each with a freedom. Every pair of randomly
drawn initial configurations and goals is scored; those unreached, but for configurations whose
base or body is in contact at any goal, are scanned: poses of the freedom are drawn anew, one every
degree or 1,000 random ones, and scored without freedom. So what counts as missed is missed by the
search over the freedom; what the search of the arm at one pose misses is measured by `robots.py`.
The results depend on the seed alone; times are processor times of one thread.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from table import cell, header, parser, row, save

from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import Rows, rows_at
from tcs.kernel.scores import BODY_BLOCKED, REACHED
from tcs.kernel.sweep import score
from tcs.kernel.verification.scans import at_poses
from tcs.model.tasks import Freedom, Task, load_task
from tcs.placement.robustness.statistics import binomial_interval
from tcs.placement.scoring import load_job

TASK, ENVIRONMENT = "shaving", "wheelchair"
FREEDOMS = {
    "rotation": Freedom(rotates=True),
    "orientation": Freedom(rotates=True, tilt=math.pi),
    "cone": Freedom(tilt=math.radians(20.0)),
    "position": Freedom(box=(0.01, 0.01, 0.02)),
}
"""The freedom of every goal by the name of it in a task: `rotation` is `rotation_about` x."""
ANY_GOAL = (REACHED, BODY_BLOCKED)
"""Reasons that no scan of a goal can change."""


def main() -> None:
    """Measure every robot with every freedom."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", default="pr2,jaco")
    command_line.add_argument("--freedoms", default="rotation,orientation")
    command_line.add_argument("--configurations", type=int, default=1000)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    unknown = [name for name in options.freedoms.split(",") if name not in FREEDOMS]
    if unknown:
        command_line.error(
            f"--freedoms: '{unknown[0]}' is unknown; there are {', '.join(FREEDOMS)}"
        )
    header()
    row("seed", str(options.seed))
    for robot in options.robots.split(","):
        for freedom in options.freedoms.split(","):
            recall(robot, freedom, options)
    save(options, keep=True)


def recall(robot: str, freedom: str, options: argparse.Namespace) -> None:
    """Score pairs and scan those unreached; print and record what was found."""
    job = load_job(free_task(FREEDOMS[freedom]), ENVIRONMENT, robot)
    lowered = job.lowered(job.scene())
    problem, grid = build_problem(lowered.arrays), lowered.grid
    drawn = np.random.default_rng(options.seed).choice(
        grid.size, options.configurations, replace=False
    )
    configurations = np.sort(drawn)
    # Load or compile the machine code.
    reasons_at(problem, rows_at(grid, configurations[:1]))
    reasons, seconds = reasons_at(problem, rows_at(grid, configurations))
    reached = int(np.count_nonzero(reasons == REACHED))
    scanned = missed = 0
    scan_seconds = 0.0
    for goal in range(reasons.shape[1]):
        left = configurations[~np.isin(reasons[:, goal], ANY_GOAL)]
        # The wheelchair has a single state.
        found, taken = reasons_at(at_poses(problem, 0, goal), rows_at(grid, left))
        missed += int(np.count_nonzero((found == REACHED).any(axis=1)))
        scanned, scan_seconds = scanned + len(left), scan_seconds + taken
    if not reached:
        raise SystemExit(f"{robot}, {freedom}: no pair is reached; take more --configurations")
    low, high = binomial_interval(reached, reached + missed)
    values = {
        "pairs": f"{reasons.size:,}",
        "reached": f"{reached:,}",
        "missed, of those scanned": f"{missed:,} of {scanned:,}",
        "recall (95 % interval)": f"{reached / (reached + missed):.4f} ({low:.4f} .. {high:.4f})",
        "scoring, for each pair [us]": f"{1e6 * seconds / reasons.size:.0f}",
        "scan, for each pair [us]": f"{1e6 * scan_seconds / max(scanned, 1):.0f}",
    }
    name = f"{robot}, {freedom}"
    for column, text in values.items():
        row(f"{name}: {column}", text)
        cell("recall", name, column, text)


def free_task(freedom: Freedom) -> Task:
    """Return the task with a freedom at every goal."""
    task = load_task(TASK)
    return replace(task, goals=tuple(replace(goal, free=freedom) for goal in task.goals))


def reasons_at(problem: Problem, rows: Rows) -> tuple[NDArray[np.uint8], float]:
    """Score configurations at all goals of a problem.

    Args:
        problem: The problem.
        rows: The configurations.

    Returns:
        Codes of reasons, shape (n, goals), and the processor time [s].
    """
    begun = time.process_time()
    scores = score(problem, rows)
    return scores.reason, time.process_time() - begun


if __name__ == "__main__":
    main()

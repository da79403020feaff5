"""Solve arms of the closed-form classes numerically, and compare the pairs that each reaches.

Usage: python benchmarks/numeric_arms.py [--rows pr2:shaving,tiago:shaving,...] [--jobs 2]

Each row is a whole grid in the wheelchair. The numeric search does not know that a closed form
exists: what it reaches beyond the closed form is what that missed, and the other way round.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from table import cell, header, parser, row, save

from tcs.kernel.analytic.solver import outside_solver
from tcs.kernel.arrays import GridArrays
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import grid_rows
from tcs.kernel.scores import REACHED
from tcs.kernel.sweep import gripper_contacts, score
from tcs.placement.scoring import load_job
from tcs.placement.scoring.engines import SLICE

ENVIRONMENT = "wheelchair"
ROWS = "pr2:shaving,tiago:shaving,iiwa7:feeding,panda:feeding"


def main() -> int:
    """Score every row both ways and print what differs."""
    command_line = parser(__doc__)
    command_line.add_argument("--rows", default=ROWS)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    for robot, task in (name.split(":") for name in options.rows.split(",")):
        job = load_job(task, ENVIRONMENT, robot, paper=True)
        lowered = job.lowered(job.scene())
        problem = build_problem(lowered.arrays)
        numeric = problem._replace(arm=outside_solver(lowered.arrays.chain))
        closed, seconds = reached(problem, lowered.grid, options.jobs)
        found, numeric_seconds = reached(numeric, lowered.grid, options.jobs)
        both, only = int(np.sum(closed & found)), int(np.sum(found & ~closed))
        total = int(np.sum(closed))
        line = f"{robot}, {task}"
        cell("whole_grids", line, "reached in closed form", f"{total:,}")
        share = "all" if both == total else f"{both:,}"
        cell("whole_grids", line, "of these numerically", share)
        cell("whole_grids", line, "only numerically", f"{only:,}")
        times = f"{numeric_seconds / seconds:.1f} times"
        cell("whole_grids", line, "processor time", times)
        row(line, f"{total:,} in closed form, {both:,} numerically too, {only} only, {times}")
    save(options)
    return 0


def reached(problem: Problem, grid: GridArrays, jobs: int) -> tuple[NDArray[np.bool_], float]:
    """Return which pairs are reached, shape (size, goals), and the processor time [s]."""
    size, grippers = grid.size, gripper_contacts(problem)

    def part(start: int) -> NDArray[np.bool_]:
        rows = grid_rows(grid, start, min(start + SLICE, size))
        return score(problem, rows, grippers).reason == REACHED

    # Compiled, or loaded, before the clock runs.
    part(size)
    begun = time.process_time()
    parts = Parallel(n_jobs=jobs, prefer="threads")(
        delayed(part)(start) for start in range(0, size, SLICE)
    )
    return np.concatenate(parts), time.process_time() - begun


if __name__ == "__main__":
    sys.exit(main())

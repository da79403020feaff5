"""Measure what lies between the grid points: refined sets, their bound, and CMA-ES as a baseline.

Usage: python benchmarks/optimum.py [--rows TASK/ENVIRONMENT ...] [--measure isotropy]
           [--seeds 20] [--samples 1000] [--processes 2] [--total]

Each row of Table I is scored, on the bed with the person at the nominal position, and refined by
P_R + P_M, once among the sets that are as sure under error as the best of the grid (the default)
and once among all. The surest sets are the most robust one of the grid, by `tcs robustify`, and the
one refined by its success. All of these are judged in the same samples of the paper's errors, which
no choice has seen; the paper prints one decimal, of as many simulations as the default. The ceiling
is the success of a set that reaches every goal at which the gripper alone is free, in the most
favourable state of the environment.

CMA-ES (benchmarks/cma_baseline.py) searches the same space for two members, for the time that
scoring and the refinement among all sets took: it knows no error. Times are processor times, of one
process with one thread; rows are shared among processes. `--seeds 0` leaves CMA-ES out, `--total`
all but the wall time of all refinements. With `--save`, the saved rows that a run does not measure
are kept: `--rows` renews some of them.
"""

from __future__ import annotations

import argparse
import multiprocessing
import statistics
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from cma_baseline import CmaRun, cma_run
from printed_grid import at_nominal_position
from table import header, parser, record, row, save

import tcs
from tcs.kernel.arrays import FloatArray
from tcs.placement.refinement import refinement_summary
from tcs.placement.refinement.success_under_error import successes
from tcs.placement.robustness import PerturbedPoints, Trials
from tcs.placement.scoring import task_environment_pairs
from tcs.placement.tables import tc_reachability
from tcs_studies.output.report.robustness.paper import load_paper

COLUMNS = (
    *("task, environment", "P_R + P_M of the grid", "refined", "gain", "of all sets"),
    *("success of the grid", "refined", "of all sets"),
    *("scoring [s]", "refinement [s]", "of all sets [s]"),
)
SUREST_COLUMNS = (
    *("task, environment", "paper, Table I", "best of the grid", "surest of the grid"),
    *("surest, refined", "at or above the paper", "ceiling", "refinement [s]"),
)
CMA_COLUMNS = (
    *("task, environment", "CMA-ES, 10 iterations", "its time [s]"),
    *("at a quarter of our time", "at half of it", "at our time"),
    *("the grid", "its time [s]", "refined", "our time [s]", "seeds", "seeds below ours"),
)
SUREST: dict[str, Any] = {"objective": "success", "starts": 4, "rounds": 12}
"""Options of the refinement of the surest sets."""


def main() -> None:
    """Measure every row and print the tables."""
    command_line = parser(__doc__)
    command_line.add_argument("--rows", nargs="*", metavar="TASK/ENVIRONMENT")
    command_line.add_argument("--measure", default="isotropy")
    command_line.add_argument("--seeds", type=int, default=20)
    command_line.add_argument("--samples", type=int, default=1000)
    command_line.add_argument("--processes", type=int, default=2)
    command_line.add_argument("--total", action="store_true")
    options = command_line.parse_args()
    header("cma")
    names = options.rows or ["/".join(pair) for pair in task_environment_pairs(None)]
    # Drake and the compiled kernel do not survive a fork.
    context = multiprocessing.get_context("spawn")
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(options.processes, context, warm_up) as pool,
    ):
        place = Path(folder)
        scored = dict(zip(names, pool.map(partial(scored_row, place, options), names), strict=True))
        begun = time.perf_counter()
        kept = dict(zip(names, pool.map(partial(refined_row, place), names), strict=True))
        row("wall time of all refinements", f"{time.perf_counter() - begun:.1f} s")
        if not options.rows:
            cells = str(len(names)), str(options.processes), f"{time.perf_counter() - begun:.1f}"
            record("total", ("rows", "processes", "wall time [s]"), [cells])
            save(options, keep=True)
        if options.total:
            return
        rows, surest, ours = [], [], {}
        print(" | ".join(COLUMNS))
        for found in pool.map(partial(judged_row, place, options), names):
            name = found["name"]
            seconds = scored[name], kept[name], found["seconds"]
            rows.append([*found["cells"], *(f"{value:.1f}" for value in seconds)])
            surest.append(found["surest"])
            ours[name] = found["grid"], scored[name], found["free"], scored[name] + seconds[2]
            print(" | ".join(rows[-1]), "|", " | ".join(surest[-1][1:]), flush=True)
            record("rows", COLUMNS, rows)
            record("surest", SUREST_COLUMNS, surest)
            save(options, keep=True)
        compared = []
        for name in names if options.seeds else ():
            run = partial(baseline, place, name, ours[name][3])
            compared.append(beside(name, ours[name], list(pool.map(run, range(options.seeds)))))
            print(" | ".join(compared[-1]), flush=True)
            record("cma", CMA_COLUMNS, compared)
            save(options, keep=True)
    row("rows", str(len(rows)))


def label(name: str) -> str:
    """Return task and environment in words."""
    return name.replace("_", " ").replace("/", ", ")


def path_of(folder: Path, name: str, what: str) -> Path:
    """Return the path of a score file of this run."""
    return folder / f"{name.replace('/', '-')}-{what}.tcs"


def warm_up() -> None:
    """Load what a process needs at its first call, and which is not measured."""
    tcs.score("feeding", "wheelchair", "pr2", jobs=1, paper=True)


def scored_row(folder: Path, options: argparse.Namespace, name: str) -> float:
    """Score a row; return the processor time [s]."""
    task, environment = name.split("/")
    nominal: str | Path = environment
    if environment.startswith("bed"):
        nominal = at_nominal_position(environment, folder)
    begun = time.process_time()
    file = tcs.score(task, nominal, "pr2", measure=options.measure, jobs=1, paper=True)
    spent = time.process_time() - begun
    tcs.save(path_of(folder, name, "scored"), file)
    return spent


def refined_row(folder: Path, name: str) -> float:
    """Refine a row with the default options; return the processor time [s]."""
    file = tcs.load(path_of(folder, name, "scored"))
    begun = time.process_time()
    refined = tcs.refine(file, body_collisions="paper", jobs=1)
    spent = time.process_time() - begun
    tcs.save(path_of(folder, name, "refined"), refined)
    return spent


def judged_row(folder: Path, options: argparse.Namespace, name: str) -> dict[str, Any]:
    """Refine a row among all sets and by its success, and judge all sets."""
    file = tcs.load(path_of(folder, name, "scored"))
    refined = tcs.load(path_of(folder, name, "refined"))
    begun = time.process_time()
    free = tcs.refine(file, body_collisions="paper", keep_success=False, jobs=1)
    spent = time.process_time() - begun
    robust = tcs.robustify(file, sets=400, samples=256, body_collisions="paper", jobs=1)
    begun = time.process_time()
    surest = tcs.refine(robust, body_collisions="paper", jobs=1, **SUREST)
    on_success = time.process_time() - begun
    trials = Trials.of(file, body_collisions="paper")
    samples = PerturbedPoints(trials, trials.errors.draw(options.samples, 0), 1)
    table = robust.nominal.success
    assert table is not None
    sets = [
        on_grid(file, file.nominal.sets.best),
        first_set(refined),
        first_set(free),
        on_grid(file, table.most_robust(file.nominal.sets)),
        first_set(surest),
    ]
    points = [values for values in sets]
    success = [100.0 * value for value in successes(samples, trials.weights, points)]
    found = refinement_summary(refined)
    before, after = (total(found, key) for key in ("before", "after"))
    published = load_paper().published(*name.split("/"))
    assert published is not None
    at_free = total(refinement_summary(free), "after")
    return {
        "name": name,
        "seconds": spent,
        "grid": before,
        "free": at_free,
        "cells": [
            *(label(name), f"{before:.4f}", f"{after:.4f}", f"{after - before:+.4f}"),
            f"{at_free:.4f}",
            *(f"{value:.1f} %" for value in success[:3]),
        ],
        "surest": [
            *(label(name), f"{published.mean:.1f} %"),
            *(f"{success[k]:.1f} %" for k in (0, 3, 4)),
            # The paper prints one decimal.
            "yes" if round(success[4], 1) >= published.mean else "no",
            *(f"{100.0 * ceiling(trials, samples):.1f} %", f"{on_success:.0f}"),
        ],
    }


def ceiling(trials: Trials, samples: PerturbedPoints) -> float:
    """Return the success of reaching all goals at which the gripper is free, whatever the base."""
    best = 0.0
    for state in trials.grid.environment_states():
        free = samples.free_grippers(dict(state))
        best = max(best, float(tc_reachability(free, trials.weights).mean()))
    return best


def total(found: dict[str, Any], key: str) -> float:
    """Return P_R + P_M of `before` or `after`."""
    return float(found[key]["reachability"] + found[key]["manipulability"])


def on_grid(file: tcs.ScoreFile, members: Sequence[int]) -> FloatArray:
    """Return the values of configurations of the grid."""
    values = file.configurations.values(np.array(members))
    return np.stack([*values.values()], axis=1)


def first_set(file: tcs.ScoreFile) -> FloatArray:
    """Return the values of the members of the first refined set."""
    table = file.nominal.refined
    assert table is not None
    return table.values[0, : table.sizes[0]]


def baseline(folder: Path, name: str, seconds: float, seed: int) -> CmaRun:
    """Return a run of CMA-ES; the first one goes on to the end of its iterations."""
    file = tcs.load(path_of(folder, name, "scored"))
    return cma_run(file, seconds, seed, toc=False, whole=seed == 0)


def beside(name: str, ours: tuple[float, float, float, float], runs: Sequence[CmaRun]) -> list[str]:
    """Return the row of the table that compares CMA-ES, medians of the seeds."""
    grid, scoring, refined, seconds = ours
    return [
        *(label(name), f"{runs[0].at_end:.4f}", f"{runs[0].spent:.1f}"),
        *(
            f"{statistics.median(values):.4f}"
            for values in zip(*(run.at_time for run in runs), strict=True)
        ),
        *(f"{grid:.4f}", f"{scoring:.1f}", f"{refined:.4f}", f"{seconds:.1f}"),
        *(str(len(runs)), str(sum(run.at_time[-1] < refined for run in runs))),
    ]


if __name__ == "__main__":
    main()

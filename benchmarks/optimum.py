"""Measure what lies between the grid points: refined sets, their bound, and CMA-ES as a baseline.

Usage: python benchmarks/optimum.py [--rows TASK/ENVIRONMENT ...] [--compared TASK/ENVIRONMENT ...]
           [--seeds 20] [--samples 1000] [--jobs 2]

Each row of Table I is scored, on the bed with the person at the nominal position, and refined by
P_R + P_M; the best set of the grid and the refined one are judged in the same samples of the
paper's errors. In the compared rows, CMA-ES (package `cma`) searches the same space for two members
with the settings of the original program's later version: sigma 1 in quarters of the ranges, cmean
0.25, from mid-range, a population of 1600, 10 iterations, cost 10 - 10 P_R - P_M. Where no goal is
reached, the distance to the goals is added. Times are processor times.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np
from printed_grid import at_nominal_position
from table import header, parser, record, row, save

import tcs
from tcs.kernel.arrays import FloatArray
from tcs.placement.refinement import Points, PointScorer, refinement_summary
from tcs.placement.refinement.perturbed import PerturbedPoints
from tcs.placement.refinement.space import Space
from tcs.placement.robustness import Trials
from tcs.placement.scoring import task_environment_pairs
from tcs.placement.tables import tc_manipulability, tc_reachability

COLUMNS = (
    *("task, environment", "P_R + P_M of the grid", "refined", "gain", "bound", "gap"),
    *("success of the grid", "refined", "scoring [s]", "refinement [s]"),
)
CMA_COLUMNS = (
    *("task, environment", "CMA-ES, 10 iterations", "its time [s]", "CMA-ES, at our time"),
    *("ours", "our time [s]", "seeds", "seeds below ours"),
)
POPULATION, ITERATIONS, CMEAN = 1600, 10, 0.25
TORSO_STEP = 0.005
"""Torso heights of CMA-ES are rounded to this [m]: each different one costs a call of Drake."""
UNREACHED = 10.0
"""Cost where no goal is reached, without the distance."""


def main() -> None:
    """Measure every row and print the tables."""
    command_line = parser(__doc__)
    command_line.add_argument("--rows", nargs="*", metavar="TASK/ENVIRONMENT")
    command_line.add_argument("--compared", nargs="*", metavar="TASK/ENVIRONMENT", default=[])
    command_line.add_argument("--seeds", type=int, default=20)
    command_line.add_argument("--samples", type=int, default=1000)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header("cma")
    names = options.rows or ["/".join(pair) for pair in task_environment_pairs(None)]
    rows, compared = [], []
    print(" | ".join(COLUMNS))
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            file, refined, seconds = measured(name, Path(folder), options)
            rows.append(cells(name, file, refined, seconds, options))
            print(" | ".join(rows[-1]), flush=True)
            record("rows", COLUMNS, rows)
            if name in options.compared:
                compared.append(beside_cma(name, refined, sum(seconds), options))
                print(" | ".join(compared[-1]), flush=True)
                record("cma", CMA_COLUMNS, compared)
            save(options)
    row("rows", str(len(rows)))


def measured(
    name: str, folder: Path, options: argparse.Namespace
) -> tuple[tcs.ScoreFile, tcs.ScoreFile, tuple[float, float]]:
    """Return the scored and the refined file of a row, and the processor time of both [s]."""
    task, environment = name.split("/")
    nominal: str | Path = environment
    if environment.startswith("bed"):
        nominal = at_nominal_position(environment, folder)
    begun = time.process_time()
    file = tcs.score(task, nominal, "pr2", jobs=options.jobs)
    scored = time.process_time()
    refined = tcs.refine(file, jobs=options.jobs)
    return file, refined, (scored - begun, time.process_time() - scored)


def cells(
    name: str,
    file: tcs.ScoreFile,
    refined: tcs.ScoreFile,
    seconds: tuple[float, float],
    options: argparse.Namespace,
) -> list[str]:
    """Return the row of the table of refined sets."""
    found = refinement_summary(refined)
    before, after = (
        found[key]["reachability"] + found[key]["manipulability"] for key in ("before", "after")
    )
    table = refined.nominal.refined
    assert table is not None
    trials = Trials.of(refined)
    offsets = trials.errors.draw(options.samples, 0)
    perturbed = PerturbedPoints(trials, offsets, options.jobs)
    grid, best = refined.configurations, np.array(file.nominal.sets.best)
    of_grid = np.stack([*grid.values(best).values()], axis=1)
    success = [
        tc_reachability(
            np.logical_or.reduce(
                perturbed.reached(Points(values, np.zeros(len(values), dtype=np.int64)))
            ),
            table.weights,
        ).mean()
        for values in (of_grid, table.values[0, : table.sizes[0]])
    ]
    return [
        name.replace("_", " ").replace("/", ", "),
        f"{before:.4f}",
        f"{after:.4f}",
        f"{after - before:+.4f}",
        f"{found['bound']:.4f}",
        f"{100.0 * found['gap']:.1f} %",
        *(f"{100.0 * value:.1f} %" for value in success),
        *(f"{value:.1f}" for value in seconds),
    ]


def beside_cma(
    name: str, refined: tcs.ScoreFile, ours: float, options: argparse.Namespace
) -> list[str]:
    """Return the row of the table that compares CMA-ES, median of the seeds."""
    scorer = PointScorer.of(refined, 0, options.jobs)
    space = Space.of(refined.configurations, refined.nominal.sets)
    runs = [cma_run(scorer, space, refined, ours, seed) for seed in range(options.seeds)]
    reached = float(refined.nominal.refined.objective[0])  # type: ignore[union-attr]
    at_time = [run[2] for run in runs]
    return [
        name.replace("_", " ").replace("/", ", "),
        f"{statistics.median(run[0] for run in runs):.4f}",
        f"{statistics.median(run[1] for run in runs):.1f}",
        f"{statistics.median(at_time):.4f}",
        f"{reached:.4f}",
        f"{ours:.1f}",
        str(options.seeds),
        str(sum(value < reached for value in at_time)),
    ]


def cma_run(
    scorer: PointScorer, space: Space, file: tcs.ScoreFile, ours: float, seed: int
) -> tuple[float, float, float]:
    """Return P_R + P_M of CMA-ES after its iterations, their time [s], and P_R + P_M at ours."""
    import cma

    low, high = np.tile(space.low, 2), np.tile(space.high, 2)
    free = high > low
    start = (low + high) / 2.0
    strategy = cma.CMAEvolutionStrategy(
        start[free],
        1.0,
        {
            "popsize": POPULATION,
            "CMA_stds": ((high - low) / 4.0)[free],
            "bounds": [low[free], high[free]],
            "CMA_cmean": CMEAN,
            "seed": seed + 1,
            "verbose": -9,
        },
    )
    goals = np.mean([np.reshape(at, (-1, 3))[0, :2] for at in file.body_frames.values()], axis=0)
    begun = time.process_time()
    best, at_end, spent, iteration = 0.0, (0.0, 0.0), 0.0, 0
    while iteration < ITERATIONS or (spent < ours and not strategy.stop()):
        asked = strategy.ask()
        values = np.tile(start, (len(asked), 1))
        values[:, free] = asked
        costs, totals = evaluated(scorer, space, file, values, goals)
        strategy.tell(asked, costs.tolist())
        spent = time.process_time() - begun
        iteration += 1
        if iteration <= ITERATIONS:
            at_end = max(at_end[0], totals.max()), spent
        if spent <= ours:
            best = max(best, totals.max())
    return at_end[0], at_end[1], best


def evaluated(
    scorer: PointScorer, space: Space, file: tcs.ScoreFile, values: FloatArray, goals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return cost, and P_R + P_M, of sets of two, shape (n, 2 axes)."""
    members = space.inside(values.reshape(len(values), 2, -1))
    members[..., -1] = np.round(members[..., -1] / TORSO_STEP) * TORSO_STEP
    flat = members.reshape(-1, members.shape[-1])
    found = scorer.score(Points(flat, np.zeros(len(flat), dtype=np.int64)))
    shape = (*members.shape[:2], -1)
    weights = file.nominal.sets.weights
    reachability = tc_reachability(found.reached.reshape(shape).any(axis=1), weights)
    manipulability = tc_manipulability(found.dexterity.reshape(shape).max(axis=1), weights)
    distance = np.linalg.norm(members[..., -4:-2] - goals, axis=2).sum(axis=1)
    far = np.where(reachability > 0.0, 0.0, distance)
    return UNREACHED - 10.0 * reachability - manipulability + far, reachability + manipulability


if __name__ == "__main__":
    main()

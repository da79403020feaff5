"""Measure what lies between the grid points: refined sets, their bound, and CMA-ES as a baseline.

Usage: python benchmarks/optimum.py [--rows TASK/ENVIRONMENT ...] [--compared TASK/ENVIRONMENT ...]
           [--measure isotropy] [--seeds 20] [--samples 1000] [--jobs 2]

Each row of Table I is scored, on the bed with the person at the nominal position, and refined by
P_R + P_M, once among the sets that are as sure under error as the best of the grid (the default)
and once among all; these sets and the best of the grid are judged in the same samples of the
paper's errors. In the compared rows (`--compared all` for every one), CMA-ES (package `cma`)
searches the same space for two members with the settings of the original program's later version:
sigma 1 in quarters of the ranges, cmean 0.25, from mid-range, 10 iterations with a population of
1600, with axes of the environment 3600, cost 10 - 10 P_R - P_M. Where no goal is reached, the
distance to the goals is added. It is compared with the refinement among all sets, since it knows no
error. Times are processor times.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from printed_grid import at_nominal_position
from table import header, parser, record, row, save

import tcs
from tcs.kernel.arrays import FloatArray
from tcs.placement.refinement import Points, PointScorer, refinement_summary
from tcs.placement.refinement.floor import successes
from tcs.placement.refinement.perturbed import PerturbedPoints
from tcs.placement.refinement.space import Space
from tcs.placement.robustness import Trials
from tcs.placement.scoring import task_environment_pairs
from tcs.placement.tables import tc_manipulability, tc_reachability

COLUMNS = (
    *(
        "task, environment",
        "P_R + P_M of the grid",
        "refined",
        "gain",
        "of all sets",
        "bound",
        "gap",
    ),
    *("success of the grid", "refined", "of all sets", "scoring [s]", "refinement [s]"),
    "of all sets [s]",
)
FRACTIONS = (0.25, 0.5, 1.0)
"""Fractions of our time at which the score of CMA-ES is recorded."""
CMA_COLUMNS = (
    *("task, environment", "CMA-ES, 10 iterations", "its time [s]"),
    *("at a quarter of our time", "at half of it", "at our time"),
    *("the grid", "its time [s]", "refined", "our time [s]", "seeds", "seeds below ours"),
)
POPULATION, POPULATION_WITH_ENVIRONMENT = 1600, 3600
ITERATIONS, CMEAN = 10, 0.25
SLOW_STEP = 0.005
"""Torso heights and axes of the environment are rounded to this [m or rad] for CMA-ES: each
different value costs a call of Drake."""
UNREACHED = 10.0
"""Cost where no goal is reached, without the distance."""


def main() -> None:
    """Measure every row and print the tables."""
    command_line = parser(__doc__)
    command_line.add_argument("--rows", nargs="*", metavar="TASK/ENVIRONMENT")
    command_line.add_argument("--compared", nargs="*", metavar="TASK/ENVIRONMENT", default=[])
    command_line.add_argument("--measure", default="isotropy")
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
            found = Row.measured(name, Path(folder), options)
            rows.append(found.cells(options))
            print(" | ".join(rows[-1]), flush=True)
            record("rows", COLUMNS, rows)
            if name in options.compared or "all" in options.compared:
                compared.append(beside_cma(found, options))
                print(" | ".join(compared[-1]), flush=True)
                record("cma", CMA_COLUMNS, compared)
            save(options)
    row("rows", str(len(rows)))


@dataclass(frozen=True)
class Row:
    """A row of Table I: scored, and refined twice."""

    name: str
    file: tcs.ScoreFile
    refined: tcs.ScoreFile
    """Among the sets that are as sure as the best of the grid."""
    free: tcs.ScoreFile
    """Among all sets."""
    seconds: tuple[float, float, float]
    """Processor times of scoring and both refinements [s]."""

    @classmethod
    def measured(cls, name: str, folder: Path, options: argparse.Namespace) -> Row:
        """Score and refine a row."""
        task, environment = name.split("/")
        nominal: str | Path = environment
        if environment.startswith("bed"):
            nominal = at_nominal_position(environment, folder)
        begun = time.process_time()
        file = tcs.score(task, nominal, "pr2", measure=options.measure, jobs=options.jobs)
        scored = time.process_time()
        refined = tcs.refine(file, jobs=options.jobs)
        kept = time.process_time()
        free = tcs.refine(file, keep_success=False, jobs=options.jobs)
        ended = time.process_time()
        return cls(name, file, refined, free, (scored - begun, kept - scored, ended - kept))

    @property
    def label(self) -> str:
        """Task and environment in words."""
        return self.name.replace("_", " ").replace("/", ", ")

    def cells(self, options: argparse.Namespace) -> list[str]:
        """Return the row of the table of refined sets."""
        found = refinement_summary(self.refined)
        before, after = (total(found, key) for key in ("before", "after"))
        best = np.array(self.file.nominal.sets.best)
        of_grid = np.stack([*self.refined.configurations.values(best).values()], axis=1)
        trials = Trials.of(self.file)
        offsets = trials.errors.draw(options.samples, 0)
        perturbed = PerturbedPoints(trials, offsets, options.jobs)
        success = [
            successes(
                perturbed,
                self.file.nominal.sets.weights,
                [Points(values, np.zeros(len(values), dtype=np.int64))],
            )[0]
            for values in (of_grid, first_set(self.refined), first_set(self.free))
        ]
        return [
            self.label,
            f"{before:.4f}",
            f"{after:.4f}",
            f"{after - before:+.4f}",
            f"{total(refinement_summary(self.free), 'after'):.4f}",
            f"{found['bound']:.4f}",
            f"{100.0 * found['gap']:.1f} %",
            *(f"{100.0 * value:.1f} %" for value in success),
            *(f"{value:.1f}" for value in self.seconds),
        ]


def total(found: dict[str, Any], key: str) -> float:
    """Return P_R + P_M of `before` or `after`."""
    return float(found[key]["reachability"] + found[key]["manipulability"])


def first_set(file: tcs.ScoreFile) -> FloatArray:
    """Return the values of the members of the first refined set."""
    table = file.nominal.refined
    assert table is not None
    return table.values[0, : table.sizes[0]]


def beside_cma(found: Row, options: argparse.Namespace) -> list[str]:
    """Return the row of the table that compares CMA-ES, medians of the seeds."""
    scorer = PointScorer.of(found.file, 0, options.jobs)
    space = Space.of(found.file.configurations, found.file.nominal.sets)
    scoring, _, refining = found.seconds
    ours = scoring + refining
    summary = refinement_summary(found.free)
    reached = total(summary, "after")
    runs = [cma_run(scorer, space, found.file, ours, seed) for seed in range(options.seeds)]
    at_time = [run[2][-1] for run in runs]
    return [
        found.label,
        f"{statistics.median(run[0] for run in runs):.4f}",
        f"{statistics.median(run[1] for run in runs):.1f}",
        *(f"{statistics.median(values):.4f}" for values in zip(*(r[2] for r in runs), strict=True)),
        f"{total(summary, 'before'):.4f}",
        f"{scoring:.1f}",
        f"{reached:.4f}",
        f"{ours:.1f}",
        str(options.seeds),
        str(sum(value < reached for value in at_time)),
    ]


def cma_run(
    scorer: PointScorer, space: Space, file: tcs.ScoreFile, ours: float, seed: int
) -> tuple[float, float, list[float]]:
    """Return P_R + P_M of CMA-ES after its iterations, their time [s], and P_R + P_M over time."""
    import cma

    low, high = np.tile(space.low, 2), np.tile(space.high, 2)
    free = high > low
    start = (low + high) / 2.0
    strategy = cma.CMAEvolutionStrategy(
        start[free],
        1.0,
        {
            "popsize": POPULATION_WITH_ENVIRONMENT if space.environment_axes else POPULATION,
            "CMA_stds": ((high - low) / 4.0)[free],
            "bounds": [low[free], high[free]],
            "CMA_cmean": CMEAN,
            "seed": seed + 1,
            "verbose": -9,
        },
    )
    goals = np.mean([np.reshape(at, (-1, 3))[0, :2] for at in file.body_frames.values()], axis=0)
    begun = time.process_time()
    best = [0.0] * len(FRACTIONS)
    at_end, spent, iteration = (0.0, 0.0), 0.0, 0
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
        for i, fraction in enumerate(FRACTIONS):
            if spent <= fraction * ours:
                best[i] = max(best[i], totals.max())
    return at_end[0], at_end[1], best


def evaluated(
    scorer: PointScorer, space: Space, file: tcs.ScoreFile, values: FloatArray, goals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return cost, and P_R + P_M, of sets of two, shape (n, 2 axes)."""
    members = space.inside(values.reshape(len(values), 2, -1))
    slow = np.r_[np.arange(space.environment_axes), members.shape[-1] - 1]
    rounded = np.round(members[..., slow] / SLOW_STEP) * SLOW_STEP
    members[..., slow] = np.clip(rounded, space.low[slow], space.high[slow])
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

"""Compare with TOC, the method's successor, on its score, in rooms with its errors.

Usage: python benchmarks/toc.py [--rows TASK/ENVIRONMENT ...] [--samples 1000] [--head-turn]
           [--seed 0] [--processes 2]

TOC (Kapusta and Kemp, Autonomous Robots 43, 2019) minimises 10 - 10 P_R - P_M with CMA-ES, P_M
being the joint-limit-weighted isotropy (`--measure jlwki`), and times 0.95 for two configurations.
Each task is scored by that measure, on the bed with the person at the nominal position. The best
set of the grid, a run of CMA-ES as in the original program and the set refined by its success are
judged in the same rooms with TOC's errors: chair 12.5 mm and 2.5 deg, person 25 and 50 mm along and
across the body and 5 deg (normal, standard deviations).
With `--head-turn`, the person in the wheelchair may turn the head for the tasks at the face. With
`--save`, the saved rows that a run does not measure are kept.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from cma_baseline import cma_run
from optimum import SUREST, first_set, label, on_grid, warm_up
from table import CHECKOUT, header, parser, record, row, save, saved_rows

import tcs
from tcs.kernel.arrays import FloatArray
from tcs.placement.robustness import PerturbedPoints, Trials
from tcs.placement.scoring import task_environment_pairs
from tcs.placement.tables import tc_reachability

MEASURE = "jlwki"
ERRORS = """errors:
  person_x: {distribution: normal, std: 0.025}
  person_y: {distribution: normal, std: 0.05}
"""
CHAIR_ERRORS = """  person_yaw: {distribution: normal, std_deg: 5}
  wheelchair_x: {distribution: normal, std: 0.0125}
  wheelchair_y: {distribution: normal, std: 0.0125}
  wheelchair_yaw: {distribution: normal, std_deg: 2.5}
"""
HEAD_TURN = CHECKOUT / "examples" / "wheelchair_head_turn.yaml"
SETS = ("best of the grid", "CMA-ES", "refined by success")
COLUMNS = ("task, environment", *SETS)
MEAN_COLUMNS = ("mean of the rows", "rows", *SETS)


def main() -> None:
    """Judge every row and print both tables."""
    command_line = parser(__doc__)
    command_line.add_argument("--rows", nargs="*", metavar="TASK/ENVIRONMENT")
    command_line.add_argument("--samples", type=int, default=1000)
    command_line.add_argument("--head-turn", action="store_true")
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--processes", type=int, default=2)
    options = command_line.parse_args()
    header("cma")
    names = options.rows or [
        "/".join(pair) for pair in task_environment_pairs(None) if pair[1] != "bed-no-wall"
    ]
    context = multiprocessing.get_context("spawn")
    goals, rooms = [], []
    print(" | ".join(COLUMNS))
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(options.processes, context, warm_up) as pool,
    ):
        for name, found in zip(
            names, pool.map(partial(judged, Path(folder), options), names), strict=True
        ):
            goals.append([label(name), *cells(found, 0)])
            rooms.append([label(name), *cells(found, 1)])
            print(" | ".join(rooms[-1]), "| goals:", " | ".join(goals[-1][1:]), flush=True)
            record("goals", COLUMNS, goals)
            record("rooms", COLUMNS, rooms)
            means = [
                mean_of("goals reached", "goals", goals),
                mean_of("rooms with all goals reached", "rooms", rooms),
            ]
            record("means", MEAN_COLUMNS, means)
            save(options, keep=True)
    row("rows", str(len(names)))


def cells(found: Sequence[tuple[float, float]], which: int) -> list[str]:
    """Return one of the two figures of each set."""
    return [f"{100.0 * pair[which]:.1f} %" for pair in found]


def mean_of(name: str, table: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a row with the mean over a table, with the rows that earlier runs saved."""
    cells_by_row = {**saved_rows(table, COLUMNS), **{cells[0]: list(cells) for cells in rows}}
    columns = list(zip(*cells_by_row.values(), strict=True))[1:]
    means = [np.mean([float(cell.split()[0]) for cell in column]) for column in columns]
    return [name, str(len(cells_by_row)), *(f"{value:.1f} %" for value in means)]


def environment_file(folder: Path, environment: str, options: argparse.Namespace) -> Path:
    """Return the path of an environment with TOC's errors and no observed positions."""
    is_chair = environment == "wheelchair"
    base = str(HEAD_TURN) if is_chair and options.head_turn else environment
    text = f"based_on: {base}\nname: {environment}-toc\nobserved: {{}}\n{ERRORS}"
    path = folder / f"{environment}.yaml"
    path.write_text(text + (CHAIR_ERRORS if is_chair else ""), encoding="utf-8")
    return path


def judged(folder: Path, options: argparse.Namespace, name: str) -> list[tuple[float, float]]:
    """Return the mean of the goals reached, and the rooms with all of them, for each set."""
    task, environment = name.split("/")
    at = environment_file(folder, environment, options)
    file = tcs.score(task, at, "pr2", measure=MEASURE, jobs=1, paper=True)
    robust = tcs.robustify(file, sets=400, samples=256, jobs=1)
    run = cma_run(file, 0.0, options.seed, toc=True, whole=True)
    sets = [
        on_grid(file, file.nominal.sets.best),
        run.members,
        first_set(tcs.refine(robust, jobs=1, **SUREST)),
    ]
    trials = Trials.of(file)
    samples = PerturbedPoints(trials, trials.errors.draw(options.samples, 0), 1)
    return [success(samples, trials.weights, values) for values in sets]


def success(
    samples: PerturbedPoints, weights: FloatArray, values: FloatArray
) -> tuple[float, float]:
    """Return the mean of P_R over rooms, and the fraction of rooms with all goals."""
    found = samples.reached(values)
    reached = np.logical_or.reduce(found, axis=0)
    return float(tc_reachability(reached, weights).mean()), float(reached.all(axis=1).mean())


if __name__ == "__main__":
    main()

"""Measure the rows of Table I on the bed with the head rest as printed in the paper: below 70 deg.

Usage: python benchmarks/printed_grid.py [--tasks NAME ...] [--samples 1000] [--seed 0] [--jobs 2]

The paper prints the range [0, 70 deg) for the head rest, so 0 and 35 deg; the original program also
uses 70 deg, and so does `bed`. Each task is scored on both grids, with the person at the nominal
position, and the set with the greatest P_R + P_M is evaluated under the paper's errors.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from table import header, parser, record, row, save

import tcs
from tcs.placement.robustness import Evaluation, evaluate
from tcs_studies.output.report.robustness.paper import load_paper
from tcs_studies.output.words import mean_and_std

PRINTED = "head_rest <= 35 deg"
COLUMNS = (
    "task, environment",
    "paper, Table I",
    "head rest 0, 35, 70 deg",
    "its head rests [deg]",
    "head rest 0, 35 deg, as printed",
    "its head rests [deg]",
)


def main() -> None:
    """Evaluate every row of the bed on both grids and print the table."""
    command_line = parser(__doc__)
    command_line.add_argument("--tasks", nargs="*", metavar="NAME")
    command_line.add_argument("--samples", type=int, default=1000)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    paper, rows = load_paper(), []
    print(" | ".join(COLUMNS))
    with tempfile.TemporaryDirectory() as folder:
        for task, environment in paper.rows():
            if environment == "wheelchair" or (options.tasks and task not in options.tasks):
                continue
            published = paper.published(task, environment)
            cells = [f"{task.replace('_', ' ')}, {environment}"]
            cells.append(f"{published.mean:.1f} ({published.std:.1f})" if published else "–")
            nominal = at_nominal_position(environment, Path(folder))
            for only in ((), (PRINTED,)):
                found = best_under_error(task, nominal, only, options)
                rests = sorted({round(m["head_rest_deg"]) for m in found.members})
                cells += [mean_and_std(found), ", ".join(map(str, rests))]
            rows.append(cells)
            print(" | ".join(cells), flush=True)
    record("rows", COLUMNS, rows)
    row("rows", str(len(rows)))
    save(options)


def at_nominal_position(environment: str, folder: Path) -> Path:
    """Return the path of an environment file without observed positions of the person."""
    path = folder / f"{environment}.yaml"
    text = f"based_on: {environment}\nname: {environment}-nominal\nobserved: {{}}\n"
    path.write_text(text, encoding="utf-8")
    return path


def best_under_error(
    task: str, environment: Path, only: tuple[str, ...], options: argparse.Namespace
) -> Evaluation:
    """Return the evaluation of the best set of a task on a grid."""
    file = tcs.score(task, environment, "pr2", only=only, jobs=options.jobs, paper=True)
    return evaluate(file, samples=options.samples, seed=options.seed, jobs=options.jobs)


if __name__ == "__main__":
    main()

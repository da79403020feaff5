"""Measure the success under pose errors of every row of the paper's Table I.

Usage: python benchmarks/robustness.py [--scores DIR] [--rows TASK/ENVIRONMENT ...]
           [--samples 1000] [--sets 200] [--set-samples 256] [--seed 0] [--jobs 2]

Score files are read from DIR, where missing ones are written; nothing in them is changed. The
results depend on the seed alone, not on the machine. `scripts/robustness_report.py` writes the same
tables as a page, with pictures.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from table import cell, header, parser, record, record_table, row, save

import tcs
from tcs.files.writing import make_folder
from tcs.output.report.blocks import Table
from tcs.placement.robustness import robustify
from tcs.placement.scoring import default_path
from tcs_studies.output.report.robustness.paper import Paper, load_paper
from tcs_studies.output.report.robustness.tables import (
    find_contrast,
    gain_table,
    is_short,
    losses_table,
    prediction_table,
    table_1,
    table_3,
)
from tcs_studies.robustness.study import RowStudy, StudyPlan, check_row, study_rows

ROBOT = "pr2"
P_CLEAR = 0.01
"""Greatest p-value of a gain that is counted as one."""


def main() -> None:
    """Study every row, print the tables and record them."""
    command_line = parser(__doc__)
    command_line.add_argument("--scores", type=Path, default=Path("out/scores"))
    command_line.add_argument("--rows", nargs="*", metavar="TASK/ENVIRONMENT")
    command_line.add_argument("--samples", type=int, default=1000)
    command_line.add_argument("--sets", type=int, default=200)
    command_line.add_argument("--set-samples", type=int, default=256)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header("statsmodels")
    paper = load_paper()
    make_folder(options.scores)
    with tempfile.TemporaryDirectory() as folder:
        paths = [
            estimated(task, environment, Path(folder), options)
            for task, environment in paper.rows()
            if not options.rows or f"{task}/{environment}" in options.rows
        ]
        plan = StudyPlan(
            samples=options.samples, seed=options.seed, compared=tuple(paper.compared_rows())
        )
        begun = time.perf_counter()
        rows = study_rows(paths, plan, jobs=options.jobs)
        row("rows studied", f"{len(rows)} in {time.perf_counter() - begun:.0f} s")
    tables = {
        "rows": table_1(rows, paper),
        "methods": table_3(rows, paper),
        "gains": gain_table(rows),
        "prediction": prediction_table(rows),
    }
    for name, table in tables.items():
        show(table)
        record_table(name, table)
    lost(rows, paper)
    counts(rows, paper)
    save(options)


def estimated(task: str, environment: str, folder: Path, options: argparse.Namespace) -> Path:
    """Return the path of a copy of a score file with estimates of success."""
    path = options.scores / default_path(task, environment, ROBOT)
    if not path.exists():
        tcs.save(path, tcs.score(task, environment, ROBOT, jobs=options.jobs, paper=True))
    file = tcs.load(path)
    check_row(path, file, task, environment, ROBOT)
    begun = time.perf_counter()
    file = robustify(
        file,
        sets=options.sets,
        samples=options.set_samples,
        body_collisions="paper",
        seed=options.seed,
        tables=[file.nominal_index],
        jobs=options.jobs,
    )
    row(f"estimates, {task}, {environment}", f"{time.perf_counter() - begun:.0f} s")
    copy = folder / path.name
    tcs.save(copy, file)
    return copy


def lost(rows: Sequence[RowStudy], paper: Paper) -> None:
    """Print and record the goals that rows below the paper's mean lose."""
    columns, body = ["row"], []
    for one in rows:
        if is_short(one, paper) and one.losses.goals:
            table = losses_table(one)
            show(table)
            columns = ["row", *(column.title for column in table.columns)]
            body += [[one.name, *cells] for cells in table.texts()]
    record("losses", columns, body)


def counts(rows: Sequence[RowStudy], paper: Paper) -> None:
    """Print and record how many rows and comparisons support each statement."""
    published = [one for one in rows if paper.published(one.task, one.environment)]
    level = sum(not is_short(one, paper) for one in published)
    contrasts = [
        (one, found)
        for one in rows
        for members in (1, 2)
        if (found := find_contrast(one, members)) is not None
    ]
    spreads = [
        one.methods.paired[found.first].summary.std < one.methods.paired[found.second].summary.std
        for one, found in contrasts
        if one.methods is not None
    ]
    better = sum(found.paired.mean > 0.0 for _, found in contrasts)
    gains = [one.gain for one in rows if one.gain is not None]
    clear = sum(gain.paired.mean > 0.0 and gain.paired.p < P_CLEAR for gain in gains)
    worse = sum(gain.paired.mean < 0.0 and gain.paired.p < P_CLEAR for gain in gains)
    equal = [p.rho for one in rows for p in one.predictions if p.equal_reach and p.rho is not None]
    for line, count, of in (
        ("rows with a mean equal to or above the paper's", level, len(published)),
        ("comparisons with a greater mean with TC-manipulability", better, len(contrasts)),
        ("comparisons with a smaller deviation with it", sum(spreads), len(spreads)),
        (f"rows that gain if sets are selected by success, p < {P_CLEAR:g}", clear, len(gains)),
        (f"rows that lose by it, p < {P_CLEAR:g}", worse, len(gains)),
        ("positive correlations, equal P_R", sum(rho > 0.0 for rho in equal), len(equal)),
    ):
        row(line, f"{count} of {of}")
        cell("counts", line, "count", str(count))
        cell("counts", line, "of", str(of))


def show(table: Table) -> None:
    """Print a table."""
    print(f"\n{table.caption}")
    for cells in ([column.title for column in table.columns], *table.texts()):
        print("  ".join(cells))


if __name__ == "__main__":
    main()

"""Write the robustness report: Tables I and III of the TCS paper as HTML, Markdown and CSV.

    python scripts/robustness_report.py --out out/robustness

Score files are read from the folder --scores. Missing rows are scored first, and rows without
estimates of success get them (`tcs robustify` makes estimates with more samples).
"""

from __future__ import annotations

import argparse
import shlex
import sys
import time
from pathlib import Path

import tcs
from tcs.errors import UnknownNameError
from tcs.files.writing import make_folder
from tcs.model.random_streams import check_draws
from tcs.output import terminal
from tcs.placement.robustness import robustify
from tcs.placement.scoring import default_path
from tcs_studies.output.report.robustness.page import draw_rows
from tcs_studies.output.report.robustness.paper import load_paper
from tcs_studies.output.report.robustness.write import write_report
from tcs_studies.robustness.study import StudyPlan, check_row, study_rows

ROBOT = "pr2"
SETS, SAMPLES = 200, 256
"""Pairs and samples of the estimates for rows without estimates: 15 s per row, and within a percent
of the default estimates of `tcs robustify`."""


def main() -> int:
    """Run the study and write the report; return the exit code."""
    options = parse()
    return terminal.exit_code_of(lambda: run(options))


def parse() -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/robustness"), help="folder to write")
    parser.add_argument("--scores", type=Path, default=Path("out/scores"), help="score files")
    parser.add_argument(
        "--rows", nargs="+", metavar="TASK/ENVIRONMENT", help="only these rows of Table I"
    )
    parser.add_argument("--samples", type=int, default=1000, help="samples of each method")
    parser.add_argument("--seed", type=int, default=0, help="seed of all samples")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    return parser.parse_args()


def run(options: argparse.Namespace) -> int:
    """Score missing rows, study every row, write the report."""
    rows = chosen(options.rows)
    check_draws(options.samples, options.seed)
    if options.jobs < 1:
        raise tcs.TcsError(f"--jobs is {options.jobs}; must be at least 1.")
    make_folder(options.out)
    make_folder(options.scores)
    paths = [options.scores / default_path(*row, ROBOT) for row in rows]
    for (task, environment), path in zip(rows, paths, strict=True):
        if not path.exists():
            score(path, (task, environment), options.jobs)
        estimate(path, (task, environment), options)
    compared = tuple(load_paper().compared_rows())
    plan = StudyPlan(samples=options.samples, seed=options.seed, compared=compared)
    begun = time.perf_counter()
    with terminal.progress_bar("rows studied") as on_progress:
        found = study_rows(
            paths,
            plan,
            jobs=options.jobs,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    pictures = draw_rows(paths, jobs=options.jobs)
    seconds = time.perf_counter() - begun
    command = shlex.join(["python", *sys.argv])
    for path in write_report(options.out, found, pictures, plan, seconds=seconds, command=command):
        print(f"wrote {path}: {path.stat().st_size:,} bytes")
    return 0


def score(path: Path, row: tuple[str, str], jobs: int) -> None:
    """Score a row and save it."""
    with terminal.progress_bar(f"configurations, {path.stem}") as on_progress:
        file = tcs.score(
            *row,
            ROBOT,
            paper=True,
            jobs=jobs,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    tcs.save(path, file)


def estimate(path: Path, row: tuple[str, str], options: argparse.Namespace) -> None:
    """Estimate the success of the best sets of a row for the nominal person, if necessary."""
    file = tcs.load(path)
    check_row(path, file, *row, ROBOT)
    settings = file.metadata.get("robustness", [None] * len(file.tables))[file.nominal_index]
    is_default = settings is not None and settings["environment_errors"]
    if is_default and settings["body_collisions"] == "paper":
        # Estimates with more samples are kept.
        if settings["samples"] >= SAMPLES and settings["sets"] >= SETS:
            return
    with terminal.progress_bar(f"rounds of estimation, {path.stem}") as on_progress:
        file = robustify(
            file,
            sets=SETS,
            samples=SAMPLES,
            body_collisions="paper",
            seed=options.seed,
            tables=[file.nominal_index],
            jobs=options.jobs,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    tcs.save(path, file)


def chosen(names: list[str] | None) -> list[tuple[str, str]]:
    """Return task and environment of the rows named by --rows, in the paper's order."""
    rows = list(load_paper().rows())
    known = {f"{task}/{environment}": (task, environment) for task, environment in rows}
    for name in names or ():
        if name not in known:
            raise UnknownNameError("row", name, known, where="--rows")
    return [known[name] for name in known if names is None or name in names]


if __name__ == "__main__":
    sys.exit(main())

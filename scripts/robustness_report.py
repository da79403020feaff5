"""Tables I and III of the TCS paper on our scenes, as a page, as Markdown and sample by sample.

    python scripts/robustness_report.py --out out/robustness

Score files are taken from the folder named by --scores. Rows that are not there are scored first,
and those without estimates of success get them (`tcs robustify` makes more thorough ones).
"""

from __future__ import annotations

import argparse
import shlex
import sys
import time
from pathlib import Path

import tcs
from tcs.cli import talk
from tcs.cli.rows import default_path, score_one
from tcs.errors import UnknownNameError
from tcs.files.writing import make_folder
from tcs.output.report import draw_rows, load_paper, write_report
from tcs.placement.robustness import StudyPlan, check_row, robustify, study_rows
from tcs.placement.robustness.error_model import check_draws

ROBOT = "pr2"
RACED_SETS, RACE_SAMPLES = 200, 256
"""How many sets of each size race for the greatest success, and how far, where nobody has let them
yet: a quarter of a minute for a row, and within a percent of the full race."""


def main() -> int:
    """Run the study and write the report; return the exit code."""
    options = parse()
    return talk.exit_code_of(lambda: run(options))


def parse() -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/robustness"), help="folder to write")
    parser.add_argument("--scores", type=Path, default=Path("out/scores"), help="score files")
    parser.add_argument("--rows", nargs="+", metavar="TASK/ROOM", help="only these rows of Table I")
    parser.add_argument("--samples", type=int, default=1000, help="samples of each method")
    parser.add_argument("--seed", type=int, default=0, help="seed of all samples")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    return parser.parse_args()


def run(options: argparse.Namespace) -> int:
    """Score what is missing, try every row, write the report."""
    rows = chosen(options.rows)
    check_draws(options.samples, options.seed)
    if options.jobs < 1:
        raise tcs.TcsError(f"--jobs is {options.jobs}; must be at least 1.")
    make_folder(options.out)
    make_folder(options.scores)
    paths = [options.scores / default_path(*row, ROBOT) for row in rows]
    for (task, environment), path in zip(rows, paths, strict=True):
        if not path.exists():
            score_one(task, environment, ROBOT, path, jobs=options.jobs)
        estimate(path, (task, environment), options)
    compared = tuple(load_paper().compared_rows())
    plan = StudyPlan(samples=options.samples, seed=options.seed, compared=compared)
    begun = time.perf_counter()
    with talk.progress_bar("rows tried") as on_progress:
        found = study_rows(
            paths, plan, jobs=options.jobs, on_progress=on_progress, on_compile=compiling
        )
    pictures = draw_rows(paths, jobs=options.jobs)
    seconds = time.perf_counter() - begun
    command = shlex.join(["python", *sys.argv])
    for path in write_report(options.out, found, pictures, plan, seconds=seconds, command=command):
        print(f"wrote {path}: {path.stat().st_size:,} bytes")
    return 0


def estimate(path: Path, row: tuple[str, str], options: argparse.Namespace) -> None:
    """Have the success of the best sets of a row estimated, with the person where they belong."""
    file = tcs.load(path)
    check_row(path, file, *row, ROBOT)
    made = file.metadata.get("robustness", [None] * len(file.tables))[file.nominal_index]
    if made is not None and made["environment_errors"] and not made["check_base"]:
        # Whoever has estimated more thoroughly is believed.
        if made["samples"] >= RACE_SAMPLES and made["sets"] >= RACED_SETS:
            return
    with talk.progress_bar(f"rounds of the race, {path.stem}") as on_progress:
        file = robustify(
            file,
            sets=RACED_SETS,
            samples=RACE_SAMPLES,
            seed=options.seed,
            tables=[file.nominal_index],
            jobs=options.jobs,
            on_progress=on_progress,
            on_compile=compiling,
        )
    tcs.save(path, file)


def compiling() -> None:
    """Say why nothing moves for a while."""
    talk.say("compiling for this machine, up to a minute; later runs do without.")


def chosen(names: list[str] | None) -> list[tuple[str, str]]:
    """Return task and room of the rows that are asked for, in the paper's order."""
    rows = list(load_paper().rows())
    known = {f"{task}/{environment}": (task, environment) for task, environment in rows}
    for name in names or ():
        if name not in known:
            raise UnknownNameError("row", name, known, where="--rows")
    return [known[name] for name in known if names is None or name in names]


if __name__ == "__main__":
    sys.exit(main())

"""Reached goals that have no motion, and the best sets that can be executed, for each row.

Usage: python benchmarks/motions.py FILE [FILE ...] [--most N] [--sample N] [--jobs 2] [--seed 0]

All pairs of configuration and goal that a score file reaches in its nominal table are examined, or
those of a sample of the configurations: from rest to the approach, straight in, out and back.
Times include preparing the row; those of the processor are of the whole process. A row whose
motion file lies beside its score file, as the benchmark leaves it, and is of as many pairs, is not
examined again, so that an interrupted run continues; delete the files to begin anew.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from table import cell, header, parser, row, save

import tcs
from tcs.model.grid import Grid
from tcs.motion.examine import examination
from tcs.placement.selection import Executability
from tcs.placement.store import MotionFile, motion_path, motions_of, save_motions

WEIGHTS = tcs.UtilityWeights(travel=0.0, places=0.0, environment=0.0)
"""Sets are compared by P_R + P_M alone."""


def main() -> int:
    """Examine every file."""
    command_line = parser(__doc__)
    command_line.add_argument("files", nargs="+", type=Path)
    command_line.add_argument("--most", type=int, help="configurations, those of the best sets")
    command_line.add_argument("--sample", type=int, help="configurations drawn at random")
    command_line.add_argument("--jobs", type=int, default=2)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    pairs = done = 0
    for path in options.files:
        file = tcs.load(path)
        motions = examined(path, file, options)
        found = examination(file, motions, file.nominal_index)
        pairs, done = pairs + found["pairs"], done + found["done"]
        report(path.stem, found)
        if options.sample is None:
            report_sets(path.stem, file, motions)
        save(options)
    share = f"{1.0 - done / pairs:.1%}"
    row("all rows", f"{share} of {pairs:,} reached pairs without a motion")
    cell("pairs", "all rows", "reached", f"{pairs:,}")
    cell("pairs", "all rows", "no motion", share)
    save(options)
    return 0


def examined(path: Path, file: tcs.ScoreFile, options: argparse.Namespace) -> MotionFile:
    """Return the motions of a row: those beside its score file, or else planned and saved there."""
    if motion_path(path).exists():
        kept = motions_of(file, path)
        asked = {"within": None, "most": options.most, "sample": options.sample}
        if all(kept.metadata[key] == value for key, value in asked.items()):
            return kept
    motions = tcs.examine(
        file,
        within=None,
        most=options.most,
        sample=options.sample,
        seed=options.seed,
        jobs=options.jobs,
    )
    save_motions(motion_path(path), motions)
    return motions


def report(name: str, found: dict) -> None:
    """Print and record which pairs can be done."""
    pairs, reasons = found["pairs"], found["not_done"]
    cells = {
        "configurations": f"{found['configurations']:,} of {found['candidates']:,}",
        "reached": f"{pairs:,}",
        "no motion": f"{found['fraction_not_done']:.1%}",
        "rest in contact": f"{reasons['rest_blocked'] / pairs:.1%}",
        "approach at limits": f"{reasons['approach_limits'] / pairs:.1%}",
        "approach blocked": f"{(reasons['approach_blocked'] + reasons['unreached']) / pairs:.1%}",
        "no path": f"{reasons['no_path'] / pairs:.1%}",
        "time [s]": f"{found['seconds']:.0f}",
        "processor time [s]": f"{found['processor_seconds']:.0f}",
    }
    for column, text in cells.items():
        cell("pairs", name, column, text)
    row(name, ", ".join(f"{column} {text}" for column, text in cells.items()))


def report_sets(name: str, file: tcs.ScoreFile, motions: MotionFile) -> None:
    """Print and record the best set by postures, and the best one that can be executed."""
    sets = file.nominal.sets
    here = Grid.from_dict(file.grid).configuration(sets.best[0])
    settings = file.observed_states[file.nominal_index]
    best = tcs.select(file, here, weights=WEIGHTS, observed=settings)
    chosen = tcs.select(file, here, weights=WEIGHTS, observed=settings, motions=motions)
    compared = Executability.of(file, motions, chosen, best)
    cells = {
        "P_R": f"{best.reachability:.3f}",
        "P_M": f"{best.manipulability:.3f}",
        "P_R with motions": f"{compared.reachability_done:.3f}",
        "P_R, executable set": f"{chosen.reachability:.3f}",
        "P_M, executable set": f"{chosen.manipulability:.3f}",
        "stops": f"{len(best.members)}, {len(chosen.members)}",
    }
    for column, text in cells.items():
        cell("sets", name, column, text)
    row(name, ", ".join(f"{column} {text}" for column, text in cells.items()))


if __name__ == "__main__":
    sys.exit(main())

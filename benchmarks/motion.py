"""Time and success of motion queries, and what Drake refutes of their paths.

Usage: python benchmarks/motion.py FILE [FILE ...] [--places 60] [--drake 20] [--seed 0]

At random configurations of each score file that reach two goals or more, paths are planned from
rest to the pre-approach postures of each approachable goal, and from those of one goal to those of
the next. What is not solved is tried again with other seeds for 10 s: if that succeeds it counts as
solvable, else only the time after which it was given up is told. Times are those of the processor.
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from table import cell, header, parser, row, save

import tcs
from tcs.kernel.arrays import FloatArray
from tcs.kernel.motion.search_trees import random_state
from tcs.model.scene import NeighbourList
from tcs.motion import Stop, accesses
from tcs.motion.paths import find_path, rounded
from tcs.motion.recheck import false_pieces
from tcs.placement.scoring.rebuild import rebuild_scenes

AGAIN = 10.0
"""Time after which a query counts as unsolvable [s]."""


class Tally:
    """Results of one type of query."""

    def __init__(self) -> None:
        """Start without a query."""
        self.seconds: list[float] = []
        """Of the first try of each query that is solvable."""
        self.given_up: list[float] = []
        """Of the first try of each other one."""
        self.solved = self.solved_later = self.edges = self.false = self.checked = 0

    def query(self, stop: Stop, starts: FloatArray, goals: FloatArray, most_checked: int) -> None:
        """Plan once, again if that fails, and re-check the path with Drake."""
        begun = time.process_time()
        found = find_path(stop, starts, goals)
        seconds = time.process_time() - begun
        if found is None:
            begun = time.process_time()
            while found is None and time.process_time() - begun < AGAIN:
                found = find_path(stop, starts, goals)
            self.solved_later += found is not None
            (self.given_up if found is None else self.seconds).append(seconds)
            return
        self.seconds.append(seconds)
        self.solved += 1
        if self.checked < most_checked:
            self.checked += 1
            for curve in rounded(stop, found[0]):
                self.edges += curve.pieces
                self.false += false_pieces(NeighbourList(stop.scene), stop.motion, curve)

    def report(self, line: str) -> None:
        """Print and record the results."""
        solvable = self.solved + self.solved_later
        milliseconds = 1e3 * np.quantile(self.seconds, [0.5, 0.99, 1.0])
        cells = {
            "queries solvable": f"{len(self.seconds):,}",
            "median [ms]": f"{milliseconds[0]:.2f}",
            "p99 [ms]": f"{milliseconds[1]:.0f}",
            "slowest [ms]": f"{milliseconds[2]:.0f}",
            "solved, of those solvable": f"{self.solved:,} of {solvable:,}",
            "others": f"{len(self.given_up):,}",
            "given up after [ms]": f"{1e3 * np.median(self.given_up or [0.0]):.0f}",
            "false, of the edges re-checked": f"{self.false:,} of {self.edges:,}",
        }
        for column, text in cells.items():
            cell("queries", line, column, text)
        row(line, ", ".join(f"{column} {text}" for column, text in cells.items()))


def main() -> int:
    """Run the queries of every file."""
    command_line = parser(__doc__)
    command_line.add_argument("files", nargs="+", type=Path)
    command_line.add_argument("--places", type=int, default=60)
    command_line.add_argument("--drake", type=int, default=20, help="paths that Drake re-checks")
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    row("seed", str(options.seed))
    for path in options.files:
        measure(tcs.load(path), path.stem, options.places, options.drake, options.seed)
    save(options)
    return 0


def measure(file: tcs.ScoreFile, name: str, places: int, checked: int, seed: int) -> None:
    """Run the queries of one file."""
    from_rest, between = Tally(), Tally()
    pairs = approachable = blocked = 0
    warm = True
    for stop, goals in chosen_stops(file, places, seed):
        if stop.rest_contact() is not None:
            blocked += 1
            continue
        found = [accesses(stop, goal).found for goal in goals]
        pairs += len(found)
        lists = [one for one in found if one]
        approachable += len(lists)
        begins = [np.array([access.begin for access in one]) for one in lists]
        if warm and begins:
            find_path(stop, stop.rest[None], begins[0], iterations=1)
            warm = False
        for begin in begins:
            from_rest.query(stop, stop.rest[None], begin, checked)
        for before, after in itertools.pairwise(begins):
            between.query(stop, before[:1], after, checked)
    cells = {
        "configurations": f"{places:,}",
        "rest posture in contact": f"{blocked:,}",
        "approachable, of the pairs reached": f"{approachable:,} of {pairs:,}",
    }
    for column, text in cells.items():
        cell("goals", name, column, text)
    row(name, ", ".join(f"{column} {text}" for column, text in cells.items()))
    from_rest.report(f"{name}, rest to goal")
    between.report(f"{name}, goal to goal")


def chosen_stops(file: tcs.ScoreFile, places: int, seed: int) -> Iterator[tuple[Stop, list[int]]]:
    """Yield random configurations that reach two goals or more, with those goals."""
    job, scene, _ = rebuild_scenes(file)[0]
    table = file.nominal_index
    reached = file.tables[table].scores.reached
    rows = np.flatnonzero(reached.sum(axis=1) >= 2)
    rng = np.random.default_rng(seed)
    for h in rng.choice(rows, min(places, len(rows)), replace=False):
        stop = Stop.of(job, scene, table * job.grid.size + int(h), seed)
        stop.trees.random[:] = random_state(seed)
        yield stop, np.flatnonzero(reached[h]).tolist()


if __name__ == "__main__":
    sys.exit(main())

"""Scoring beside a point cloud, and at many goals, against the bare scene and few goals.

Usage: python benchmarks/obstacles.py [--points 20000] [--cell 0.08] [--goals 1000] [--rounds 5]
           [--seed 0]

The cloud is a scan of the room around the wheelchair of *shaving*: points on two walls, a table and
a cupboard, in equal parts, with noise of 5 mm, in an environment file that names it, with cells
wider than the distance of the points (some 4 cm). The goals are those that a task makes all over
the trunk of the person in the wheelchair, as many as its spacing gives below `--goals`, against
eight of them, drawn at random, in 20 tasks without repetition. Times are processor times of
`tcs.score` as a whole on one thread, the two compared in turn; the median of the rounds, and the
least and the greatest. From those of the goals the time for a single configuration is taken off,
which is that of preparing.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray
from table import cell, header, parser, row, save

import tcs
from tcs.model.tasks import Surface, Task, load_task
from tcs.placement.scoring import load_job

NOISE = 0.005
"""Standard deviation of the noise of a scan [m]."""
SPACINGS = np.arange(0.02, 0.1, 0.001)
"""Distances of goals on the trunk that are tried [m]."""
PART = "base_yaw >= 130 deg", "base_yaw <= 230 deg"
"""Part of the grid at which many goals are scored."""
SINGLE = "base_x = 0.6 m", "base_y = -0.9 m", "base_yaw = 180 deg", "torso = 0.3 m"
"""A single configuration, for the time that preparing takes."""
FEW, DRAWS = 8, 20
"""Number of goals of most tasks, and of such tasks that are drawn without repetition."""
FACES = (
    # The lower and the upper corner of each [m]; the person sits at the origin and looks along x.
    ((-1.5, 1.9, 0.0), (2.5, 1.9, 2.2)),
    ((-1.4, -2.0, 0.0), (-1.4, 1.9, 2.2)),
    ((1.6, -0.5, 0.75), (2.2, 0.9, 0.75)),
    ((-1.0, -1.7, 0.0), (-0.3, -1.7, 1.1)),
)
"""Faces that the scan sees; the floor is cut off."""


Runs = list[tuple[list[tcs.ScoreFile], float]]
"""Files and processor time [s] of each round."""


def main() -> None:
    """Measure both ratios."""
    command_line = parser(__doc__)
    command_line.add_argument("--points", type=int, default=20_000)
    command_line.add_argument("--cell", type=float, default=0.08, help="edge of a cell [m]")
    command_line.add_argument("--goals", type=int, default=1000)
    command_line.add_argument("--rounds", type=int, default=5)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    rng = np.random.default_rng(options.seed)
    with tempfile.TemporaryDirectory() as folder:
        scanned = scanned_room(Path(folder), cloud(options.points, rng), options.cell)
        bare, beside = in_turn(
            options.rounds,
            partial(scored, ["shaving"]),
            partial(scored, ["shaving"], environment=scanned),
        )
    name = f"{options.points:,} points, cells of {100.0 * options.cell:.0f} cm"
    report("cloud", name, "the bare scene", beside, bare)
    many = trunk(options.goals)
    few = [
        replace(many, goals=tuple(many.goals[i] for i in sorted(drawn)))
        for drawn in rng.permutation(len(many.goals))[: DRAWS * FEW].reshape(DRAWS, FEW)
    ]
    *prepared, of_few, of_many = in_turn(
        options.rounds,
        *(partial(scored, tasks, only) for only in (SINGLE, PART) for tasks in (few, [many])),
    )
    for runs, found in zip(prepared, (of_few, of_many), strict=True):
        least = min(seconds for _, seconds in runs)
        found[:] = [(files, seconds - least) for files, seconds in found]
    report("goals", f"{len(many.goals)} goals", f"{FEW} goals, {DRAWS} times", of_many, of_few)
    save(options)


def cloud(points: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return points on the faces of the room, shape (n, 3) [m]."""
    parts = []
    for lower, upper in FACES:
        parts.append(rng.uniform(lower, upper, (points // len(FACES), 3)))
    return np.concatenate(parts) + rng.normal(0.0, NOISE, (len(parts) * len(parts[0]), 3))


def scanned_room(folder: Path, points: NDArray[np.float64], edge: float) -> Path:
    """Write a cloud and the environment that names it; return the path of the environment."""
    np.save(folder / "scan.npy", points)
    path = folder / "scanned.yaml"
    obstacle = {"name": "scan", "file": "scan.npy", "cell": edge}
    written = {"based_on": "wheelchair", "name": "scanned", "obstacles": [obstacle]}
    path.write_text(yaml.safe_dump(written), encoding="utf-8")
    return path


def trunk(most: int) -> Task:
    """Return a task with at most so many goals all over the trunk of the person."""
    shaving = load_task("shaving")
    for spacing in SPACINGS:
        torso = Surface(body="torso", spacing=float(spacing))
        covered = replace(shaving, goals=(), surfaces=(torso,), keep_out=())
        try:
            made = load_job(covered, "wheelchair", "pr2").task
        except tcs.TcsError:
            # More goals than a task may have.
            continue
        if len(made.goals) <= most:
            return made
    raise AssertionError("no spacing gives so few goals")


def scored(
    tasks: Sequence[str | Task], only: Sequence[str] = (), environment: str | Path = "wheelchair"
) -> list[tcs.ScoreFile]:
    """Return the score file of each task."""
    return [tcs.score(task, environment, "pr2", jobs=1, only=only, paper=True) for task in tasks]


def in_turn(rounds: int, *scorings: Callable[[], list[tcs.ScoreFile]]) -> list[Runs]:
    """Return for each scoring the files and the processor time [s] of each round."""
    results: list[Runs] = [[] for _ in scorings]
    for scoring in scorings:
        scoring()
    for _ in range(rounds):
        for found, scoring in zip(results, scorings, strict=True):
            begun = time.process_time()
            files = scoring()
            found.append((files, time.process_time() - begun))
    return results


def report(
    table: str,
    name: str,
    other: str,
    found: Runs,
    base: Runs,
) -> None:
    """Print and record two scorings and the ratio of their times for each pair."""
    medians = []
    for label, runs in ((other, base), (name, found)):
        scores = [file.nominal.scores for file in runs[0][0]]
        seconds = [spent for _, spent in runs]
        pairs = sum(table.reason.size for table in scores)
        each = statistics.median(seconds) / pairs
        medians.append(each)
        cells = {
            "pairs": f"{pairs:,}",
            "reached": f"{sum(int(np.count_nonzero(table.reached)) for table in scores):,}",
            "processor time [s]": f"{statistics.median(seconds):.2f}",
            "least to greatest [s]": f"{min(seconds):.2f} to {max(seconds):.2f}",
            "for each pair [us]": f"{1e6 * each:.2f}",
        }
        for column, text in cells.items():
            cell(table, label, column, text)
        row(label, ", ".join(f"{column} {text}" for column, text in cells.items()))
    cell(table, "ratio for each pair", "for each pair [us]", f"{medians[1] / medians[0]:.2f}")
    row("ratio", f"{medians[1] / medians[0]:.2f}")


if __name__ == "__main__":
    main()

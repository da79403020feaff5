"""Measure the engines of scoring beside each other on one task.

Usage: python benchmarks/engines.py [--task bathing] [--environment bed] [--rounds 5] [--jobs 2]

Threads, and a Dask cluster of as many local workers with one thread each, in turns. The cluster
runs already, as it would at a user's. Compiled code is warm.
"""

from __future__ import annotations

import hashlib
import statistics

from distributed import LocalCluster
from table import header, parser, record, row, save

import tcs
from tcs.placement.scoring.engines import Dask, ScoringEngine, Threads


def main() -> None:
    """Score with each engine in turns, compare the scores, print and record the times."""
    command_line = parser(__doc__)
    command_line.add_argument("--task", default="bathing")
    command_line.add_argument("--environment", default="bed")
    command_line.add_argument("--rounds", type=int, default=5)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    with LocalCluster(
        n_workers=options.jobs, threads_per_worker=1, dashboard_address=":0"
    ) as cluster:
        engines: dict[str, ScoringEngine] = {
            "threads": Threads(options.jobs),
            "dask, local workers": Dask(cluster.scheduler_address),
        }
        times: dict[str, list[float]] = {name: [] for name in engines}
        digests = set()
        # The first round loads the compiled code everywhere and is not counted.
        for number in range(options.rounds + 1):
            for name, engine in engines.items():
                file = tcs.score(
                    options.task,
                    options.environment,
                    jobs=options.jobs,
                    engine=engine,
                    paper=True,
                )
                digests.add(digest(file))
                if number:
                    times[name].append(file.metadata["timings"]["scoring_seconds"])
    if len(digests) != 1:
        raise SystemExit("the engines give different scores")
    rows = []
    for name, seconds in times.items():
        ratios = [a / b for a, b in zip(seconds, times["threads"], strict=True)]
        rows.append(
            [
                name,
                f"{statistics.median(seconds):.2f} ({min(seconds):.2f}-{max(seconds):.2f})",
                f"{statistics.median(ratios):.2f} ({min(ratios):.2f}-{max(ratios):.2f})",
            ]
        )
        row(name, "  ".join(rows[-1][1:]))
    record("engines", ["engine", "scoring [s], median (range)", "times that of threads"], rows)
    save(options)


def digest(file: tcs.ScoreFile) -> str:
    """Return a hash of all scores of a file."""
    sha = hashlib.sha256()
    for table in file.tables:
        scores = table.scores
        for array in (scores.reason, scores.dexterity, scores.pair, scores.arm_joints):
            sha.update(array.tobytes())
    return sha.hexdigest()


if __name__ == "__main__":
    main()

"""Measure the figures of the README on this machine and print them as one table.

Usage: python benchmarks/run.py [--task shaving] [--repeats 5] [--pairs 2000] [--dense 1000]

Times of one run are comparable; because machines are shared and noisy, median and range are
printed. This is a benchmark, not a test.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from table import cell, header, parser, row, save, spread, verification_text

from tcs.kernel.problem import build_problem
from tcs.model.grid import InitialConfiguration
from tcs.placement.scoring import build_sets, load_job, score, sweep, verify, warm_up
from tcs.placement.selection import SelectionTables, select
from tcs.placement.store import load_scores, save_scores
from tcs.placement.tables import Reason
from tests.reference import pairs as reference_pairs

REFERENCE_PAIRS = 12
PLACES = 1000


def main() -> int:
    """Run every measurement and print it; return 1 if an answer is false."""
    options = parse()
    header()
    row("task", f"{options.task} in the wheelchair, PR2, seed {options.seed}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scores.tcs"
        lowered_times(options)
        file = score(options.task, paper=True)
        save_scores(path, file)
        store_times(path, options.repeats)
        select_times(path, options.seed)
        process_times(options.task, Path(folder) / "again.tcs", options.repeats)
        sound = verification(path, options)
    save(options)
    return 0 if sound else 1


def measured(name: str, text: str) -> None:
    """Print one measured value, and record it for the docs."""
    row(name, text)
    cell("summary", name, "measured", text)


def parse() -> argparse.Namespace:
    """Return the command line's options."""
    command_line = parser(__doc__)
    command_line.add_argument("--task", default="shaving")
    command_line.add_argument("--repeats", type=int, default=5)
    command_line.add_argument("--pairs", type=int, default=2000)
    command_line.add_argument("--dense", type=int, default=1000)
    command_line.add_argument("--seed", type=int, default=0)
    return command_line.parse_args()


def lowered_times(options: argparse.Namespace) -> None:
    """Measure scoring and set building, and compare the kernel with the plain-loop reference."""
    begun = time.perf_counter()
    job = load_job(options.task, "wheelchair", "pr2", paper=True)
    lowered = job.lowered(job.scene())
    row("scene built and lowered", f"{time.perf_counter() - begun:.3f} s")
    loading = warm_up(build_problem(lowered.arrays))
    row("kernel compiled or loaded", f"{loading:.3f} s")
    times: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(options.repeats):
        for jobs, taken in times.items():
            swept = sweep(lowered, job.task.weights, jobs=jobs)
            taken.append(swept.scoring_seconds)
    scores = swept.tables[0]
    row("configurations x goals", f"{scores.configurations} x {scores.goals}")
    row("reasons", ", ".join(f"{name} {n}" for name, n in scores.reason_counts().items()))
    for jobs, taken in times.items():
        measured(f"scoring_seconds, jobs {jobs}", spread(taken))
    ratios = [one / two for one, two in zip(times[1], times[2], strict=True)]
    measured("thread scaling 1 -> 2", spread(ratios, "x"))
    building = []
    for _ in range(options.repeats):
        begun = time.perf_counter()
        sets = build_sets(scores, job.grid)
        building.append(time.perf_counter() - begun)
    measured("sets_seconds, jobs 2", f"{spread(building)}, {sets.sets} sets")
    rng = np.random.default_rng(options.seed)
    kept = np.argwhere(scores.reason == Reason.REACHED)
    picked = kept[rng.choice(len(kept), REFERENCE_PAIRS, replace=False)]
    begun = time.perf_counter()
    for h, g in picked:
        reference_pairs.score(lowered.arrays, lowered.grid, int(h), int(g))
    each = (time.perf_counter() - begun) / len(picked)
    fast = statistics.median(times[1]) / max(1, np.count_nonzero(scores.reached))
    row("plain-loop reference, reached pair", f"{each:.3f} s; whole sweep / reached {fast:.2e} s")


def store_times(path: Path, repeats: int) -> None:
    """Measure the store file."""
    taken = []
    for _ in range(repeats):
        begun = time.perf_counter()
        load_scores(path)
        taken.append(time.perf_counter() - begun)
    measured("store file", f"{path.stat().st_size / 1e6:.2f} MB, loaded in {spread(taken)}")


def select_times(path: Path, seed: int) -> None:
    """Measure selection from random places of the robot."""
    tables = SelectionTables.of(load_scores(path))
    rng = np.random.default_rng(seed)
    taken = []
    for _ in range(PLACES):
        x, y, yaw = rng.uniform((-3.0, -3.0, -np.pi), (3.0, 3.0, np.pi))
        here = InitialConfiguration(base_x=x, base_y=y, base_yaw=yaw, torso=0.0)
        taken.append(select(tables, here).seconds)
    p50, p99 = np.quantile(taken, (0.5, 0.99))
    measured(
        f"select from {PLACES} places",
        f"p50 {1e3 * p50:.2f} ms, p99 {1e3 * p99:.2f} ms, max {1e3 * max(taken):.2f} ms",
    )


def process_times(task: str, path: Path, repeats: int) -> None:
    """Measure `tcs score` as a whole process, with machine code ready."""
    words = ["score", task, "--environment", "wheelchair", "--paper"]
    command = [sys.executable, "-m", "tcs", *words]
    taken = []
    for _ in range(repeats):
        begun = time.perf_counter()
        subprocess.run([*command, "--out", str(path), "--json"], check=True, capture_output=True)
        taken.append(time.perf_counter() - begun)
    measured("`tcs score`, whole process", spread(taken))
    # Linux counts in KiB.
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
    measured("peak memory of that process", f"{peak / 1e9:.2f} GB")


def verification(path: Path, options: argparse.Namespace) -> bool:
    """Re-check answers with Drake and the dense scan; return whether all are true."""
    begun = time.perf_counter()
    found = verify(load_scores(path), pairs=options.pairs, dense=options.dense, seed=options.seed)
    measured("verify", verification_text(found, time.perf_counter() - begun))
    return found.is_sound


if __name__ == "__main__":
    sys.exit(main())

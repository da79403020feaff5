"""Measure every row of the paper's Table I: scoring, sets, files, and the re-check of each.

Usage: python benchmarks/rows.py [--out DIR] [--pairs 500] [--dense 200] [--repeats 3]

`tcs score --all` runs once as a separate process, with machine code ready; bathing on the bed is
scored again a few times for its spread. The files are kept in DIR, if given, for
`benchmarks/selection.py`. This is a benchmark, not a test.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from table import cell, check_texts, header, parser, row, save, spread, verification_text

import tcs
from tcs.placement.scoring import load_job, sweep

LOADS = 5


def main() -> int:
    """Run every measurement and print it; return 1 if an answer is false."""
    command_line = parser(__doc__)
    command_line.add_argument("--out", type=Path)
    command_line.add_argument("--pairs", type=int, default=500)
    command_line.add_argument("--dense", type=int, default=200)
    command_line.add_argument("--repeats", type=int, default=3)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    bathing(options.repeats)
    with tempfile.TemporaryDirectory() as folder:
        rows = whole_process(options.out or Path(folder))
        loads(rows)
        sound = verification(rows, options)
    save(options)
    return 0 if sound else 1


def measured(name: str, text: str) -> None:
    """Print one measured value, and record it for the docs."""
    row(name, text)
    cell("summary", name, "measured", text)


def bathing(repeats: int) -> None:
    """Measure the scoring of bathing on the bed, all shifts of the person, on two threads."""
    job = load_job("bathing", "bed", "pr2", paper=True)
    lowered = job.lowered(job.scene())
    swept = [sweep(lowered, job.task.weights, tables=job.tables) for _ in range(repeats)]
    measured("bathing, bed: scoring_seconds", spread([s.scoring_seconds for s in swept]))


def whole_process(folder: Path) -> list[dict[str, object]]:
    """Measure `tcs score --all` as one process, and print its rows."""
    words = ["score", "--all", "--paper", "--out", str(folder), "--json"]
    command = [sys.executable, "-m", "tcs", *words]
    begun = time.perf_counter()
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    measured("tcs score --all, whole process", f"{time.perf_counter() - begun:.1f} s")
    # Linux counts in KiB.
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
    measured("peak memory of that process", f"{peak / 1e9:.2f} GB")
    rows: list[dict[str, object]] = json.loads(done.stdout)["rows"]
    for r in rows:
        one, best = r["best_single"], r["best"]
        row(
            f"{r['task']}, {r['environment']}",
            f"{r['configurations']} x {r['goals']}, reached {r['reached_pairs']}, "
            f"candidates {r['candidates']}, sets {r['sets']}, "
            f"one P_R {one['reachability']:.3f} P_M {one['manipulability']:.3f}, "
            f"set P_R {best['reachability']:.3f} P_M {best['manipulability']:.3f}, "
            f"scoring {r['scoring_seconds']:.2f} s, sets {r['sets_seconds']:.2f} s, "
            f"file {r['file_bytes'] / 1e6:.2f} MB",
        )
        for column, text in (
            ("configurations x goals", f"{r['configurations']:,} x {r['goals']}"),
            ("reached", f"{r['reached_pairs']:,}"),
            ("sets kept", f"{r['sets']:,}"),
            ("best single: P_R, P_M", scores_text(one)),
            ("best set: P_R, P_M", scores_text(best)),
            ("scoring [s]", f"{r['scoring_seconds']:.2f}"),
            ("sets [s]", f"{r['sets_seconds']:.2f}"),
            ("file [MB]", f"{r['file_bytes'] / 1e6:.2f}"),
        ):
            cell("rows", f"{r['task']}, {r['environment']}", column, text)
    return rows


def scores_text(found: dict[str, float]) -> str:
    """Return P_R and P_M of a set."""
    return f"{found['reachability']:.3f}, {found['manipulability']:.3f}"


def loads(rows: list[dict[str, object]]) -> None:
    """Measure how long the largest file takes to load, and all of its scores to decode."""
    path = Path(str(max(rows, key=lambda r: r["file_bytes"])["file"]))
    loading, decoding = [], []
    for _ in range(LOADS):
        begun = time.perf_counter()
        file = tcs.load(path)
        loading.append(time.perf_counter() - begun)
        begun = time.perf_counter()
        for table in file.tables:
            _ = table.scores
        decoding.append(time.perf_counter() - begun)
    measured("largest file", f"{path.name}, {path.stat().st_size / 1e6:.2f} MB")
    measured("loaded, ready for selection", spread(loading))
    measured("all its scores decoded", spread(decoding))


def verification(rows: list[dict[str, object]], options: argparse.Namespace) -> bool:
    """Re-check every row with Drake and the dense scan; return whether all answers are true."""
    sound = True
    for r in rows:
        begun = time.perf_counter()
        found = tcs.verify(
            tcs.load(str(r["file"])), pairs=options.pairs, dense=options.dense, seed=options.seed
        )
        text = verification_text(found, time.perf_counter() - begun)
        line = f"{r['task']}, {r['environment']}"
        row(f"verify {line}", text)
        for column, checked in check_texts(found).items():
            cell("checks", line, column, checked)
        sound &= found.is_sound
    return sound


if __name__ == "__main__":
    sys.exit(main())

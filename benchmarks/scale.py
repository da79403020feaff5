"""Measure what finer and finer grids cost: processor time, peak memory, disk, and later commands.

Usage: python benchmarks/scale.py [--grids 0.05/45/3 0.02/10/3 0.01/10/7] [--jobs 2]

Each grid of shaving in the wheelchair, STEP/DEGREES/TORSO HEIGHTS, is scored with blocks by a
process of its own; then the commands that read the file run, each in a process of its own. The last
grid of the default has 22.8 million configurations.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from table import cell, header, parser, row, save

CHECKOUT = Path(__file__).resolve().parents[1]
GRIDS = ("0.05/45/3", "0.02/10/3", "0.01/10/7")
SIDE = 3.0
"""Side of the square of base positions [m]."""
LIFT = 0.3
"""Range of torso heights [m]."""
HERE = ("--here", "1.4", "-1.2", "180")
COMMANDS = {
    "select": ("select", "{file}", *HERE),
    "explain": ("explain", "{file}", "--goal", "7", "--here", "1.1", "0.7", "180"),
    "map": ("map", "{file}", "--out", "map.png"),
    "evaluate": ("evaluate", "{file}", "--samples", "100"),
    "verify": ("verify", "{file}", "--pairs", "100", "--dense", "20"),
    "check": ("check", "{file}"),
}
ROBOT_ROWS = 13 * 12
"""Rows of Table I with each of twelve robots."""


@dataclass(frozen=True)
class Run:
    """What a process took.

    Attributes:
        result: What it printed with `--json`.
        seconds: Its processor time [s].
        peak: Its greatest memory [bytes], mapped scratch files included.
    """

    result: Any
    seconds: float
    peak: int


def run(words: list[str], folder: Path) -> Run:
    """Run a command of tcs and return what it took."""
    with (folder / "out.json").open("w+") as out:
        process = subprocess.Popen(
            [sys.executable, "-m", "tcs", *words, "--json"],
            stdout=out,
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(CHECKOUT), "TMPDIR": str(folder)},
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise SystemExit(f"tcs {' '.join(words)} ended with {process.returncode}")
        out.seek(0)
        return Run(json.load(out), used.ru_utime + used.ru_stime, 1024 * used.ru_maxrss)


def environment(folder: Path, grid: str) -> Path:
    """Write the wheelchair on a grid, given as STEP/DEGREES/TORSO HEIGHTS."""
    step, degrees, heights = (float(part) for part in grid.split("/"))
    along = {"unit": "m", "start": -SIDE / 2, "step": step, "count": round(SIDE / step) + 1}
    turn = {"unit": "deg", "start": 0, "step": degrees, "count": round(360 / degrees)}
    lift = {"unit": "m", "start": 0, "step": LIFT / (heights - 1), "count": int(heights)}
    axes = {"base_x": along, "base_y": along, "base_yaw": turn, "torso": lift}
    path = folder / "fine.yaml"
    content = {"based_on": "wheelchair", "name": "fine", "title": "A fine grid", "grid": axes}
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def main() -> None:
    """Score every grid, use its file, print and record the tables."""
    command_line = parser(__doc__)
    command_line.add_argument("--grids", nargs="+", default=GRIDS, metavar="STEP/DEGREES/HEIGHTS")
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    each = seconds = 0.0
    # Not where temporary files may be kept in memory, which is measured.
    out = CHECKOUT / "out"
    out.mkdir(exist_ok=True)
    for grid in options.grids:
        with tempfile.TemporaryDirectory(dir=out) as made:
            folder = Path(made)
            name, seconds = measured(folder, grid, options.jobs, each)
            each = each or seconds
            used(folder, name)
            shutil.rmtree(folder / "blocks")
    extrapolated(options.jobs * seconds)
    save(options)


def measured(folder: Path, grid: str, jobs: int, first: float) -> tuple[str, float]:
    """Score a grid, and again from its blocks; return its name and scoring time per configuration.

    Args:
        folder: Where files are written.
        grid: The grid.
        jobs: Number of threads.
        first: Scoring time of a configuration of the first grid [s]; 0 for that one.
    """
    words = ["score", "shaving", "--environment", str(environment(folder, grid))]
    words += ["--paper", "--jobs", str(jobs), "--blocks", "blocks", "--out", "fine.tcs"]
    scored = run(words, folder)
    again = run(words, folder)
    size = scored.result["configurations"]
    each = scored.result["scoring_seconds"] / size
    name = f"{size:,}"
    best = scored.result["best"]
    for column, text in {
        "processor time [s]": f"{scored.seconds:.0f}",
        "scoring [s]": f"{scored.result['scoring_seconds']:.1f}",
        "sets [s]": f"{scored.result['sets_seconds']:.1f}",
        "scoring of a configuration, times that of the first grid": f"{each / (first or each):.2f}",
        "peak memory [MB]": f"{scored.peak / 1e6:,.0f}",
        "again from blocks [s]": f"{again.seconds:.0f}",
        "file [MB]": f"{scored.result['file_bytes'] / 1e6:.1f}",
        "candidates": f"{scored.result['candidates']:,}",
        "best set, P_R + P_M": f"{best['reachability'] + best['manipulability']:.4f}",
    }.items():
        cell("grids", name, column, text)
        row(f"{name}: {column}", text)
    return name, each


def used(folder: Path, name: str) -> None:
    """Run the commands that read the file."""
    for command, words in COMMANDS.items():
        found = run([word.format(file="fine.tcs") for word in words], folder)
        text = f"{found.seconds:.1f} s, {found.peak / 1e6:,.0f} MB"
        cell("commands", command, f"{name} configurations", text)
        row(f"{name}: tcs {command}", text)


def extrapolated(each: float) -> None:
    """Record the cost of larger jobs at the time of one core for a configuration [s]."""
    paper, fine = 89_304, 22_831_452
    for name, configurations in {
        "the paper's grid, 13 rows, 12 robots, 20 bodies": paper * ROBOT_ROWS * 20,
        "the paper's grid, 13 rows, 12 robots, 1,000 bodies": paper * ROBOT_ROWS * 1000,
        "22.8 million configurations, 13 rows, 12 robots": fine * ROBOT_ROWS,
        "22.8 million configurations, 13 rows, 12 robots, 1,000 bodies": fine * ROBOT_ROWS * 1000,
    }.items():
        hours = configurations * each / 3600
        cell("extrapolated", name, "configurations", f"{configurations:.2g}")
        cell("extrapolated", name, "hours of one core", f"{hours:,.0f}")
        cell("extrapolated", name, "hours of 1,000 cores", f"{hours / 1000:,.2f}")


if __name__ == "__main__":
    main()

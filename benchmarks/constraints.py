"""Measure selection with constraints, obstacles, preferences and alternatives.

Usage: python benchmarks/constraints.py FILE [--places 300] [--seed 0]

FILE is a score file of an environment with the axes bed_height and head_rest, made by `tcs score`.
Times are processor times of the thread, from random base poses and states of the bed; the first
selection of each type, which prepares what later ones reuse, is measured apart. This is a
benchmark, not a test.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from table import cell, header, parser, row, save

from tcs.model.grid import InitialConfiguration
from tcs.placement.constraints import Constraints, Obstacle, Region
from tcs.placement.selection import PAPER_WEIGHTS, SelectionTables, Top, select
from tcs.placement.store import load_scores


def main() -> int:
    """Measure each type of selection and print it."""
    command_line = parser(__doc__)
    command_line.add_argument("file", type=Path, metavar="FILE")
    command_line.add_argument("--places", type=int, default=300)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    file = load_scores(options.file)
    for name, arguments in requests():
        # Each type starts with fresh tables, and decodes nothing that another has decoded.
        tables = SelectionTables.of(file)
        measure(tables, name, arguments, options)
    save(options)
    return 0


def requests() -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield names and arguments of the selections that are measured."""
    yield "eq. (5) alone", {"weights": PAPER_WEIGHTS}
    yield "with the default penalties", {}
    yield "`--only`", {"constraints": Constraints(only=("head_rest >= 35 deg",))}
    yield "`--keep`", {"constraints": Constraints(keep=("bed_height",))}
    region = Region.parse("0 -2, 2 -2, 2 -0.5, 0 -0.5")
    yield "`--forbid`, 2 m x 1.5 m", {"constraints": Constraints(forbid=(region,))}
    for size, text in (
        ("0.5 m x 0.5 m", "1 -1 0.5 0.5"),
        ("0.2 m x 0.2 m x 0.9 m", "1.9 0.9 0.2 0.2 0 0 0.9"),
    ):
        obstacle = Obstacle.parse(text)
        yield f"`--blocked`, {size}", {"constraints": Constraints(blocked=(obstacle,))}
    yield "`--prefer left`", {"constraints": Constraints(prefer=("left",))}
    yield "`--top 5`", {"top": Top(count=5)}


def measure(
    tables: SelectionTables, name: str, arguments: dict[str, Any], options: argparse.Namespace
) -> None:
    """Select from random states, and print and record the times."""
    rng = np.random.default_rng(options.seed)
    axes = tables.grid.environment_axes
    times = []
    for _ in range(options.places + 1):
        x, y, yaw = rng.uniform((-3.0, -3.0, -np.pi), (3.0, 3.0, np.pi))
        here = InitialConfiguration(
            base_x=x,
            base_y=y,
            base_yaw=yaw,
            torso=rng.uniform(0.0, 0.3),
            environment=tuple((axis.name, float(rng.choice(axis.values))) for axis in axes),
            environment_units=tuple(axis.held_unit for axis in axes),
        )
        begun = time.thread_time()
        select(tables, here, **arguments)
        times.append(1e3 * (time.thread_time() - begun))
    first, *later = times
    p50, p99 = np.quantile(later, (0.5, 0.99))
    row(name, f"first {first:.1f}, p50 {p50:.2f}, p99 {p99:.2f}, max {max(later):.2f} ms")
    for column, value in (
        ("first [ms]", f"{first:.1f}"),
        ("median [ms]", f"{p50:.2f}"),
        ("99th percentile [ms]", f"{p99:.2f}"),
        ("greatest [ms]", f"{max(later):.2f}"),
    ):
        cell("constraints", name, column, value)


if __name__ == "__main__":
    sys.exit(main())

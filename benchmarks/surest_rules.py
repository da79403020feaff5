"""Measure how the rules of the evaluation, and a third configuration, change the surest sets.

Usage: python benchmarks/surest_rules.py [--rows TASK/ENVIRONMENT ...] [--rules NAME ...]
           [--starts 4] [--rounds 12] [--searched 2000] [--samples 20000]

Rows of Table I in which the surest pair stays below the paper's print. Under each set of rules the
row is scored and its surest set is searched anew, `tcs refine --objective success`, and judged in
samples that no search has seen: under these rules, and under those of `tcs`. The rules:

- `tcs`: as `tcs evaluate`: collisions of the base with the furniture do not count.
- `original`: no collision of base, torso, head and other arm counts in a sample, as in
  hrl_base_selection in gt-ros-pkg/hrl-assistive (BSD), state of 30 April 2015. Without errors they
  count: the members stand free.
- `unpadded`: as `tcs`, with the person's shapes as they are, which skin protrudes from by up to
  16 mm: not safe, and no rule of either program.
- `arm`: as `tcs`, with the other arm straight out, as in the original program.
- `torso`: as `tcs`, with the torso up to its soft limit, 0.325 m; the grid of the paper ends at
  0.30 m.
- `three`: as `tcs`, with sets of three configurations, which the paper does not use.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from optimum import first_set, label
from surest_search import FIRST_SAMPLE, ROWS, points_of
from table import header, parser, record, row, save

import tcs
from tcs.kernel.arrays import FloatArray
from tcs.output.report import load_paper
from tcs.placement.robustness import PerturbedPoints, Trials

COLUMNS = (
    *("task, environment: rules", "paper, Table I (standard deviation)"),
    *("surest set (standard deviation)", "standard error", "samples with all goals"),
    *("at or above the paper", "configurations", "the same set by the rules of `tcs`", "samples"),
)


class Rules(NamedTuple):
    """Rules under which sets are searched and judged."""

    words: str
    """The rules in words."""
    body_collisions: str = "paper"
    """Collisions of the robot's body that count in a sample."""
    environment: str = ""
    """What differs in the environment file."""
    robot: str = ""
    """What differs in the robot file."""
    members: int = 2
    """Greatest number of members of a set."""


RULES = {
    "tcs": Rules("as `tcs`"),
    "original": Rules("no collisions of the body, as the original program", "none"),
    "unpadded": Rules("the person without padding", environment="padding: {}\n"),
    "arm": Rules("the other arm straight out", robot="posture: paper2015\n"),
    "torso": Rules(
        "torso up to 0.325 m",
        environment="""
grid:
  base_x: {unit: m, start: -1.5, step: 0.05, count: 61}
  base_y: {unit: m, start: -1.5, step: 0.05, count: 61}
  base_yaw: {unit: deg, start: 0, step: 45, count: 8}
  torso: {unit: m, start: 0, step: 0.1083, count: 4}
""",
    ),
    "three": Rules("three configurations", members=3),
}


class Judged(NamedTuple):
    """Success of a set, in percent."""

    mean: float
    std: float
    error: float
    """Standard error of the mean."""
    whole: float
    """Samples in which all goals are reached."""


def main() -> None:
    """Search and judge the sets and print a table."""
    command_line = parser(__doc__)
    command_line.add_argument("--rows", nargs="*", default=ROWS, metavar="TASK/ENVIRONMENT")
    command_line.add_argument("--rules", nargs="*", default=[*RULES], choices=[*RULES])
    command_line.add_argument("--starts", type=int, default=4)
    command_line.add_argument("--rounds", type=int, default=12)
    command_line.add_argument("--searched", type=int, default=2000)
    command_line.add_argument("--samples", type=int, default=20_000)
    options = command_line.parse_args()
    header()
    rows = []
    print(" | ".join(COLUMNS))
    with tempfile.TemporaryDirectory() as folder:
        for name in options.rows:
            for rules in options.rules:
                rows.append(measured(name, RULES[rules], Path(folder), options))
                print(" | ".join(rows[-1]), flush=True)
                record("rows", COLUMNS, rows)
                save(options, keep=True)
    row("rows", str(len(rows)))


def measured(name: str, rules: Rules, folder: Path, options: argparse.Namespace) -> list[str]:
    """Return the row of the table for a task and an environment under some rules."""
    task, environment = name.split("/")
    plain = tcs.score(task, environment, "pr2", jobs=1, max_members=rules.members)
    file = plain
    if rules.environment or rules.robot:
        place = written(folder / "environment.yaml", environment, rules.environment)
        robot = written(folder / "robot.yaml", "pr2", rules.robot)
        file = tcs.score(task, place, robot, jobs=1)
    refined = tcs.refine(
        file,
        objective="success",
        starts=options.starts,
        rounds=options.rounds,
        samples=options.searched,
        body_collisions=rules.body_collisions,
        jobs=1,
    )
    values = first_set(refined)
    found = judged(Trials.of(file, body_collisions=rules.body_collisions), values, options.samples)
    by_tcs = judged(Trials.of(plain), values, options.samples)
    published = load_paper().published(task, environment)
    assert published is not None
    return [
        f"{label(name)}: {rules.words}",
        f"{published.mean:.1f} ({published.std:.1f})",
        *(f"{found.mean:.2f} ({found.std:.1f})", f"{found.error:.2f}", f"{found.whole:.2f} %"),
        # The paper prints one decimal.
        "yes" if round(found.mean, 1) >= published.mean else "no",
        *(str(len(values)), f"{by_tcs.mean:.2f} ({by_tcs.std:.1f})", f"{options.samples:,}"),
    ]


def written(path: Path, based_on: str, text: str) -> Path:
    """Return the path of a model that differs from a shipped one."""
    path.write_text(f"based_on: {based_on}\nname: {path.stem}\n{text}", encoding="utf-8")
    return path


def judged(trials: Trials, values: FloatArray, samples: int) -> Judged:
    """Return the success of a set in fresh samples."""
    drawn = PerturbedPoints(trials, trials.errors.draw(samples, FIRST_SAMPLE), 1)
    found = np.logical_or.reduce(drawn.reached(points_of(values))) @ trials.weights
    return Judged(
        *(100.0 * found.mean(), 100.0 * found.std(), 100.0 * found.std() / np.sqrt(samples)),
        100.0 * float((found > 1.0 - 1e-9).mean()),
    )


if __name__ == "__main__":
    main()

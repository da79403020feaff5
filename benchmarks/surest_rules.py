"""Measure how the rules of the evaluation, and a third configuration, change the surest sets.

Usage: python benchmarks/surest_rules.py [--rows TASK/ENVIRONMENT ...] [--rules NAME ...]
           [--searched 500] [--samples 10000]

Rows of Table I in which the surest pair stays below the paper's print. Under each set of rules the
row is scored, with base positions 10 cm apart, all pairs of its configurations are compared in
samples of its own, and the surest is judged in others, under these rules and under those of `tcs`.
The differences between the rules are what counts: sets that are refined are surer under any. The
rules:

- `tcs`: as `tcs evaluate`: collisions of the base with the furniture do not count.
- `original`: no collision of base, torso, head and other arm counts in a sample, as in
  hrl_base_selection in gt-ros-pkg/hrl-assistive (BSD), state of 30 April 2015. Without errors they
  count: the members stand free.
- `unpadded`: as `original`, and skin may protrude from the person's shapes by up to 16 mm: not
  safe, and no rule of either program.
- `arm`: as `tcs`, with the other arm straight out, as in the original program.
- `torso`: as `tcs`, with the torso up to its soft limit, 0.325 m; the grid of the paper ends at
  0.30 m.
- `reach`: as `original`, and no posture of the arm touches anything: what reach and joint limits
  alone leave, where the robot's body stands free.
- `three`: as `tcs`, with the third configuration that recovers most of what a pair loses; the paper
  has sets of two.
- `refined`: as `three`, refined between the grid points by `tcs refine --objective success`.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from optimum import first_set, label
from surest_search import FIRST_SAMPLE, ROWS, points_of
from table import header, parser, record, row, save

import tcs
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.model.random_streams import named_generator
from tcs.placement.refinement.local_search import Space
from tcs.placement.refinement.points import PointScorer
from tcs.placement.refinement.surest import (
    StagedSamples,
    SurestSearch,
    surest_pairs,
    surest_triples,
)
from tcs.placement.robustness import PerturbedPoints, Trials
from tcs.placement.tables import Reason
from tcs_studies.output.report.robustness.paper import load_paper

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
    arm_collides: bool = True
    """Whether a goal is lost where every posture of the arm touches something."""
    environment: str = ""
    """What differs in the environment file."""
    robot: str = ""
    """What differs in the robot file."""
    torso_step: float = 0.15
    """Half of the greatest torso height [m]."""
    members: int = 2
    """Greatest number of members of a set."""
    is_refined: bool = False
    """Whether sets are refined between the grid points."""


RULES = {
    "tcs": Rules("as `tcs`"),
    "original": Rules("no collisions of the body, as the original program", "none"),
    "unpadded": Rules(
        "no collisions of the body, the person without padding", "none", environment="padding: {}\n"
    ),
    "arm": Rules("the other arm straight out", robot="posture: paper2015\n"),
    "torso": Rules("torso up to 0.325 m", torso_step=0.1625),
    "reach": Rules("no collisions of body and arm", "none", arm_collides=False),
    "three": Rules("three configurations", members=3),
    "refined": Rules("three configurations, refined", members=3, is_refined=True),
}
REFINED: dict[str, Any] = {"objective": "success", "starts": 2, "rounds": 8}
"""Options of the refinement."""
STREAM = "surest rules"
"""Name of the random stream of the samples in which sets are compared."""
PAIRS = 3
"""Pairs that get a third member."""
APART = 0.2
"""Distance of base positions [m] at which these differ."""
GRID = """grid:
  base_x: {{unit: m, start: -1.5, step: 0.1, count: 31}}
  base_y: {{unit: m, start: -1.5, step: 0.1, count: 31}}
  base_yaw: {{unit: deg, start: 0, step: 45, count: 8}}
  torso: {{unit: m, start: 0, step: {}, count: 3}}
"""
"""The paper's grid at every second base position."""


@dataclass(frozen=True, eq=False)
class WithinReach(PerturbedPoints):
    """Samples in which only reach and joint limits count, where the gripper is free."""

    def reached(self, points: FloatArray) -> BoolArray:
        """Return which goals are within reach of each configuration, shape (n, samples, G)."""
        return ~np.isin(self.reasons(points), (Reason.TOO_FAR, Reason.JOINT_LIMITS))


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
    command_line.add_argument("--searched", type=int, default=500)
    command_line.add_argument("--samples", type=int, default=10_000)
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
    text = GRID.format(rules.torso_step)
    place = written(folder / "environment.yaml", environment, text + rules.environment)
    robot = written(folder / "robot.yaml", "pr2", rules.robot)
    file = tcs.score(task, place, robot, max_members=rules.members, jobs=1, paper=True)
    trials = Trials.of(file, body_collisions=rules.body_collisions)
    of = PerturbedPoints if rules.arm_collides else WithinReach
    if rules.is_refined:
        values = first_set(tcs.refine(file, jobs=1, **REFINED))
    else:
        values = surest(of(trials, trials.errors.draw(options.searched, 0, stream=STREAM), 1))
    found = judged(of(trials, trials.errors.draw(options.samples, FIRST_SAMPLE), 1), values)
    by_tcs = found
    if rules.body_collisions != "paper" or rules.environment or rules.robot:
        plain = Trials.of(tcs.score(task, environment, "pr2", jobs=1, paper=True))
        drawn = PerturbedPoints(plain, plain.errors.draw(options.samples, FIRST_SAMPLE), 1)
        by_tcs = judged(drawn, values)
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


def surest(samples: PerturbedPoints) -> FloatArray:
    """Return the surest set of the grid, of as many members as the file has, shape (m, axes)."""
    file = samples.trials.file
    staged = StagedSamples.of(samples, samples.trials.weights)
    scorer = PointScorer.of(file, file.nominal_index, 1)
    space = Space.of(file.configurations, file.nominal.sets)
    search = SurestSearch.of(scorer, space, staged, named_generator(0, STREAM))
    pairs = surest_pairs(staged, search, file.nominal.sets, PAIRS, APART)
    sets = [*pairs, *surest_triples(staged, search, file.nominal.sets, pairs)]
    found = staged.successes([search.points_of(one) for one in sets], staged.stages - 1)
    return search.points_of(sets[int(np.argmax(found))]).values


def judged(samples: PerturbedPoints, values: FloatArray) -> Judged:
    """Return the success of a set in samples."""
    found = np.logical_or.reduce(samples.reached(points_of(values))) @ samples.trials.weights
    count = np.sqrt(samples.samples)
    return Judged(
        *(100.0 * found.mean(), 100.0 * found.std(), 100.0 * found.std() / count),
        100.0 * float((found > 1.0 - 1e-9).mean()),
    )


if __name__ == "__main__":
    main()

"""Goals that are reachable by construction: how many of them scoring misses, and by what measure.

Usage: python benchmarks/edges.py [--robots pr2 tiago iiwa7 panda] [--goals 400] [--windows 100]

Postures are drawn first, with one joint a given angle from singular or in a window of the free
joint a given width, in the wheelchair's environment with shapes added about the robot; see
`tests.reference.constructed`. A goal is missed if it is not reached. The shortfall counts
goals at which the stored measure is more than 1e-3 below that of the posture that made the goal.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator

import numpy as np
from table import header, parser, record, row, save

from tcs.kernel.scores import REACHED
from tcs.kernel.verification.plain_dexterity import isotropy
from tcs.placement.scoring import load_job
from tcs.placement.tables import Reason
from tests.reference.constructed import (
    ELBOW,
    SHOULDER,
    WRIST,
    Constructed,
    between_contacts,
    between_limits,
    near_singular_goals,
)
from tests.reference.kinematics import jacobian

AWAY = (0.1, 0.06, 0.01, 0.003, 1e-3, 1e-4, 0.0)
"""How far a joint is from singular [rad]."""
JOINTS = {
    "joint 2 near singular": SHOULDER,
    "joint 4 near singular": ELBOW,
    "joint 6 near singular": WRIST,
}
WINDOWS = {"window between limits": between_limits, "window between contacts": between_contacts}
WIDTHS = (0.01, 0.003, 0.001)
"""Widths of windows [rad of the free joint]."""
BATCH = 50
"""Goals at one configuration, among the same shapes."""
SHORT = 1e-3


def main() -> int:
    """Measure every stratum and print it; the exit code is 1 if a goal was missed."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", nargs="+", default=["pr2", "tiago", "iiwa7", "panda"])
    command_line.add_argument("--goals", type=int, default=400)
    command_line.add_argument("--windows", type=int, default=100)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    missed, rows = 0, []
    for robot in options.robots:
        sums = {group: np.zeros(3, int) for group in (*JOINTS, *WINDOWS)}
        for group, name, goals in strata(robot, options):
            reasons, short, total, most = counted(goals)
            if not total:
                continue
            lost = total - reasons.get("reached", 0)
            missed += lost
            text = ", ".join(f"{k} {n}" for k, n in reasons.items() if k != "reached")
            row(
                f"{robot}: {group}, {name}",
                f"missed {lost} of {total}{f' ({text})' if text else ''}, "
                f"measure short {short} (most {most:.3f})",
            )
            sums[group] += lost, short, total
        for group, (lost, short, total) in sums.items():
            if total:
                rows.append([robot, group, str(total), str(lost), str(short)])
    columns = ["robot", "goals", "number", "missed", "measure short by more than 1e-3"]
    record("edges", columns, rows)
    save(options)
    return int(missed > 0)


def strata(
    robot: str, options: argparse.Namespace
) -> Iterator[tuple[str, str, Iterator[Constructed | None]]]:
    """Return group, name and goals of the strata of one robot."""
    job = load_job("shaving", "wheelchair", robot, paper=True)
    lowered = job.lowered(job.scene())
    scene, grid = lowered.arrays, lowered.grid
    for name, joint in JOINTS.items():
        for away in AWAY:
            rng = np.random.default_rng([options.seed, joint, round(1e4 * away)])
            batches = (
                near_singular_goals(rng, scene, grid, joint, away, min(BATCH, options.goals))
                for _ in range(0, options.goals, BATCH)
            )
            yield name, f"{away:g} rad", batches
    for name, make in WINDOWS.items():
        for width in WIDTHS:
            rng = np.random.default_rng([options.seed, round(1e4 * width)])
            tries = (make(rng, scene, grid, width) for _ in range(20 * options.windows))
            yield name, f"{width:g} rad", first(tries, options.windows)


def first(tries: Iterator[Constructed | None], count: int) -> Iterator[Constructed]:
    """Return the first tries that succeed."""
    for made in tries:
        if made is not None and count:
            count -= 1
            yield made
        if not count:
            return


def counted(goals: Iterator[Constructed | None]) -> tuple[Counter[str], int, int, float]:
    """Return reasons, how many measures fall short, the number of goals and the worst shortfall."""
    reasons: Counter[str] = Counter()
    short, total, most = 0, 0, 0.0
    for made in goals:
        if made is None:
            break
        scores, chain = made.scores(), made.scene.chain
        for g, q in enumerate(made.postures):
            reason = int(scores.reason[0, g])
            reasons[Reason(reason).name.lower()] += 1
            total += 1
            if reason == REACHED:
                gap = isotropy(jacobian(chain, q)) - float(scores.dexterity[0, g])
                short += gap > SHORT
                most = max(most, gap)
    return reasons, short, total, most


if __name__ == "__main__":
    sys.exit(main())

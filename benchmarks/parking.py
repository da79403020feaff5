"""Parking windows: time to find them, and random base poses inside them that miss a goal.

Usage: python benchmarks/parking.py FILE [FILE ...] [--poses 1000000] [--drake 30]

Of each score file the recommended set is taken, and the one that may be off by 5 cm, 5 cm and 3
degrees. Random base poses inside each window are scored as the grid was; some are judged by Drake.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from table import cell, header, parser, row, save

import tcs
from tcs.errors import SelectionError
from tcs.placement import selection
from tcs.placement.parking.stop import BASE
from tcs.placement.refinement import PointScorer
from tcs.placement.scoring.drake_check import DrakeChecker
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.tables import WindowTable, window_text

LEAST = (0.05, 0.05, 3.0)
BATCH = 4096
"""Poses that are scored together."""


def main() -> int:
    """Measure every file."""
    command_line = parser(__doc__)
    command_line.add_argument("files", nargs="+", metavar="FILE")
    command_line.add_argument("--poses", type=int, default=1_000_000)
    command_line.add_argument("--drake", type=int, default=30)
    command_line.add_argument("--jobs", type=int, default=2)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    row("poses, seed", f"{options.poses:,}, {options.seed}")
    for path in options.files:
        measure(path, options.poses, options.drake, options.jobs, options.seed)
    save(options)
    return 0


def measure(path: str, poses: int, drake: int, jobs: int, seed: int) -> None:
    """Measure one file."""
    name = path.rsplit("/", 1)[-1].removesuffix(".tcs")
    # The first windows of a process load the machine code.
    tcs.select(tcs.load(path), parking=(0.0, 0.0, 0.0))
    for what, parking in (("recommended", (0.0, 0.0, 0.0)), ("5 cm, 5 cm, 3 deg", LEAST)):
        file = tcs.load(path)
        begun, used = time.perf_counter(), time.process_time()
        try:
            choice = tcs.select(file, parking=parking)
        except SelectionError as error:
            row(f"{name}, {what}", str(error))
            continue
        seconds, used = time.perf_counter() - begun, time.process_time() - used
        begun = time.perf_counter()
        again = selection.select(file, parking=parking)
        known = time.perf_counter() - begun
        assert again.indices == choice.indices
        line = f"{name}, {what}"
        cell("time", line, "time [s]", f"{seconds:.1f}")
        cell("time", line, "processor time [s]", f"{used:.1f}")
        cell("time", line, "known windows [ms]", f"{1e3 * known:.0f}")
        cell("time", line, "sets looked at", f"{choice.parking.sets}" if choice.parking else "")
        cell("time", line, "P_R", f"{choice.reachability:.3f}")
        cell("time", line, "P_M", f"{choice.manipulability:.3f}")
        row(line, f"{seconds:.2f} s, processor time {used:.2f} s, again {1e3 * known:.0f} ms")
        table = file.tables[file.nominal_index].known_windows
        assert table is not None, "windows were found"
        scorer = PointScorer.of(file, file.nominal_index, jobs)
        for i in choice.order:
            window = choice.windows[i]
            if window is not None and min(window) > 0.0:
                values = choice_values(file, choice, i)
                goals = goals_of(table, values, window)
                off = window_text(window.to_json())
                inside(f"{line}, stop {i + 1}", off, scorer, file, values, goals, window, poses,
                       drake, seed)  # fmt: skip


def choice_values(file: tcs.ScoreFile, choice: tcs.Choice, member: int) -> np.ndarray:
    """Return the values of the grid's axes of a member [m or rad]."""
    at = choice.members[member]
    known = {name: getattr(at, name) for name in ("base_x", "base_y", "base_yaw", "torso")}
    known |= dict(at.environment)
    return np.array([known[axis.name] for axis in file.configurations.axes])


def goals_of(table: WindowTable, values: np.ndarray, window: tuple[float, ...]) -> np.ndarray:
    """Return the numbers of the goals that a window is about."""
    same = np.all(np.abs(table.values - values) < 1e-9, axis=1) & table.held
    same &= np.all(np.abs(table.half - np.array(window)) < 1e-12, axis=1)
    return np.flatnonzero(table.goals[same].any(axis=0))


def inside(line, off, scorer, file, values, goals, window, poses, drake, seed) -> None:
    """Score random base poses inside a window, and judge some with Drake."""
    rng, missed, false = np.random.default_rng(seed), 0, 0
    for done in range(0, poses, BATCH):
        count = min(BATCH, poses - done)
        points = np.repeat(values[None], count, axis=0)
        points[:, BASE] += rng.uniform(-1.0, 1.0, (count, 3)) * np.array(window)
        found = scorer.score(points)
        missed += int(np.count_nonzero(~found.reached[:, goals].all(axis=1)))
        if done == 0:
            false = false_by_drake(file, points[:drake], found, goals)
    cell("inside", line, "may be", off)
    cell("inside", line, "goals", f"{len(goals)}")
    cell("inside", line, "random base poses", f"{poses:,}")
    cell("inside", line, "that miss a goal", f"{missed:,}")
    cell(
        "inside", line, "false (Drake), of the postures judged", f"{false} of {drake * len(goals)}"
    )
    row(line, f"{off}: {missed} of {poses:,} poses miss a goal, {false} false by Drake")


def false_by_drake(file, points, found, goals) -> int:
    """Return how many postures at goals Drake finds in contact, or off their goal."""
    built, false = rebuild_scenes(file), 0
    checkers = [DrakeChecker(job, scene, file.metadata["measure"]) for job, scene, _ in built]
    names = [axis.name for axis in file.configurations.axes]
    observed = file.observed_states[file.nominal_index]
    for n, values in enumerate(points):
        at = {**observed, **dict(zip(names, values.tolist(), strict=True))}
        for goal in goals.tolist():
            hand = int(found.hand[n, goal])
            q = found.joints[n, goal].astype(np.float64)
            of_hand = file.goals_of_hands[hand].index(goal)
            finding = checkers[hand].check_at(at, of_hand, q, float(found.dexterity[n, goal]))
            false += not finding.is_true
    return false


if __name__ == "__main__":
    sys.exit(main())

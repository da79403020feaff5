"""Cost of the sweep: threads, grid size, its parts, and Drake's collision checks as a bound."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
from peer_drake import WinnersChecker
from peer_problems import Bench, Pair
from sample_costs import measure_fractions
from table import cell, row, spread

from tcs.kernel.arrays import FloatArray, GridArrays, IntArray
from tcs.kernel.problem import UNCHECKED, Problem
from tcs.kernel.rows import grid_rows
from tcs.kernel.sweep import score
from tcs.placement.scoring import sweep
from tcs.placement.scoring.engines import SLICE
from tcs.placement.tables import Reason

GRID_PARTS = (8, 4, 2, 1)
"""Strides over the base x of the grid."""
EVERY = 4
"""Stride over the slices of the grid that the parts are timed on."""
SERIES = ("1", "2", "cpu", "floor", "floor cpu", "overlaps")
ARM_GAPS = ("environment", "body", "arm")


def sweep_costs(bench: Bench, repeats: int) -> None:
    """Print times of scoring on one and two threads, and of Drake's checks of the best postures."""
    weights, pairs = bench.job.task.weights, bench.scores.reason.size
    checker = WinnersChecker(bench.lowered)
    winners = _winners(bench, checker)
    taken: dict[str, list[float]] = {name: [] for name in SERIES}
    checked, overlapping = checker.check(winners), 0
    for _ in range(repeats):
        taken["1"].append(sweep(bench.lowered, weights, jobs=1).scoring_seconds)
        used = time.process_time()
        taken["2"].append(sweep(bench.lowered, weights, jobs=2).scoring_seconds)
        taken["cpu"].append(time.process_time() - used)
        checked = checker.check(winners)
        taken["floor"].append(checked.seconds)
        taken["floor cpu"].append(checked.processor_seconds)
        seconds, overlapping = checker.overlaps(winners)
        taken["overlaps"].append(seconds)
    for jobs in ("1", "2"):
        rate = pairs / float(np.median(taken[jobs]))
        _measured(f"whole sweep, jobs {jobs}", f"{spread(taken[jobs])}, {rate:.3g} pairs a second")
    _measured("  whole sweep, jobs 2, processor time", spread(taken["cpu"]))
    _measured("thread scaling 1 -> 2", _ratio(taken["1"], taken["2"]))
    _measured(
        "floor: each winner checked once", f"{spread(taken['floor'])}, {len(winners)} winners"
    )
    _measured("  floor, processor time", spread(taken["floor cpu"]))
    _measured(
        "  floor: checker's contexts; winners hit", f"{checked.contexts}; {checked.colliding}"
    )
    _measured(
        "  floor: overlap or not, processor time", f"{spread(taken['overlaps'])}, {overlapping} hit"
    )
    _measured("floor / sweep, both on 2 threads", _ratio(taken["floor"], taken["2"]))
    _measured("  floor / sweep, by processor time", _ratio(taken["floor cpu"], taken["cpu"]))


def grid_costs(bench: Bench, repeats: int) -> None:
    """Print the cost of a configuration on parts of the grid, constant if the cost is linear."""
    size = len(bench.scores.reason)
    each: dict[int, list[float]] = {part: [] for part in GRID_PARTS}
    count = dict.fromkeys(GRID_PARTS, size)
    for _ in range(repeats):
        for part in GRID_PARTS:
            grid = bench.lowered.grid._replace(base_x=bench.lowered.grid.base_x[::part])
            lowered = dataclasses.replace(bench.lowered, grid=grid)
            swept = sweep(lowered, bench.job.task.weights, jobs=1)
            count[part] = len(swept.tables[0].reason)
            each[part].append(swept.scoring_seconds / count[part])
    for part in GRID_PARTS:
        text = f"{count[part]} configurations, each {spread(each[part], 'us', 1e6)}"
        _measured(f"1/{part} of the grid, jobs 1", text)


def part_costs(bench: Bench, pairs: tuple[Pair, ...], repeats: int) -> None:
    """Print how the kernel's time divides, found by leaving out parts of the work.

    The sweep itself runs on altered data: without goals only the base is checked; with an elbow
    that spans no distance the reach test excludes every goal; with no shape of the arm to check
    there is no collision. The differences are the parts. `sample_costs` separates inverse
    kinematics from the measure.
    """
    problem = bench.problem
    no_reach = problem.arm._replace(elbow_cos=np.array([-np.inf, -np.inf]))
    no_gaps = {
        name: np.full_like(getattr(problem.clearances, name), UNCHECKED) for name in ARM_GAPS
    }
    without_goals = problem.at_poses(problem.goals.R[:, :0], problem.goals.p[:, :0])
    without_gaps = problem._replace(clearances=problem.clearances._replace(**no_gaps))
    stages = {
        "base": (without_goals, bench.grippers[:, :0].copy()),
        "reach": (problem._replace(arm=no_reach), bench.grippers),
        "solved": (without_gaps, bench.grippers),
        "all": (problem, bench.grippers),
    }
    taken: dict[str, list[float]] = {name: [] for name in stages}
    for _ in range(repeats):
        for name, (stage, grippers) in stages.items():
            taken[name].append(_processor_seconds(stage, grippers, bench.lowered.grid))
    base, reach, solved, whole = (np.array(taken[name]) for name in stages)
    _measured(f"kernel on 1/{EVERY} of the grid, jobs 1", f"{spread(list(whole))}, of which")
    _part("base check", base / whole)
    _part("prefilter: too far", (reach - base) / whole)
    shares = np.array(measure_fractions(problem.arm, pairs, repeats))
    _part("inverse kinematics", (solved - reach) / whole * (1.0 - shares))
    _part("measure", (solved - reach) / whole * shares)
    _part("collision of arm and gripper", (whole - solved) / whole)


def _winners(bench: Bench, checker: WinnersChecker) -> FloatArray:
    """Return the checker's configurations of all reached pairs."""
    h, _ = np.nonzero(bench.scores.reason == Reason.REACHED)
    at = bench.job.scored_grid.values(h)
    base = np.stack([at["base_x"], at["base_y"], at["base_yaw"]], axis=1)
    arm = bench.scores.arm_joints.astype(np.float64)
    return checker.configurations(base, h % bench.lowered.grid.torso_levels, arm)


def _processor_seconds(problem: Problem, grippers: IntArray, grid: GridArrays) -> float:
    """Return the processor time of every EVERY-th slice of the grid."""
    used = 0.0
    for start in range(0, grid.size, EVERY * SLICE):
        rows = grid_rows(grid, start, min(start + SLICE, grid.size))
        begun = time.process_time()
        score(problem, rows, grippers)
        used += time.process_time() - begun
    return used


def _part(name: str, shares: FloatArray) -> None:
    _measured(f"  of it {name}", spread(list(100.0 * shares), "%"))


def _measured(name: str, text: str) -> None:
    """Print one measured value, and record it for the docs."""
    row(name, text)
    cell("sweep", name.strip(), "measured", text)


def _ratio(first: list[float], second: list[float]) -> str:
    return spread([a / b for a, b in zip(first, second, strict=True)], "x")

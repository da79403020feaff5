"""Measure capability maps: computation, merging and accuracy.

Usage: python benchmarks/capability.py [--repeats 5] [--queries 40000] [--jobs 2]
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from itcm_task import TORSO_HEIGHT, the_task
from table import cell, header, parser, row, save, spread

from tcs.capability import (
    CapabilityMap,
    MapGrid,
    MapVolume,
    Reach,
    check_map,
    map_from_ik,
    merge,
)
from tcs.model.robots import load_robot
from tcs_studies.simulated_recording import HandMotion, simulate_recording


def main() -> None:
    """Run every measurement and print it."""
    command_line = parser(__doc__)
    command_line.add_argument("--repeats", type=int, default=5)
    command_line.add_argument("--queries", type=int, default=40_000)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    reach = Reach(load_robot("tiago"), torso_height=TORSO_HEIGHT)
    compile_first(reach)
    ihcm = making(reach, options.jobs)
    merging(ihcm, options.repeats)
    inverting(reach, options.repeats)
    accuracy(reach, options.queries, options.jobs)
    save(options)


def compile_first(reach: Reach) -> None:
    """Run all compiled functions once, so that no time below includes compilation."""
    reach.free_torso_heights(np.zeros((1, 7)))
    reach.manipulability(np.zeros((1, 7)))
    simulate_recording(reach, HandMotion(seconds=1.0))


def timed(run: Callable[[], object]) -> tuple[float, float]:
    """Return wall and processor time of a call [s]."""
    wall, cpu = time.perf_counter(), time.process_time()
    run()
    return time.perf_counter() - wall, time.process_time() - cpu


def making(reach: Reach, jobs: int) -> CapabilityMap:
    """Measure an IHCM with side and top grasps, 5 cm and pi/8, and return the complete map."""
    for radius in (0.9, reach.length):
        begun = time.perf_counter(), time.process_time()
        found = map_from_ik(reach, MapGrid.of(), radius=radius, jobs=jobs)
        wall, cpu = time.perf_counter() - begun[0], time.process_time() - begun[1]
        cells = f"{found.metadata['cells_considered']:,} cells, {len(found.cells):,} reached"
        time_text = f"{wall:.1f} s on {jobs} threads, {cpu:.1f} s of the processor; {cells}"
        row(f"IHCM, radius {radius:.2f} m", time_text)
        cell(
            "times",
            f"IHCM, side and top grasps, 5 cm, pi/8, radius {radius:.2f} m",
            "time",
            time_text,
        )
    return found


def merging(ihcm: CapabilityMap, repeats: int) -> None:
    """Measure the merge of twelve tool poses, all torso heights and one."""
    task = the_task(1)
    volume = MapVolume(ihcm)
    first = spread_ms([timed(lambda: merge(MapVolume(ihcm), task))[0] for _ in range(repeats)])
    row("merge, first task of a map", first)
    cell("times", "the first merge of a map", "time", first)
    for torso_height, name in ((None, "any torso height"), (TORSO_HEIGHT, "one torso height")):
        wall = [
            timed(lambda torso_height=torso_height: merge(volume, task, torso_height=torso_height))[
                0
            ]
            for _ in range(repeats)
        ]
        row(f"merge, {name}", spread_ms(wall))
        cell(
            "times",
            f"merge of the pick-and-place task, 12 tool poses, {name}",
            "time",
            spread_ms(wall),
        )


def inverting(reach: Reach, repeats: int) -> None:
    """Measure 800 grasps inverted to cells: forward kinematics, inversion, nearest cells."""
    lower, upper = reach.limits
    joints = np.random.default_rng(0).uniform(lower, upper, (800, 7))
    for grasps in ("side+top", "all"):
        grid = MapGrid.of(grasps=grasps)

        def invert(grid: MapGrid = grid) -> None:
            R_AT, p_AT = reach.tool_poses(joints)
            grid.nearest(reach.R_BA @ R_AT, p_AT @ reach.R_BA.T + reach.p_BA)

        time_text = spread_ms([timed(invert)[0] for _ in range(repeats)])
        row(f"800 grasps inverted, {grasps}", time_text)
        cell("times", f"800 grasps inverted to cells, {grasps}", "time", time_text)


def accuracy(reach: Reach, queries: int, jobs: int) -> None:
    """Measure the accuracy of maps of two grids."""
    print("\nmap compared with inverse kinematics, fractions of all queries [%]")
    print(f"{'grasps':<7} {'grid':<16} radius  reach. accur. false+ false-  recall precision")
    for step, yaw_bins, radius in (
        (0.05, 16, 0.9),
        (0.05, 16, None),
        (0.025, 32, 0.9),
        (0.025, 32, None),
    ):
        for grasps in ("side", "top", "all"):
            grid = MapGrid.of(step, yaw_bins, grasps)
            found = check_map(reach, grid, grasps, radius=radius, queries=queries, jobs=jobs)
            fractions = (
                found.reachable, found.accuracy, found.false_positives, found.false_negatives,
                found.recall, found.precision,
            )  # fmt: skip
            numbers = " ".join(f"{100 * value:6.2f}" for value in fractions)
            grid_text = f"{step:g} m, {360 / yaw_bins:g} deg  {radius or reach.length:.2f}"
            print(f"{grasps:<7} {grid_text}  {numbers}")
            names = (
                "reachable",
                "accuracy",
                "false positives",
                "false negatives",
                "recall",
                "precision",
            )
            for name, value in zip(names, fractions, strict=True):
                line = f"{grasps}, {grid_text.replace('  ', ', radius ')} m"
                cell("accuracy", line, f"{name} [%]", f"{100 * value:.1f}")


def spread_ms(seconds: list[float]) -> str:
    """Return a spread in milliseconds."""
    return spread(seconds, "ms", 1e3)


if __name__ == "__main__":
    main()

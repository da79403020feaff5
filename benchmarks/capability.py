"""Measure capability maps: computation, merging, accuracy, and the task of the ITCM thesis.

Usage: python benchmarks/capability.py [--repeats 5] [--queries 40000] [--seeds 3] [--pictures DIR]

The last part is the pick-and-place task of the ITCM thesis on TIAGo: two positions 15 cm apart at
0.41 m, three side grasps each with a pre-grasp 5 cm before it, the shoulder at 0.91 m. Recordings
are simulated: a long one with seed 0, and short ones with several seeds.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from table import cell, header, parser, record, row, save, spread

from tcs.capability import (
    BasePose,
    CapabilityMap,
    GraspTask,
    MapGrid,
    MapVolume,
    Reach,
    TaskMap,
    check_map,
    map_from_ik,
    map_from_recording,
    merge,
    pick_and_place_task,
)
from tcs.capability.surroundings import Surroundings
from tcs.errors import SelectionError
from tcs.model.robots import load_robot
from tcs.model.scene import EnvironmentFile
from tcs.output.draw import save_figure
from tcs.output.draw.capability_maps import task_figure
from tcs.teleop.simulated_recording import HandMotion, simulate_recording

TORSO_HEIGHT = 0.1725
"""Torso height with the shoulder of TIAGo at 0.91 m."""
HEIGHT = 0.41
# ITCM thesis, Table 1: the task in the frame of the robot, x, y [m] and rotation [deg].
HIGH, EXPERT, LOW = (0.75, 0.15, 0.0), (0.88, 0.20, 2.9), (0.55, -0.45, -90.0)
COLUMNS = (
    "base poses",
    "best: x, y, yaw, score",
    "best feasible with the table",
    "from it to ITCM-high, Expert [m]",
    "percentage with a lower score than ITCM-high, Expert, ITCM-low",
    "best score at yaw 0",
    "worst",
)
"""Headings of the table of task maps."""
SHORT = 400.0
"""Duration of a short recording [s]."""
# ITCM thesis, Table 3: from the recorded pose to the cell, mean (standard deviation).
TABLE_3 = {
    "x": "0.0112 (0.0078)", "y": "0.0109 (0.0079)", "z": "0.0100 (0.0070)",
    "roll": "0.0107 (0.0253)", "pitch": "0.0129 (0.0167)", "yaw": "0.0604 (0.0649)",
}  # fmt: skip


def main() -> None:
    """Run every measurement and print it."""
    command_line = parser(__doc__)
    command_line.add_argument("--repeats", type=int, default=5)
    command_line.add_argument("--queries", type=int, default=40_000)
    command_line.add_argument("--seeds", type=int, default=3, help="of short recordings")
    command_line.add_argument("--jobs", type=int, default=2)
    command_line.add_argument("--pictures", type=Path)
    options = command_line.parse_args()
    header()
    reach = Reach(load_robot("tiago"), torso_height=TORSO_HEIGHT)
    compile_first(reach)
    ihcm = making(reach, options.jobs)
    merging(ihcm, options.repeats)
    inverting(reach, options.repeats)
    accuracy(reach, options.queries, options.jobs)
    thesis_task(reach, ihcm, options.seeds, options.pictures)
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


def thesis_task(reach: Reach, ihcm: CapabilityMap, seeds: int, pictures: Path | None) -> None:
    """Compare the pick-and-place task of the thesis with its published base poses."""
    maps = []
    for name, seconds, seed in (
        ("ITCM, long recording, seed 0", HandMotion().seconds, 0),
        *((f"ITCM, short recording, seed {seed}", SHORT, seed) for seed in range(seeds)),
    ):
        motion = HandMotion(height=HEIGHT, seconds=seconds)
        taken = time.process_time()
        simulated = simulate_recording(reach, motion, seed=seed)
        taken = time.process_time() - taken
        grid = MapGrid.of(grasps="side")
        recorded = map_from_recording(reach, grid, simulated.recording, height=HEIGHT)
        row(name, f"{len(recorded.capability.cells):,} cells")
        for line, text in (
            ("duration [min]", f"{seconds / 60.0:.1f}"),
            ("samples", f"{len(simulated.recording.joints):,}"),
            (
                "stopped before a contact, or going back [%]",
                f"{100 * simulated.stopped.mean():.0f}",
            ),
            ("processor time [s]", f"{taken:.0f}"),
        ):
            row(f"  {line}", text)
            cell("recordings", name.removeprefix("ITCM, "), line, text)
        maps.append((name, recorded.capability))
        if len(maps) == 1:
            print("\nTable 3: from the recorded pose to the cell, mean (std)")
            for axis, error in recorded.error_table().items():
                here = f"{error['mean']:.4f} ({error['std']:.4f})"
                print(f"  {axis:<6} {here}")
                unit = "m" if axis in ("x", "y", "z") else "rad"
                cell("table_3", "here", f"{axis} [{unit}]", here)
                cell("table_3", "thesis", f"{axis} [{unit}]", TABLE_3[axis])
    maps.append(("IHCM", ihcm))
    around = Surroundings(reach.robot, table())
    for direction, side in ((1, "left"), (3, "right")):
        print(f"\npick and place, to the {side} along the edge: x, y [m], yaw [deg] of the")
        print("base in the task frame, score:")
        rows = []
        for name, capability in maps:
            try:
                found = merge(
                    capability, the_task(direction), scale="thesis", torso_height=TORSO_HEIGHT
                )
            except SelectionError:
                # No base pose of this map reaches both positions.
                rows.append({"map": name, **dict.fromkeys(COLUMNS, "–"), COLUMNS[0]: "0"})
                continue
            cells = {"map": name, **dict(zip(COLUMNS, described(found, around), strict=True))}
            print("  " + " | ".join(f"{column}: {text}" for column, text in cells.items()))
            rows.append(cells)
        record(f"thesis_{side}", list(rows[0]), [list(cells.values()) for cells in rows])
    if pictures is not None:
        pair = (maps[-1][1], maps[0][1])
        for direction in (1, 3):
            merged = [
                merge(m, the_task(direction), scale="thesis", torso_height=TORSO_HEIGHT)
                for m in pair
            ]
            side = "" if direction == 1 else "-right"
            save_figure(pictures / f"capability{side}.png", task_figure(*merged))


def the_task(direction: int) -> GraspTask:
    """Return the task of the thesis, its second position to the left (1) or to the right (3)."""
    return pick_and_place_task(0.15, HEIGHT, pre_grasps=(0.05,), direction=direction)


def table() -> EnvironmentFile:
    """Return the table of the thesis: 37 cm high, 75.5 cm wide, its edge 10 cm before the cup."""
    axes = {
        name: {"unit": unit, "start": 0.0, "step": 0.0, "count": 1}
        for name, unit in (("base_x", "m"), ("base_y", "m"), ("base_yaw", "deg"), ("torso", "m"))
    }
    box = {"name": "table", "box": [0.6, 0.755, 0.37], "xyz": [0.2, 0.0, 0.185]}
    return EnvironmentFile(
        name="table", title="A table", origin="Under the cup", source="ITCM thesis, III.B",
        grid=axes, obstacles=[box],
    )  # fmt: skip


def base_of(task: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return the base in the task frame, from the task in the frame of the robot; yaw [rad]."""
    x, y, yaw = task[0], task[1], math.radians(task[2])
    c, s = math.cos(yaw), math.sin(yaw)
    return -(c * x + s * y), s * x - c * y, -yaw


def described(found: TaskMap, around: Surroundings) -> tuple[str, ...]:
    """Return what the docs say about a task map, in the order of `COLUMNS`."""
    poses = found.base_poses
    best, (feasible, _) = found.best(), around.best(found)
    front = poses[np.abs(poses[:, 2]) < 0.01]
    distances = [
        f"{math.hypot(feasible.x - base_of(other)[0], feasible.y - base_of(other)[1]):.2f}"
        for other in (HIGH, EXPERT)
    ]
    ranks = [quantile(poses, base_of(other), found) for other in (HIGH, EXPERT, LOW)]
    return (
        f"{len(poses):,}",
        brief(best),
        brief(feasible),
        ", ".join(distances),
        ", ".join(ranks),
        f"{front[:, 4].max():.2f}" if len(front) else "none",
        brief(found.worst()),
    )


def brief(base: BasePose) -> str:
    """Return a base pose and its score."""
    yaw = math.degrees(base.yaw)
    return f"{base.x:.2f}, {base.y:.2f}, {yaw:.1f}, {base.score:.2f}"


def quantile(poses: np.ndarray, base: tuple[float, float, float], found: TaskMap) -> str:
    """Return the percentage of base poses that score less than the cell nearest to one."""
    step, yaw_step = found.grid.step, found.grid.yaw_step
    near = (np.abs(poses[:, 0] - base[0]) <= step / 2 + 1e-9) & (
        np.abs(poses[:, 1] - base[1]) <= step / 2 + 1e-9
    )
    yaw_difference = (poses[:, 2] - base[2] + math.pi) % (2 * math.pi) - math.pi
    rows = np.flatnonzero(near & (np.abs(yaw_difference) <= yaw_step / 2 + 1e-9))
    if not len(rows):
        return "not in the map"
    return f"{100.0 * (poses[:, 4] < poses[rows[0], 4]).mean():.0f}"


def spread_ms(seconds: list[float]) -> str:
    """Return a spread in milliseconds."""
    return spread(seconds, "ms", 1e3)


if __name__ == "__main__":
    main()

"""Measure selection of a set from random states, and check it against exhaustive search.

Usage: python benchmarks/selection.py [FILE ...] [--places 1000] [--checked 20] [--seed 0]

Without a FILE (made by `tcs score`) a synthetic table of the size of a bed's is measured: 242,064
configurations, 14 goals, some 5,000 configurations that reach a goal. On shared machines the clock
is noisy, so the processor time of the thread is printed beside it. This is a benchmark, not a test.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from table import cell, header, parser, row, save

from tcs.errors import SelectionError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.scoring import build_sets
from tcs.placement.selection import PAPER_WEIGHTS, SelectionTables, TravelWeights, select, utility
from tcs.placement.selection.travel import legs_from
from tcs.placement.store import load_scores
from tcs.placement.tables import Reason, ScoreTable, SetTable

GOALS = 14
CANDIDATES_AT_ONCE = 16


def main() -> int:
    """Run every measurement and print it; return 1 if an answer is not the best."""
    command_line = parser(__doc__)
    command_line.add_argument("files", nargs="*", type=Path, metavar="FILE")
    command_line.add_argument("--places", type=int, default=1000)
    command_line.add_argument("--checked", type=int, default=20)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    row("places, checked, seed", f"{options.places}, {options.checked}, {options.seed}")
    wrong = 0
    for name, tables in sources(options.files):
        sets = tables.sets
        row(
            name,
            f"{len(sets.candidates)} candidates, {len(sets.cell_xy)} cells, "
            f"{len(sets.pairs.cells)} pairs of cells, {sets.sets} sets",
        )
        for what, travel in travels(tables.grid).items():
            wrong += measure(tables, f"{name}: {what}", travel, options)
    row("answers that were not the best", str(wrong))
    save(options)
    return 1 if wrong else 0


def sources(files: list[Path]) -> Iterator[tuple[str, SelectionTables]]:
    """Return the tables to measure, by name."""
    if not files:
        grid = bed_grid()
        scores = bed_like_scores(grid)
        begun = time.perf_counter()
        sets = build_sets(scores, grid)
        row("building the sets", f"{time.perf_counter() - begun:.2f} s, compiling included")
        yield "synthetic", SelectionTables(sets, grid)
    for path in files:
        file = load_scores(path)
        for number in range(len(file.tables)):
            yield f"{path.stem}, table {number}", SelectionTables.of(file, number)


def travels(grid: Grid) -> dict[str, TravelWeights]:
    """Return the travel weights that are measured, by name."""
    axes = tuple(
        (axis.name, 2.0 if axis.held_unit == "m" else 0.5) for axis in grid.environment_axes
    )
    return {
        "metres": TravelWeights(),
        "and turns": TravelWeights(turn=0.3),
        "and torso and bed": TravelWeights(turn=0.3, torso=1.0, environment=axes),
        "around": TravelWeights(route="around"),
        "around, and all": TravelWeights(turn=0.3, torso=1.0, environment=axes, route="around"),
    }


def measure(
    tables: SelectionTables, what: str, travel: TravelWeights, options: argparse.Namespace
) -> int:
    """Select from random states and print the times; return the number of wrong results."""
    rng = np.random.default_rng(options.seed)
    units = tuple(axis.held_unit for axis in tables.grid.environment_axes)
    clock, processor_time, wrong, refused = [], [], 0, 0
    while len(clock) < options.places:
        x, y, yaw = rng.uniform((-3.0, -3.0, -np.pi), (3.0, 3.0, np.pi))
        here = InitialConfiguration(
            base_x=x,
            base_y=y,
            base_yaw=yaw,
            torso=rng.uniform(0.0, 0.3),
            environment=tuple(
                (axis.name, rng.choice(axis.values)) for axis in tables.grid.environment_axes
            ),
            environment_units=units,
        )
        begun = time.thread_time()
        try:
            choice = select(tables, here, weights=PAPER_WEIGHTS, travel=travel, max_members=2)
        except SelectionError:
            # No path starts inside the furniture.
            refused += 1
            continue
        processor_time.append(time.thread_time() - begun)
        clock.append(choice.seconds)
        if len(clock) <= options.checked:
            wrong += choice.indices != best_of_all(tables, here, travel)
    p50, p99 = np.quantile(processor_time, (0.5, 0.99))
    clock_p50, clock_p99 = np.quantile(clock, (0.5, 0.99))
    row(
        f"  {what}",
        f"p50 {1e3 * p50:.2f}, p99 {1e3 * p99:.2f}, max {1e3 * max(processor_time):.2f} ms "
        f"(clock {1e3 * clock_p50:.2f}, {1e3 * clock_p99:.2f}, {1e3 * max(clock):.2f}), "
        f"{refused} positions refused, {wrong} wrong",
    )
    for column, text in (
        ("median [ms]", f"{1e3 * p50:.2f}"),
        ("99th percentile [ms]", f"{1e3 * p99:.2f}"),
        ("greatest [ms]", f"{1e3 * max(processor_time):.2f}"),
        ("not the best, of those checked", f"{wrong} of {min(options.checked, len(clock))}"),
    ):
        cell("selection", what, column, text)
    return wrong


def best_of_all(
    tables: SelectionTables, here: InitialConfiguration, travel: TravelWeights
) -> tuple[int, ...]:
    """Return the best of all kept sets of one and two, the first among equals, exhaustively."""
    sets, weights = tables.sets, PAPER_WEIGHTS
    distances = tables.index.distances[travel.route]
    legs = legs_from(here, tables.grid, sets.candidates, sets.cell, distances, travel)
    singles = utility(sets.single_reachability, sets.single_manipulability, legs.from_here, weights)
    singles[~legs.reachable[sets.cell]] = -np.inf
    best, members = singles.max(), (int(np.argmax(singles)),)
    everyone = np.arange(len(sets.candidates))
    for begin in range(0, everyone.size, CANDIDATES_AT_ONCE):
        a = everyone[begin : begin + CANDIDATES_AT_ONCE, None]
        values = utility_of_pairs(sets, legs, weights, a, everyone[None, :])
        # Rows and columns are in order, so argmax finds the first of the best.
        i, j = np.unravel_index(int(np.argmax(values)), values.shape)
        if values[i, j] > best:
            best, members = values[i, j], (int(a[i, 0]), int(j))
    return tuple(int(sets.candidates[m]) for m in members)


def utility_of_pairs(sets: SetTable, legs, weights, a, b):
    """Return the utility of every pair, -inf where it is not kept, shape (len(a), len(b))."""
    manipulability, reachability = np.zeros((a.size, b.size)), np.zeros((a.size, b.size))
    for g, weight in enumerate(sets.weights):
        dexterity = sets.dexterity[:, g].astype(np.float64)
        manipulability += float(weight) * np.maximum(dexterity[a], dexterity[b])
        reachability += float(weight) * (sets.reached[a, g] | sets.reached[b, g])
    xy = sets.cell_xy[sets.cell]
    apart = np.hypot(*np.moveaxis(xy[a] - xy[b], -1, 0)) >= sets.min_distance - 1e-9
    single = sets.single_manipulability
    kept = apart & (a < b) & (manipulability >= sets.limits.manipulability)
    kept &= reachability >= sets.limits.reachability
    kept &= manipulability >= sets.limits.gain * np.maximum(single[a], single[b])
    if sets.same_environment:
        kept &= sets.state[a] == sets.state[b]
    kept &= legs.reachable[sets.cell[a]] & legs.reachable[sets.cell[b]]
    cost = np.minimum(legs.from_here[a], legs.from_here[b]) + legs.between(a, b)
    return np.where(kept, utility(reachability, manipulability, cost, weights), -np.inf)


def bed_grid() -> Grid:
    """Return the paper's grid around the bed."""
    return Grid.from_spec(
        {
            "bed_height": {"unit": "m", "start": 0.0, "step": 0.1, "count": 4},
            "head_rest": {"unit": "deg", "start": 0.0, "step": 35.0, "count": 3},
            "base_x": {"unit": "m", "start": -2.0, "step": 0.1, "count": 41},
            "base_y": {"unit": "m", "start": -2.0, "step": 0.1, "count": 41},
            "base_yaw": {"unit": "deg", "start": 0.0, "step": 90.0, "count": 4},
            "torso": {"unit": "m", "start": 0.0, "step": 0.15, "count": 3},
        }
    )


def bed_like_scores(grid: Grid) -> ScoreTable:
    """Return synthetic scores: goals along a bed, reached best from an arm's length beside it.

    Dexterity falls off smoothly with the distance from the shoulder, the height difference and the
    rotation, with ripples so that no two positions are equal.
    """
    at = grid.values(np.arange(grid.size))
    x, y, yaw = at["base_x"], at["base_y"], at["base_yaw"]
    raised = 0.15 * (at["bed_height"] > 0.15)
    outside_x = np.maximum(np.maximum(-0.2 - x, x - 2.15), 0.0)
    outside_y = np.maximum(np.abs(y) - 0.45 + raised, 0.0)
    blocked = np.maximum(outside_x, outside_y) < 0.33
    shoulder_x, shoulder_y = x - 0.19 * np.sin(yaw), y + 0.19 * np.cos(yaw)
    rng = np.random.default_rng(0)
    dexterity = np.zeros((grid.size, GOALS), dtype=np.float32)
    for g, along in enumerate(np.linspace(0.15, 1.75, GOALS)):
        raised_rest = np.sin(at["head_rest"]) * (along < 0.9)
        goal_x = along + rng.uniform(-0.05, 0.05) - 0.15 * raised_rest
        goal_y = (0.22 if g % 2 else -0.22) * rng.uniform(0.3, 1.0)
        height = 0.75 + 0.05 * rng.standard_normal() + at["bed_height"] + 0.35 * raised_rest
        up = height - 0.78 - at["torso"]
        reach = np.sqrt((goal_x - shoulder_x) ** 2 + (goal_y - shoulder_y) ** 2 + up**2)
        turn = np.arctan2(goal_y - shoulder_y, goal_x - shoulder_x) - yaw - 0.5
        turn = np.abs(np.mod(turn + np.pi, 2.0 * np.pi) - np.pi)
        ripples = 0.05 * np.sin(7.0 * x + 5.0 * g) * np.cos(6.0 * y + g)
        good = 0.65 - ((reach - 0.55) / 0.22) ** 2 - 0.36 * turn**2 - 4.0 * up**2 + ripples
        dexterity[:, g] = np.where((good > 0.0) & ~blocked, 0.3 + 0.5 * np.minimum(good, 1.0), 0.0)
    reason = np.where(dexterity > 0.0, Reason.REACHED, Reason.TOO_FAR).astype(np.uint8)
    reason[blocked] = Reason.BODY_BLOCKED
    return ScoreTable(
        dexterity=dexterity,
        reason=reason,
        pair=np.full(dexterity.shape, -1, dtype=np.int32),
        pair_names=(),
        arm_joints=np.zeros((int(np.count_nonzero(dexterity)), 7), dtype=np.float32),
        weights=np.full(GOALS, 1.0 / GOALS),
    )


if __name__ == "__main__":
    sys.exit(main())

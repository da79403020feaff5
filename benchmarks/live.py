"""Measure live scoring: its time, and its gain over the stored shifts of the person.

Usage: python benchmarks/live.py [--repeats 5] [--rows shaving/bed ...] [--between 0.025]

Times are those of the wheelchair tasks, with scene and machine code ready. The gain is measured on
the bed: the person is between two stored shifts, and the best set of the nearest table and the
best set scored live are both evaluated in the observed scene. This is a benchmark, not a test.
"""

from __future__ import annotations

import time

import numpy as np
from table import cell, header, parser, row, save, spread

from tcs.placement.scoring import LiveScorer, score, task_environment_pairs
from tcs.placement.selection import nearest_table
from tcs.placement.store import ScoreFile

WHEELCHAIR = "wheelchair"


def main() -> None:
    """Measure and print everything."""
    command_line = parser(__doc__)
    command_line.add_argument("--repeats", type=int, default=5, help="observations of each task")
    command_line.add_argument(
        "--rows", nargs="*", metavar="TASK/ENVIRONMENT", help="only these rows"
    )
    command_line.add_argument(
        "--between", type=float, default=0.025, help="distance from a stored shift [m]"
    )
    options = command_line.parse_args()
    header()
    rows = [
        one for one in task_environment_pairs() if not options.rows or "/".join(one) in options.rows
    ]
    for task, environment in rows:
        if environment == WHEELCHAIR:
            times(task, options.repeats)
    print()
    for task, environment in rows:
        if environment != WHEELCHAIR:
            gains(task, environment, options.between)
    save(options)


def times(task: str, repeats: int) -> None:
    """Measure wall and processor time of one observation."""
    begun = time.perf_counter()
    scorer = LiveScorer(task, paper=True)
    row(f"{task}: scene and machine code", f"{time.perf_counter() - begun:.2f} s, once")
    rng = np.random.default_rng(0)
    first = []
    for _ in range(repeats):
        x, y = rng.normal(0.0, 0.05, 2)
        begun = time.perf_counter()
        scorer.score({"person_x": float(x), "person_y": float(y)}, every=3)
        first.append(time.perf_counter() - begun)
    row(f"{task}: first answer of an observation", spread(first))
    cell("times", task, "first answer, every third position", spread(first))
    wall, cpu, scoring, sets = [], [], [], []
    for _ in range(repeats):
        x, y = rng.normal(0.0, 0.05, 2)
        begun, busy = time.perf_counter(), time.process_time()
        file = scorer.score({"person_x": float(x), "person_y": float(y)})
        wall.append(time.perf_counter() - begun)
        cpu.append(time.process_time() - busy)
        scoring.append(file.metadata["timings"]["scoring_seconds"])
        sets.append(file.metadata["timings"]["sets_seconds"])
    row(f"{task}: one observation", spread(wall))
    row("  of it scoring the grid", spread(scoring))
    row("  of it building the sets", spread(sets))
    row("  processor time, two threads", spread(cpu))
    for column, seconds in (
        ("one observation", wall),
        ("of it scoring the grid", scoring),
        ("of it building the sets", sets),
        ("processor time, two threads", cpu),
    ):
        cell("times", task, column, spread(seconds))


def gains(task: str, environment: str, between: float) -> None:
    """Print the gain of the best set scored live over that of the nearest stored shift."""
    stored = score(task, environment, paper=True)
    scorer = LiveScorer(task, environment, paper=True)
    steps = stored.observed_axes[0].values
    places = [float(y) + between for y in steps[:-1]]
    differences = []
    for x in (0.0, 0.05):
        found = []
        for y in places:
            live = scorer.score({"person_y": y, "person_x": x})
            near = stored.tables[nearest_table(stored, observed={"person_y": y}).index].sets.best
            found.append(
                np.subtract(scores_of(live, live.nominal.sets.best), scores_of(live, near))
            )
        differences.append(np.array(found))
    for x, found in zip((0.0, 0.05), differences, strict=True):
        name = f"{task}, {environment}" if x == 0.0 else f"  and {100 * x:.0f} cm towards the feet"
        reach, sums = found[:, 0], found.sum(axis=1)
        row(
            name,
            f"P_R {reach.mean():+.3f} (most {reach.max():+.3f}), "
            f"P_M {found[:, 1].mean():+.4f}, P_R + P_M {sums.mean():+.4f} "
            f"({sums.min():+.4f} .. {sums.max():+.4f}), better in "
            f"{np.count_nonzero(sums > 1e-9)} of {len(sums)}",
        )
        where = f"{100 * between:g} cm along y" + (f", {100 * x:g} cm along x" if x else "")
        line = f"{task.replace('_', ' ')}, {environment}"
        cell("gains", line, f"{where}: P_R (greatest)", f"{reach.mean():+.3f} ({reach.max():+.3f})")
        cell("gains", line, f"{where}: P_M", f"{found[:, 1].mean():+.4f}")


def scores_of(live: ScoreFile, members: tuple[int, ...]) -> tuple[float, float]:
    """Return P_R and P_M of a set in the observed scene."""
    scores = live.nominal.scores
    rows = list(members)
    reached = scores.reached[rows].any(axis=0)
    return float(reached @ scores.weights), float(
        scores.dexterity[rows].max(axis=0).astype(np.float64) @ scores.weights
    )


if __name__ == "__main__":
    main()

"""Scoring with approach: time, share of approachable pairs, recall, and what Drake refutes.

Usage: python benchmarks/approach.py [--pairs 300] [--rounds 5] [--rows TASK/ENVIRONMENT ...]

Goals are at their exact poses. Processor times of scoring with and without approach are taken in
turns on one thread. Reached pairs drawn at random are compared with a dense scan: postures at 96
values of the free joint, at 1,000 if none is approachable, at both ends of the line, followed by
the straight motions of the planner. Drake re-checks approaches of the drawn pairs at postures at
most a millimetre of motion apart.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np
from table import cell, header, parser, row, save

import tcs
from tcs.model.tasks import load_task
from tcs.motion import Stop
from tcs.motion.approach import SAMPLES, first_accesses
from tcs.motion.approach_check import ApproachScene
from tcs.placement.scoring import load_job, sweep, task_environment_pairs
from tcs.placement.scoring.approaches import approach_lines
from tcs.placement.tables import Reason

TIMED = ("shaving", "wheelchair")
COMPARED = (TIMED, ("feeding", "wheelchair"), ("bathing", "bed"))
DRAKE = 60
"""Greatest number of approaches re-checked with Drake, a second each."""
APPROACH = (Reason.APPROACH_LIMITS, Reason.APPROACH_BLOCKED)


def main() -> int:
    """Measure everything."""
    command_line = parser(__doc__)
    command_line.add_argument("--pairs", type=int, default=300)
    command_line.add_argument("--rounds", type=int, default=5)
    command_line.add_argument("--rows", nargs="*", metavar="TASK/ENVIRONMENT")
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    row("seed", str(options.seed))
    time_of(*TIMED, options.rounds)
    chosen = options.rows
    rows = task_environment_pairs() if chosen is None else [one.split("/") for one in chosen]
    for task, environment in rows:
        file = tcs.score(load_task(task).exact(), environment, approach=True)
        share(file)
        if (task, environment) in COMPARED:
            compare(task, environment, file, options)
    save(options)
    return 0


def time_of(task: str, environment: str, rounds: int) -> None:
    """Measure the processor time of scoring with and without approach, in turns."""
    job = load_job(task, environment, "pr2", paper=True)
    lowered, lines = job.lowered(job.scene()), approach_lines(job)
    seconds: dict[bool, list[float]] = {False: [], True: []}
    for number in range(rounds + 1):
        for approach, taken in seconds.items():
            begun = time.process_time()
            sweep(lowered, job.task.weights, jobs=1, approaches=lines if approach else None)
            # The first round loads the machine code.
            if number:
                taken.append(time.process_time() - begun)
    without, with_approach = (float(np.median(taken)) for taken in seconds.values())
    line = f"{task}-{environment}-pr2"
    cell("time", line, "without approach [s]", f"{without:.2f}")
    cell("time", line, "with approach [s]", f"{with_approach:.2f}")
    cell("time", line, "ratio", f"{with_approach / without:.1f}")
    row(f"{line}, processor time", f"{without:.2f} s, with {with_approach:.2f} s")


def share(file: tcs.ScoreFile) -> None:
    """Count the approachable pairs of a file."""
    reason = np.concatenate([table.scores.reason for table in file.tables])
    counts = [int(np.sum(reason == one)) for one in (Reason.REACHED, *APPROACH)]
    line = name_of(file)
    cell("rows", line, "reached by a posture", f"{sum(counts):,}")
    cell("rows", line, "approachable", f"{counts[0] / sum(counts):.1%}")
    cell("rows", line, "ended by limits", f"{counts[1] / sum(counts):.1%}")
    cell("rows", line, "blocked", f"{counts[2] / sum(counts):.1%}")
    row(line, f"{sum(counts):,} reached, {counts[0]:,} approachable")


def compare(task: str, environment: str, file: tcs.ScoreFile, options: argparse.Namespace) -> None:
    """Compare random pairs with the dense scan, and re-check their approaches with Drake."""
    pairs, seed = options.pairs, options.seed
    job = load_job(task, environment, "pr2", paper=True)
    scene = job.scene()
    approaches = ApproachScene.of(job, scene, job.lowered(scene))
    scores = file.nominal.scores
    drawn = np.argwhere(scores.reached | np.isin(scores.reason, APPROACH))
    rng = np.random.default_rng(seed)
    dense = both = checked = false = lost = 0
    speed = 0.0
    for h, g in drawn[rng.permutation(len(drawn))[:pairs]].tolist():
        number = file.nominal_index * job.grid.size + h
        stop = Stop.of(job, scene, number, seed)
        is_found = any(True for n in SAMPLES for _ in first_accesses(stop, g, n))
        dense += is_found
        both += is_found and bool(scores.reached[h, g])
        if is_found and not scores.reached[h, g]:
            row("missed", f"configuration {h}, goal {g}: {Reason(scores.reason[h, g]).name}")
        if not scores.reached[h, g] or checked == DRAKE:
            continue
        found = approaches.check(number, g, np.asarray(scores.joints_of(h, g), dtype=np.float64))
        checked += 1
        lost += found is None
        false += found is None or not found.is_true
        speed = max(speed, 0.0 if found is None else found.speed)
    line = name_of(file)
    cell("recall", line, "pairs", f"{pairs:,}")
    cell("recall", line, "approachable by the dense scan", f"{dense:,}")
    cell("recall", line, "of these found", f"{both:,}")
    cell("recall", line, "false (Drake), of the approaches re-checked", f"{false:,} of {checked:,}")
    row(
        line,
        f"{both} of {dense} found, {false} of {checked} false, {lost} of them not found again, "
        f"speed up to {speed:.3f} of the limit",
    )


def name_of(file: tcs.ScoreFile) -> str:
    """Return task, environment and robot of a file."""
    return "-".join(part["name"] for part in (file.task, file.environment, file.robot))


if __name__ == "__main__":
    sys.exit(main())

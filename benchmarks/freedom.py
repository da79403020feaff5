"""Recall of goals with freedom, against a dense scan of the freedom.

Usage: python benchmarks/freedom.py [--robots pr2,jaco] [--freedoms rotation,"cone of 20"]
           [--configurations 1000] [--seed 0] [--rows TASK:ENVIRONMENT:ROBOT,...] [--refusals 200]

The goals are those of *shaving* in the wheelchair, each with a freedom. Every pair of randomly
drawn initial configurations and goals is scored; those unreached, but for configurations whose
base or body is in contact at any goal, are scanned: poses of the freedom are drawn anew, one every
degree or 1,000 random ones, and scored without freedom. So what counts as missed is missed by the
search over the freedom; what the search of the arm at one pose misses is measured by `robots.py`.
At some of the pairs reached, the best pose of the scan is compared: how much of its dexterity the
pose has that the search found. The same configurations are scored at the nominal poses, in turn.
The results depend on the seed alone; times are processor times of one thread, the least of two.

With `--rows` tasks are scored as they ship, with approach, and it is asked what their freedom
misses: of pairs refused, drawn at random, half of them for their approach, such poses are scored as
goals of their own, each with its approach. A pair is missed if one of these can be approached.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from table import cell, header, parser, row, save

from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import Rows, rows_at
from tcs.kernel.scores import BODY_BLOCKED, REACHED, Scores
from tcs.kernel.sweep import score
from tcs.kernel.verification.scans import at_poses
from tcs.model.tasks import Freedom, Task, load_task
from tcs.placement.robustness.statistics import binomial_interval
from tcs.placement.scoring import load_job, sweep
from tcs.placement.scoring.approaches import ApproachScorer, approach_lines
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.tables import Reason

TASK, ENVIRONMENT = "shaving", "wheelchair"
FREEDOMS = {
    "rotation": Freedom(rotates=True),
    "orientation": Freedom(rotates=True, tilt=math.pi),
    "cone of 10": Freedom(tilt=math.radians(10.0)),
    "cone of 20": Freedom(tilt=math.radians(20.0)),
    "cone of 30": Freedom(tilt=math.radians(30.0)),
    "position": Freedom(box=(0.01, 0.01, 0.02)),
}
"""The freedom of every goal by the name of it in a task: `rotation` is `rotation_about` x."""
COMPARED = 40
"""Most pairs of a goal whose dexterity is compared with that of the scan."""
APPROACH = (Reason.APPROACH_LIMITS, Reason.APPROACH_BLOCKED)
"""Reasons of pairs that a posture reaches."""
DECIDED = (REACHED, BODY_BLOCKED, Reason.EXCLUDED, Reason.TOO_FAR, *APPROACH)
"""Reasons of other pairs that a pose of the freedom cannot change, and those of approaches."""
ANY_GOAL = (REACHED, BODY_BLOCKED)
"""Reasons that no scan of a goal can change."""


def main() -> None:
    """Measure every robot with every freedom."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", default="pr2,jaco")
    command_line.add_argument("--freedoms", default="rotation,orientation")
    command_line.add_argument("--configurations", type=int, default=1000)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--rows", help="rows to measure instead, with approach")
    command_line.add_argument("--refusals", type=int, default=200)
    options = command_line.parse_args()
    unknown = [name for name in options.freedoms.split(",") if name not in FREEDOMS]
    if unknown:
        command_line.error(
            f"--freedoms: '{unknown[0]}' is unknown; there are {', '.join(FREEDOMS)}"
        )
    header()
    row("seed", str(options.seed))
    if options.rows:
        for name in options.rows.split(","):
            approachable(*name.split(":"), options)
        save(options, keep=True)
        return
    for robot in options.robots.split(","):
        for freedom in options.freedoms.split(","):
            recall(robot, freedom, options)
    save(options, keep=True)


def recall(robot: str, freedom: str, options: argparse.Namespace) -> None:
    """Score pairs and scan those unreached; print and record what was found."""
    job = load_job(free_task(FREEDOMS[freedom]), ENVIRONMENT, robot)
    lowered = job.lowered(job.scene())
    problem, grid = build_problem(lowered.arrays), lowered.grid
    nominal = problem.at_single_poses(problem.goals.R, problem.goals.p)
    drawn = np.random.default_rng(options.seed).choice(
        grid.size, options.configurations, replace=False
    )
    configurations = np.sort(drawn)
    rows = rows_at(grid, configurations)
    seconds, exact_seconds = math.inf, math.inf
    for posed in (problem, nominal):
        # Load or compile the machine code.
        scored(posed, rows_at(grid, configurations[:1]))
    for _ in range(2):
        _, taken = scored(nominal, rows)
        exact_seconds = min(exact_seconds, taken)
        scores, taken = scored(problem, rows)
        seconds = min(seconds, taken)
    reasons = scores.reason
    reached = int(np.count_nonzero(reasons == REACHED))
    scanned = missed = 0
    scan_seconds, parts = 0.0, []
    for goal in range(reasons.shape[1]):
        left = configurations[~np.isin(reasons[:, goal], ANY_GOAL)]
        # The wheelchair has a single state.
        posed = at_poses(problem, 0, goal)
        found, taken = scored(posed, rows_at(grid, left))
        missed += int(np.count_nonzero((found.reason == REACHED).any(axis=1)))
        scanned, scan_seconds = scanned + len(left), scan_seconds + taken
        some = np.flatnonzero(reasons[:, goal] == REACHED)[:COMPARED]
        best = scored(posed, rows.at(some))[0]
        value = np.where(best.reason == REACHED, best.dexterity, 0.0).max(axis=1)
        parts.append(np.minimum(scores.dexterity[some, goal] / np.maximum(value, 1e-12), 1.0))
    part = np.concatenate(parts)
    if not reached:
        raise SystemExit(f"{robot}, {freedom}: no pair is reached; take more --configurations")
    low, high = binomial_interval(reached, reached + missed)
    values = {
        "pairs": f"{reasons.size:,}",
        "reached": f"{reached:,}",
        "missed, of those scanned": f"{missed:,} of {scanned:,}",
        "recall (95 % interval)": f"{reached / (reached + missed):.4f} ({low:.4f} .. {high:.4f})",
        "dexterity of the best, 5 % / median": (
            f"{np.percentile(part, 5):.3f} / {np.median(part):.3f}"
        ),
        "scoring, for each pair [us]": f"{1e6 * seconds / reasons.size:.1f}",
        "times a nominal pose": f"{seconds / exact_seconds:.1f}",
        "scan, for each pair [us]": f"{1e6 * scan_seconds / max(scanned, 1):.0f}",
    }
    name = f"{robot}, {freedom}"
    for column, text in values.items():
        row(f"{name}: {column}", text)
        cell("recall", name, column, text)


def approachable(task: str, environment: str, robot: str, options: argparse.Namespace) -> None:
    """Score a row with approach and scan some of its refusals; print and record what was found."""
    job = load_job(task, environment, robot)
    lowered = job.lowered(job.scene())
    lines = approach_lines(job)
    swept = sweep(lowered, job.task.weights, approaches=lines, tables=job.tables)
    reasons = np.concatenate([table.reason for table in swept.tables])
    problem, draw = build_problem(lowered.arrays), np.random.default_rng(options.seed)
    strata = {
        "for the approach": np.argwhere(np.isin(reasons, APPROACH)),
        "otherwise": np.argwhere(~np.isin(reasons, DECIDED)),
    }
    reached = int(np.count_nonzero(reasons == REACHED))
    values, lost = {"approachable": f"{reached:,}"}, 0.0
    for stratum, pairs in strata.items():
        looked_at = draw.permutation(pairs)[: options.refusals // 2]
        missed = 0
        for configuration, goal in looked_at:
            at = rows_at(lowered.grid, [configuration])
            posed = at_poses(problem, int(at.state[0]), int(goal))
            count = posed.goals.number
            of_poses = type(lines)(*(np.repeat(v[goal : goal + 1], count, axis=0) for v in lines))
            found = Scorer.of(posed, ApproachScorer(posed, of_poses)).score(at)
            if (found.reason == REACHED).any():
                missed += 1
                reason = Reason(reasons[configuration, goal]).name
                print(f"missed: configuration {configuration}, goal {goal}, {reason}", flush=True)
        lost += missed * len(pairs) / max(len(looked_at), 1)
        values[f"refused {stratum}"] = f"{len(pairs):,}"
        values[f"missed, {stratum}"] = f"{missed} of {len(looked_at)}"
    values["recall"] = f"{reached / (reached + lost):.4f}"
    name = f"{Path(task).stem}, {environment}, {robot}"
    for column, text in values.items():
        row(f"{name}: {column}", text)
        cell("approach", name, column, text)


def free_task(freedom: Freedom) -> Task:
    """Return the task with a freedom at every goal."""
    task = load_task(TASK).exact()
    return replace(task, goals=tuple(replace(goal, free=freedom) for goal in task.goals))


def scored(problem: Problem, rows: Rows) -> tuple[Scores, float]:
    """Score configurations at all goals of a problem.

    Args:
        problem: The problem.
        rows: The configurations.

    Returns:
        The scores, and the processor time [s].
    """
    begun = time.process_time()
    scores = score(problem, rows)
    return scores, time.process_time() - begun


if __name__ == "__main__":
    main()

"""Measure every shipped robot at the same tasks: time, reached goals, and recall by stratum.

Usage: python benchmarks/robots.py [--robots pr2,panda] [--tasks shaving,feeding|all] [--limit N]
                                   [--repeats 5] [--pairs 500] [--finished out/robots.jsonl]

Each robot does each task in the wheelchair on the paper's grid, or with `--tasks all` every row of
Table I; a robot without a torso joint has a third of the configurations. The robots alternate, so
that a load peak affects all of them. Then every unreached pair that only a search of the arm can
decide is scanned densely, or `--limit` random ones for each reason. With `--finished` each row is
appended to that file, and rows in it are not measured again, which continues an interrupted run.
This is a benchmark, not a test.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from table import cell, header, parser, recall_text, row, save, spread, verification_text

import tcs
from tcs.kernel.cache import kernel_digest
from tcs.model.robots import robot_names
from tcs.output.words.reasons import REASON_NAMES
from tcs.placement.scoring import load_job, score, sweep, verify
from tcs.placement.scoring.file_checker import STRATA, estimated_recall
from tcs.placement.scoring.score_to_file import task_environment_pairs

ENVIRONMENT = "wheelchair"
RECALL = 0.9999
"""Least recall expected of an arm with a closed form."""


@dataclass(frozen=True)
class Work:
    """A task for a robot to do.

    Attributes:
        task: Name of the task.
        environment: Name of the environment.
        robot: Name of the robot.
    """

    task: str
    environment: str
    robot: str

    @property
    def line(self) -> str:
        """The first cell of its line in the tables."""
        where = "" if self.environment == ENVIRONMENT else f", {self.environment}"
        return f"{self.robot}, {self.task}{where}"


def main() -> int:
    """Run every measurement and print it; return 1 if an answer is false."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", default=",".join(robot_names()))
    command_line.add_argument("--tasks", default="shaving,feeding")
    command_line.add_argument("--repeats", type=int, default=5, help="0 measures no time")
    command_line.add_argument("--pairs", type=int, default=500)
    command_line.add_argument("--dense", type=int, default=200)
    command_line.add_argument("--limit", type=int)
    command_line.add_argument("--jobs", type=int, default=2)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--finished", type=Path)
    options = command_line.parse_args()
    header()
    row("seed, threads", f"{options.seed}, {options.jobs}")
    rows = [(task, ENVIRONMENT) for task in options.tasks.split(",")]
    if options.tasks == "all":
        rows = list(task_environment_pairs())
    works = [Work(*pair, robot) for pair in rows for robot in options.robots.split(",")]
    if options.repeats:
        times(works, options.repeats, options.jobs)
    found = [finding(work, options) for work in works]
    for work, values in zip(works, found, strict=True):
        report(work, values)
    by_robot(works, found)
    save(options, keep=True)
    return 0 if all(values["is_sound"] for values in found) else 1


def times(works: Sequence[Work], repeats: int, jobs: int) -> None:
    """Measure the scoring of every task with every robot, and print the reasons."""
    lowered = {}
    for work in works:
        job = load_job(work.task, work.environment, work.robot, paper=True)
        lowered[work] = job.lowered(job.scene()), job.task.weights, job.tables
    taken: dict[Work, list[float]] = {work: [] for work in works}
    scores = {}
    for _ in range(repeats):
        for work, (scene, weights, tables) in lowered.items():
            swept = sweep(scene, weights, tables=tables, jobs=jobs)
            taken[work].append(swept.scoring_seconds)
            scores[work] = swept.tables
    for work, seconds in taken.items():
        row(f"{work.line}: scoring_seconds", spread(seconds))
        configurations = sum(table.configurations for table in scores[work])
        size = f"{configurations:,} x {scores[work][0].goals}"
        cell("times", work.line, "configurations x goals", size)
        cell("times", work.line, "scoring", spread(seconds))


def finding(work: Work, options: argparse.Namespace) -> dict[str, Any]:
    """Score one task and re-check it, unless an earlier run has; return what was found."""
    job = load_job(work.task, work.environment, work.robot, paper=True)
    key = {
        **dataclasses.asdict(work),
        "scene": job.lowered(job.scene()).digest(),
        "kernel": kernel_digest(Path(tcs.__path__[0]) / "kernel"),
        **{name: getattr(options, name) for name in ("pairs", "dense", "limit", "seed")},
    }
    for line in finished(options.finished):
        if line["key"] == key:
            row(f"verify {work.line}", f"{line['text']} (measured before)")
            return dict(line["found"])
    file = score(work.task, work.environment, work.robot, jobs=options.jobs, paper=True)
    verification = verify(
        file,
        pairs=options.pairs,
        dense=options.dense,
        strata=True,
        limit=options.limit,
        jobs=options.jobs,
        seed=options.seed,
    )
    text = verification_text(verification, verification.scan_seconds)
    row(f"verify {work.line}", text)
    reached = sum(int(table.scores.reached.sum()) for table in file.tables)
    found = {
        **verification.to_json(),
        "is_sound": verification.is_sound,
        "reached": reached,
        "recall_text": recall_text(verification),
    }
    if options.finished is not None:
        with options.finished.open("a") as stream:
            # The line before is incomplete if an earlier run was killed.
            stream.write("\n" + json.dumps({"key": key, "text": text, "found": found}))
    return found


def finished(path: Path | None) -> list[dict[str, Any]]:
    """Return the lines that an earlier run has finished."""
    if path is None or not path.exists():
        return []
    lines = []
    for line in filter(None, path.read_text().splitlines()):
        try:
            lines.append(json.loads(line))
        except ValueError:
            row("", f"{path}: a line that is not complete is measured again")
    return lines


def report(work: Work, found: Mapping[str, Any]) -> None:
    """Record one row of both tables."""
    cell("robots", work.line, "reached", f"{found['reached']:,}")
    false = f"{found['false_reached']} of {found['checked']:,}"
    cell("robots", work.line, "false, of those re-checked", false)
    cell("strata", work.line, "reached", f"{found['reached']:,}")
    for stratum in found["strata"]:
        cell("strata", work.line, heading(stratum["reason"]), counts_text(stratum))
    cell("strata", work.line, "refuted", str(found["unconfirmed_hits"]))
    cell("strata", work.line, "recall", found["recall_text"])
    cell("strata", work.line, "scan", f"{found['scan_seconds']:.0f} s")
    if found["ik"] == "analytic" and found["recall"] is not None and found["recall"] < RECALL:
        row("", f"{work.line}: recall is below {RECALL}")


def by_robot(works: Sequence[Work], found: Sequence[Mapping[str, Any]]) -> None:
    """Print and record the recall by stratum of every robot, over all of its tasks."""
    for robot in dict.fromkeys(work.robot for work in works):
        mine = [values for work, values in zip(works, found, strict=True) if work.robot == robot]
        reached = sum(values["reached"] for values in mine)
        cell("by_robot", robot, "rows", str(len(mine)))
        cell("by_robot", robot, "reached", f"{reached:,}")
        parts = []
        for reason in STRATA:
            name = reason.name.lower()
            strata = [s for values in mine for s in values["strata"] if s["reason"] == name]
            numbers = [[s[key] for s in strata] for key in ("pairs", "scanned", "missed")]
            recall, _ = estimated_recall(reached, *numbers)
            shown = "not estimated" if recall is None else f"{recall:.5f}"
            pairs, scanned, missed = map(sum, numbers)
            total = {"pairs": pairs, "scanned": scanned, "missed": missed}
            cell("by_robot", robot, heading(name), f"{counts_text(total)}: {shown}")
            parts.append(f"{REASON_NAMES[reason]} {counts_text(total)}, recall {shown}")
        row(f"{robot}: recall by stratum", "; ".join(parts))


def heading(reason: str) -> str:
    """Return the heading of a stratum."""
    (name,) = (REASON_NAMES[r] for r in STRATA if r.name.lower() == reason)
    return f"*{name}*: reachable, of those scanned"


def counts_text(stratum: Mapping[str, int]) -> str:
    """Return how many pairs of a stratum are reachable after all."""
    text = f"{stratum['missed']:,} of {stratum['scanned']:,}"
    is_whole = stratum["scanned"] == stratum["pairs"]
    return text if is_whole else f"{text} (of {stratum['pairs']:,})"


if __name__ == "__main__":
    sys.exit(main())

"""Plan every row of Table I with every robot and many bodies, and run some of the plan.

Usage: python benchmarks/campaign.py [--bodies 20] [--every 10] [--plan-only]
           [--folder out/campaign]

Each job, a row with a robot and a drawn body, is planned as `tcs score --dry-run` does, from fewer
slices; every tenth one is scored then. Both are kept in the folder, so that the same command
continues after an interrupt.
"""

from __future__ import annotations

import itertools
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed
from table import header, parser, record, row, save

import tcs
from tcs.files.writing import make_folder, whole_file
from tcs.model.people import draw_bodies
from tcs.model.robots import robot_names
from tcs.placement.scoring.catalogue import task_environment_pairs
from tcs.placement.scoring.dry_run import estimate
from tcs.placement.scoring.job import load_job

SLICES = 4
"""Slices that the time of a job is estimated from; the errors of thousands of jobs average out."""
SUMS = ("configurations", "scoring_seconds", "disk_bytes", "memory_bytes")


@dataclass(frozen=True)
class Job:
    """A row, a robot and a body, with the number of the job."""

    number: int
    task: str
    environment: str
    robot: str
    person: dict[str, Any]

    @property
    def words(self) -> tuple[str, str, str]:
        """Task, environment and robot."""
        return self.task, self.environment, self.robot


def jobs(bodies: int, seed: int) -> Iterator[Job]:
    """Yield all jobs."""
    drawn = draw_bodies(bodies, seed=seed)
    people = [{"sex": body.sex, **body.measures} for body in map(drawn.__getitem__, range(bodies))]
    every = itertools.product(task_environment_pairs(), robot_names(), people)
    for number, ((task, environment), robot, person) in enumerate(every):
        yield Job(number, task, environment, robot, person)


def planned(job: Job, folder: Path) -> dict[str, Any]:
    """Return the estimate of a job, from the folder if it is there."""
    path = folder / "plans" / f"{job.number}.json"
    if not path.exists():
        try:
            found = load_job(*job.words, person=job.person)
            plan = estimate(found, measure="isotropy", jobs=1, slices=SLICES).to_json()
        except tcs.TcsError as error:
            plan = {"refused": str(error)}
        with whole_file(path, "Plan of a job") as stream:
            stream.write(json.dumps(plan).encode())
    plain: dict[str, Any] = json.loads(path.read_text())
    return plain


def ran(job: Job, folder: Path) -> dict[str, Any]:
    """Return what scoring a job took, from the folder if it was scored."""
    path = folder / "runs" / f"{job.number}.json"
    if not path.exists():
        begun = time.process_time()
        file = tcs.score(*job.words, person=job.person, jobs=1)
        saved = folder / "runs" / f"{job.number}.tcs"
        tcs.save(saved, file)
        whole = tcs.load(saved).nominal.scores.configurations == file.configurations.size
        found = {
            "scoring_seconds": file.metadata["timings"]["scoring_seconds"],
            "processor_seconds": time.process_time() - begun,
            "file_bytes": saved.stat().st_size,
            "best": len(file.nominal.sets.best),
            "whole": whole,
        }
        with whole_file(path, "Run of a job") as stream:
            stream.write(json.dumps(found).encode())
    plain: dict[str, Any] = json.loads(path.read_text())
    return plain


def main() -> None:
    """Plan all jobs, run some, print and record what was planned and what it took."""
    command_line = parser(__doc__)
    command_line.add_argument("--bodies", type=int, default=20)
    command_line.add_argument("--every", type=int, default=10)
    command_line.add_argument("--first", type=int, help="plan and run only the first so many")
    command_line.add_argument("--plan-only", action="store_true")
    command_line.add_argument("--folder", type=Path, default=Path("out/campaign"))
    command_line.add_argument("--jobs", type=int, default=2)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    for name in ("plans", "runs"):
        make_folder(options.folder / name)
    all_jobs = list(jobs(options.bodies, options.seed))[: options.first]
    parallel = Parallel(n_jobs=options.jobs, verbose=1)
    plans = parallel(delayed(planned)(job, options.folder) for job in all_jobs)
    good = [plan for plan in plans if "refused" not in plan]
    totals = {key: sum(plan[key] for plan in good) for key in SUMS}
    lines = [
        ["jobs planned", f"{len(plans):,}"],
        ["refused in a line", f"{len(plans) - len(good):,}"],
        ["configurations", f"{totals['configurations']:,}"],
        ["planned scoring, hours of one core", f"{totals['scoring_seconds'] / 3600:.2f}"],
        ["planned size of the scores [MB]", f"{totals['disk_bytes'] / 1e6:,.0f}"],
        ["largest memory of a job [MB]", f"{max(p['memory_bytes'] for p in good) / 1e6:,.0f}"],
    ]
    if not options.plan_only:
        lines += run_lines(all_jobs, plans, options.every, options.folder, parallel)
    for name, text in lines:
        row(name, text)
    record("campaign", ["", ""], lines)
    save(options)


def run_lines(
    all_jobs: list[Job],
    plans: list[dict[str, Any]],
    every: int,
    folder: Path,
    parallel: Any,
) -> list[list[str]]:
    """Run one job in so many; return what it took beside what was planned."""
    chosen = [i for i in range(0, len(all_jobs), every) if "refused" not in plans[i]]
    runs = parallel(delayed(ran)(all_jobs[i], folder) for i in chosen)
    took = sum(run["scoring_seconds"] for run in runs)
    of_plan = sum(plans[i]["scoring_seconds"] for i in chosen)
    return [
        ["jobs run", f"{len(runs):,}"],
        ["files that are whole", f"{sum(run['whole'] for run in runs):,}"],
        ["jobs with a set that reaches something", f"{sum(run['best'] > 0 for run in runs):,}"],
        ["scoring of these, hours of one core", f"{took / 3600:.3f}"],
        ["times the planned", f"{took / of_plan:.2f}"],
        ["all of these jobs, hours of one core", f"{_hours(runs):.3f}"],
    ]


def _hours(runs: list[dict[str, Any]]) -> float:
    return float(sum(run["processor_seconds"] for run in runs)) / 3600


if __name__ == "__main__":
    main()

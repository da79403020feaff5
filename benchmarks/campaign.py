"""Plan every row of Table I with every robot and many bodies, and run some of the plan.

Usage: python benchmarks/campaign.py [--bodies 20] [--every 10] [--plan-only]
           [--folder out/campaign] [--until 12:10]

A job is a row with a robot and a drawn body. Of each row and robot one scene is built, in which the
bodies take each other's place. Some slices of the grid are scored for each body; what a job of the
row and robot would take is estimated from the slices of all of them, as `tcs score --dry-run` does.
Every tenth job is scored then, by itself. Plans and runs are kept in the folder, so that the same
command continues after an interrupt.
"""

from __future__ import annotations

import itertools
import json
import resource
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from table import header, parser, record, row, save

import tcs
from tcs.files.writing import make_folder, whole_file
from tcs.kernel.problem import build_problem
from tcs.model.people import Scale, draw_bodies, scales_of_people
from tcs.model.robots import load_robot, robot_names
from tcs.model.scene import PeopleInScene, load_environment
from tcs.model.tasks import load_task
from tcs.placement.scoring.dry_run import ScoredSlice, estimate_from, scored_slice
from tcs.placement.scoring.engines import Part, Work
from tcs.placement.scoring.job import load_job
from tcs.placement.scoring.kernel_start import warm_up
from tcs.placement.scoring.score_to_file import task_environment_pairs
from tcs.placement.scoring.scorer import Scorer

SLICE = 128
"""Configurations of a slice."""
SLICES = 3
"""Slices for each body: 60 of a row and robot, spread over the grid, some seconds for a robot
without a closed form."""
MEASURE = "isotropy"
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


@dataclass(frozen=True, eq=False)
class People:
    """The drawn bodies."""

    given: list[dict[str, Any]]
    """What is given of each, as in a person file."""
    scales: list[dict[str, Scale]]
    """How the parts of each are stretched."""

    @classmethod
    def drawn(cls, bodies: int, seed: int) -> People:
        """Return random bodies."""
        people = draw_bodies(bodies, seed=seed)
        given = [{"sex": one.sex, **one.measures} for one in map(people.__getitem__, range(bodies))]
        return cls(given, scales_of_people(people))


def groups(people: People) -> Iterator[list[Job]]:
    """Yield the jobs of each row and robot, one for each body."""
    numbers = itertools.count()
    for (task, environment), robot in itertools.product(task_environment_pairs(), robot_names()):
        yield [Job(next(numbers), task, environment, robot, one) for one in people.given]


def planned(group: Sequence[Job], people: People, folder: Path) -> list[dict[str, Any]]:
    """Return the estimates of the jobs of a row and robot, from the folder if they are there."""
    path = folder / "plans" / f"{group[0].number}.json"
    if not path.exists():
        begun = time.process_time()
        try:
            plans = estimates(group, people)
        except tcs.TcsError as error:
            plans = [{"refused": str(error)}] * len(group)
        found = {"plans": plans, "processor_seconds": time.process_time() - begun}
        with whole_file(path, "Plans of a row and robot") as stream:
            stream.write(json.dumps(found).encode())
    plain: dict[str, Any] = json.loads(path.read_text())
    each = plain["processor_seconds"] / len(group)
    return [{**plan, "planning_seconds": each} for plan in plain["plans"]]


def estimates(group: Sequence[Job], people: People) -> list[dict[str, Any]]:
    """Return what scoring each job of a row and robot would take, or why it is refused."""
    task, environment = load_task(group[0].task), load_environment(group[0].environment)
    robot = load_robot(group[0].robot)
    job = load_job(task, environment, robot, paper=True)
    scene = job.scene()
    lowered = job.lowered(scene)
    states = list(job.scored_grid.environment_states())
    in_scene = PeopleInScene(lowered, scene, job.task, states)
    of_everyone = np.arange(len(states))[None]
    size = job.scored_grid.size
    starts = np.linspace(0, max(0, size - SLICE), SLICES * len(group)).astype(int)
    of_bodies = starts.reshape(SLICES, -1).T
    refused = refusals(group[0].task, group[0].environment, people)
    slices: list[ScoredSlice] = []
    for scale, begins, refusal in zip(people.scales, of_bodies.tolist(), refused, strict=True):
        if refusal is not None:
            continue
        (arrays,) = in_scene.arrays_of([scale], of_everyone)
        problem = build_problem(arrays, MEASURE)
        if not slices:
            warm_up(problem)
        work = Work(Scorer.of(problem), lowered.grid)
        slices += [scored_slice(work, Part(k, min(k + SLICE, size))) for k in begins]
    if not slices:
        return [{"refused": refusal} for refusal in refused]
    plan = estimate_from(job, slices, jobs=1).to_json()
    return [plan if refusal is None else {"refused": refusal} for refusal in refused]


@cache
def refusals(task: str, environment: str, people: People) -> tuple[str | None, ...]:
    """Return why a row cannot be scored for each body, None if it can; no robot matters to that."""
    given = load_task(task), load_environment(environment), load_robot(robot_names()[0])
    found: list[str | None] = []
    for person in people.given:
        try:
            load_job(*given, person=person)
            found.append(None)
        except tcs.TcsError as error:
            found.append(str(error))
    return tuple(found)


def ran(job: Job, folder: Path, until: str | None) -> dict[str, Any] | None:
    """Return what scoring a job took, from the folder if it was scored; None if it is too late."""
    path = folder / "runs" / f"{job.number}.json"
    if not path.exists():
        if until is not None and f"{datetime.now():%H:%M}" >= until:
            return None
        begun = time.process_time()
        times: list[tuple[int, float]] = []
        try:
            file = tcs.score(
                *job.words,
                person=job.person,
                jobs=1,
                on_progress=lambda done, _: times.append((done, time.process_time())),
                paper=True,
            )
        except tcs.TcsError as error:
            return _kept(path, {"error": str(error)})
        saved = folder / "runs" / f"{job.number}.tcs"
        tcs.save(saved, file)
        whole = tcs.load(saved).nominal.scores.configurations == file.configurations.size
        found = {
            "scoring_seconds": _scoring_seconds(times),
            "processor_seconds": time.process_time() - begun,
            "peak_bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
            "file_bytes": saved.stat().st_size,
            "best": len(file.nominal.sets.best),
            "whole": whole,
        }
        return _kept(path, found)
    plain: dict[str, Any] = json.loads(path.read_text())
    return plain


def _kept(path: Path, found: dict[str, Any]) -> dict[str, Any]:
    """Write what a run was, and return it."""
    with whole_file(path, "Run of a job") as stream:
        stream.write(json.dumps(found).encode())
    return found


def _scoring_seconds(times: Sequence[tuple[int, float]]) -> float:
    """Return the processor time of scoring [s], from the configurations done at some times."""
    (first, begun), (last, end) = times[0], times[-1]
    return (end - begun) * last / max(1, last - first)


def main() -> None:
    """Plan all jobs, run some, print and record what was planned and what it took."""
    command_line = parser(__doc__)
    command_line.add_argument("--bodies", type=int, default=20)
    command_line.add_argument("--every", type=int, default=10)
    command_line.add_argument("--first", type=int, help="plan and run only the first so many")
    command_line.add_argument("--plan-only", action="store_true")
    command_line.add_argument("--folder", type=Path, default=Path("out/campaign"))
    command_line.add_argument("--until", help="time of the day, HH:MM, to start the last run at")
    command_line.add_argument("--jobs", type=int, default=2)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    for name in ("plans", "runs"):
        make_folder(options.folder / name)
    people = People.drawn(options.bodies, options.seed)
    parallel = Parallel(n_jobs=options.jobs, verbose=1)
    every_group = list(groups(people))
    if options.first is not None:
        every_group = every_group[: -(-options.first // options.bodies)]
    found = parallel(delayed(planned)(group, people, options.folder) for group in every_group)
    all_jobs = list(itertools.chain.from_iterable(every_group))[: options.first]
    plans = list(itertools.chain.from_iterable(found))[: options.first]
    good = [plan for plan in plans if "refused" not in plan]
    totals = {key: sum(plan[key] for plan in good) for key in SUMS}
    of_planning = sum(plan["planning_seconds"] for plan in plans)
    lines = [
        ["jobs planned", f"{len(plans):,}"],
        ["refused in a line", f"{len(plans) - len(good):,}"],
        ["planning, minutes of one core", f"{of_planning / 60:.1f}"],
        ["configurations", f"{totals['configurations']:,}"],
        ["planned scoring, hours of one core", f"{totals['scoring_seconds'] / 3600:.2f}"],
        ["planned size of the scores [MB]", f"{totals['disk_bytes'] / 1e6:,.0f}"],
        ["largest memory of a job [MB]", f"{max(p['memory_bytes'] for p in good) / 1e6:,.0f}"],
    ]
    if not options.plan_only:
        chosen = [i for i in range(0, len(all_jobs), options.every) if "refused" not in plans[i]]
        if options.until:
            # Spread over rows, robots and bodies, however many are done in time.
            np.random.default_rng(options.seed).shuffle(chosen)
        runs = parallel(delayed(ran)(all_jobs[i], options.folder, options.until) for i in chosen)
        lines += run_lines([plans[i] for i in chosen], runs)
    for name, text in lines:
        row(name, text)
    record("campaign", ["", ""], lines)
    save(options)


def run_lines(
    plans: Sequence[dict[str, Any]], all_runs: Sequence[dict[str, Any] | None]
) -> list[list[str]]:
    """Return what runs took beside what was planned; None for one that was not done in time."""
    pairs = [(plan, run) for plan, run in zip(plans, all_runs, strict=True) if run is not None]
    done = [(plan, run) for plan, run in pairs if "error" not in run]
    if not done:
        return [["jobs run", "0"]]
    took = sum(run["scoring_seconds"] for _, run in done)
    of_plan = sum(plan["scoring_seconds"] for plan, _ in done)
    whole_jobs = sum(run["processor_seconds"] for _, run in done)
    peak = max(run["peak_bytes"] for _, run in done)
    return [
        ["jobs to run", f"{len(plans):,}"],
        ["jobs run", f"{len(pairs):,}"],
        ["errors", f"{len(pairs) - len(done):,}"],
        ["files that are whole", f"{sum(run['whole'] for _, run in done):,}"],
        ["jobs with a set that reaches something", f"{sum(run['best'] > 0 for _, run in done):,}"],
        ["scoring of these, hours of one core", f"{took / 3600:.3f}"],
        ["times the planned", f"{took / of_plan:.2f}"],
        ["all of these jobs, hours of one core", f"{whole_jobs / 3600:.3f}"],
        ["greatest memory of a process that runs them [MB]", f"{peak / 1e6:,.0f}"],
    ]


if __name__ == "__main__":
    main()

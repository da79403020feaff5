"""The offline job: one task in one environment with one robot, scored and made ready to choose."""

from __future__ import annotations

import dataclasses
import math
import time
from collections import Counter
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, Unpack

from tcs.errors import TaskError
from tcs.kernel.dexterity import DEFAULT_MEASURE, dexterity
from tcs.model.grid import Axis, Grid
from tcs.model.robots import RobotFile, load_robot
from tcs.model.scene import (
    EnvironmentFile,
    LoweredScene,
    Scene,
    SceneSpec,
    body_frame_places,
    environment_names,
    load_environment,
    lower,
)
from tcs.model.tasks import Task, load_task
from tcs.placement.scoring.sets import SetOptions, build_sets, checked_options
from tcs.placement.scoring.sweep import ANALYTIC, sweep
from tcs.placement.store import ScoreFile, StateTables, state_to_json


@dataclasses.dataclass(frozen=True)
class Job:
    """What is scored: everything loaded and checked, nothing built yet."""

    task: Task
    spec: SceneSpec
    grid: Grid
    """What can be chosen."""
    observed: tuple[Axis, ...] = ()
    """What can only be observed: each state of these axes gets a table of its own."""

    @property
    def scored_grid(self) -> Grid:
        """Everything that is scored: the grid once for each observed state, in C order."""
        return Grid((*self.observed, *self.grid.axes))

    @property
    def tables(self) -> int:
        """How many observed states there are."""
        return math.prod(axis.count for axis in self.observed)

    def scene(self, *, meshes: bool = False) -> Scene:
        """Return a new live scene in which this task's allowed contacts are allowed.

        Args:
            meshes: Whether to load the robot's visual meshes, for show; they cost seconds.
        """
        return Scene(self.spec, allowed_contacts=self.task.allowed_contacts, meshes=meshes)

    def lowered(self, scene: Scene) -> LoweredScene:
        """Return the scene as arrays."""
        return lower(scene, self.task, self.scored_grid)


def load_job(
    task: str | Path | Task,
    environment: str | Path | EnvironmentFile,
    robot: str | Path | RobotFile,
) -> Job:
    """Return what is named, loaded and checked against each other.

    Raises:
        UnknownNameError: If a task, environment or robot of that name does not exist.
        DataFileError: If a file cannot be used, or the task is not for that environment.
        GridError: If the grid is empty or enormous.
    """
    task = task if isinstance(task, Task) else load_task(task)
    if not isinstance(environment, EnvironmentFile):
        environment = load_environment(environment)
    robot = robot if isinstance(robot, RobotFile) else load_robot(robot)
    # An environment of the user's own may take any task whose body frames it has.
    ours = environment.name in environment_names()
    if ours and environment.name not in task.environments:
        raise TaskError(
            f"Task '{task.name}' has no goals in environment '{environment.name}'. "
            f"It is for: {', '.join(task.environments)}."
        )
    grid = Grid.from_spec(environment.grid, where=f"environment '{environment.name}'")
    changes = task.grid_changes(environment.name)
    if changes:
        grid = grid.overridden(changes, where=f"task '{task.name}'")
    if robot.torso_joint is None:
        # Every level would be the same configuration again, scored and stored anew.
        grid = grid.overridden({"torso": {"start": 0.0, "count": 1}}, where=f"robot '{robot.name}'")
    return Job(task, SceneSpec(robot, environment), grid, environment.observed_axes)


def score(
    task: str | Path | Task,
    environment: str | Path | EnvironmentFile = "wheelchair",
    robot: str | Path | RobotFile = "pr2",
    *,
    measure: str = DEFAULT_MEASURE,
    jobs: int = 2,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
    **sets: Unpack[SetOptions],
) -> ScoreFile:
    """Score a task on the whole grid of an environment and build the sets to choose from.

    Args:
        task: Name of a task, path of a task file, or a task.
        environment: Name, path or environment.
        robot: Name, path or robot.
        measure: What the best solution at a goal is the best in: "isotropy",
            "inverse-condition", or one of them lowered near joint limits, "-limited" or
            "-limited-thesis". Equations: docs/method.md.
        jobs: Number of threads; the result does not depend on it.
        on_progress: Called with configurations scored and in all.
        on_compile: Called before the kernel compiles, when it has to.
        **sets: Which sets are kept: `rule`, `same_environment`, `max_members`, `min_distance`; see
            `tcs.placement.scoring.SetOptions`.

    Returns:
        Scores and sets, ready for `tcs.save` and `tcs.select`.

    Raises:
        UnknownNameError: If a task, environment, robot, frame or measure of that name does not
            exist.
        DataFileError: If a file cannot be used.
        GridError: If the grid is empty or enormous.
        TcsError: If an option of the sets is out of range.
    """
    begun = time.perf_counter()
    dexterity(measure)
    options = checked_options(**sets)
    job = load_job(task, environment, robot)

    return score_scene(
        job,
        job.scene(),
        options,
        named=references(job, task, environment, robot),
        measure=measure,
        begun=begun,
        jobs=jobs,
        on_progress=on_progress,
        on_compile=on_compile,
    )


def score_scene(
    job: Job,
    scene: Scene,
    sets: SetOptions,
    *,
    named: Mapping[str, Any],
    measure: str,
    begun: float,
    jobs: int,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
) -> ScoreFile:
    """Score a job in a scene that is built already.

    Args:
        job: What is scored.
        scene: A scene of the job; its state is left as it was.
        sets: Which sets are kept.
        named: Entries of the metadata: how task, environment and robot are found again, and
            whatever else there is to say.
        measure: Name of the dexterity measure.
        begun: When the work began, by `time.perf_counter` [s].
        jobs: Number of threads.
        on_progress: Called with configurations scored and in all.
        on_compile: Called before the kernel compiles, when it has to.
    """
    lowered = job.lowered(scene)
    digest = lowered.digest()
    swept = sweep(
        lowered,
        job.task.weights,
        tables=job.tables,
        measure=measure,
        jobs=jobs,
        on_progress=on_progress,
        on_compile=on_compile,
    )
    sets_begun = time.perf_counter()
    tables = tuple(
        StateTables.of(scores, build_sets(scores, job.grid, jobs=jobs, **sets))
        for scores in swept.tables
    )
    done = time.perf_counter()
    return ScoreFile(
        metadata={
            "program_version": version("tcs"),
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            **named,
            "scene_digest": digest,
            "measure": measure,
            "ik": swept.ik,
            "hashes": {"scene": digest},
            "timings": {
                "compile_seconds": swept.compile_seconds,
                "scoring_seconds": swept.scoring_seconds,
                "sets_seconds": done - sets_begun,
                "total_seconds": done - begun,
            },
        },
        task=_task_as_dict(job.task),
        robot=job.spec.robot.model_dump(mode="json"),
        environment=job.spec.environment.model_dump(mode="json"),
        grid=job.grid.to_dict(),
        observed=[axis.to_dict() for axis in job.observed],
        body_frames=body_frame_places(scene, job.scored_grid),
        tables=tables,
    )


def references(job: Job, task: object, environment: object, robot: object) -> dict[str, str]:
    """Return how the data files of a job are found again, from what it was loaded by."""
    return {
        "task": reference(task, job.task.name),
        "environment": reference(environment, job.spec.environment.name),
        "robot": reference(robot, job.spec.robot.name),
    }


def reference(given: object, name: str) -> str:
    """Return how to find a data file again: its name, or its absolute path.

    Args:
        given: What it was loaded by: a name, a path, or the loaded thing itself.
        name: What it calls itself.
    """
    if isinstance(given, Path) or (isinstance(given, str) and given != name):
        return str(Path(given).absolute())
    return name


def _task_as_dict(task: Task) -> dict[str, Any]:
    """Return a task as plain containers."""
    return {
        "name": task.name,
        "title": task.title,
        "source": task.source,
        "tool": task.tool,
        "environments": list(task.environments),
        "allowed_contacts": [list(pair) for pair in task.allowed_contacts],
        "goals": [
            {
                "body_frame": goal.body_frame,
                "position": goal.position.tolist(),
                "quaternion_wxyz": goal.quaternion.tolist(),
                "weight": goal.weight,
            }
            for goal in task.goals
        ],
    }


def summary(file: ScoreFile) -> dict[str, Any]:
    """Return the figures of a score file that a person wants to see first.

    Counts are those of all tables together. The best sets are those of the nominal table: the
    person where they belong. The keys are those of `tcs score --json`, except the name of the
    file.
    """
    timings = file.metadata["timings"]
    reasons: Counter[str] = Counter()
    for table in file.tables:
        reasons.update(table.scores.reason_counts())
    pairs = sum(reasons.values())
    goals = file.nominal.sets.weights.size
    return {
        "measure": file.metadata["measure"],
        # Files of earlier versions do not tell: they knew the closed form only.
        "ik": file.metadata.get("ik", ANALYTIC),
        "configurations": pairs // goals,
        "goals": goals,
        "pairs": pairs,
        "reached_pairs": reasons["reached"],
        "scoring_seconds": timings["scoring_seconds"],
        "compile_seconds": timings["compile_seconds"],
        "sets_seconds": timings["sets_seconds"],
        "total_seconds": timings["total_seconds"],
        "rule": file.nominal.sets.rule,
        "same_environment": file.nominal.sets.same_environment,
        "max_members": file.nominal.sets.max_members,
        "candidates": sum(len(table.sets.candidates) for table in file.tables),
        "sets": sum(table.sets.sets for table in file.tables),
        "best": _set_summary(file, file.nominal.sets.best),
        "best_single": _set_summary(file, file.nominal.sets.best_single),
        "reasons": dict(reasons),
        "tables": [
            {
                "observed": state_to_json(file.observed_axes, state),
                "candidates": len(table.sets.candidates),
                "sets": table.sets.sets,
            }
            for state, table in zip(file.observed_states, file.tables, strict=True)
        ],
    }


def _set_summary(file: ScoreFile, members: tuple[int, ...]) -> dict[str, Any] | None:
    """Return scores and members of a set of the nominal table; None when no goal is reached."""
    if not members:
        return None
    grid = Grid.from_dict(file.grid)
    reachability, manipulability = file.nominal.sets.scores_of(members)
    return {
        # Seven sevenths add up to 1 only after rounding.
        "reachability": round(reachability, 12),
        "manipulability": round(manipulability, 12),
        "members": [grid.configuration(h).to_json() for h in members],
    }

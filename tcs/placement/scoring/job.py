"""The scoring job: one task in one environment with one robot, loaded and checked."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tcs.errors import TaskError
from tcs.files.paths import data_reference
from tcs.model.grid import Axis, Grid, restricted
from tcs.model.people import PersonLike
from tcs.model.robots import RobotFile, load_robot
from tcs.model.scene import (
    EnvironmentFile,
    LoweredScene,
    Scene,
    SceneSpec,
    environment_names,
    goals_on_person,
    load_environment,
    lower,
    with_person,
    with_surface_goals,
)
from tcs.model.tasks import Task, load_task
from tcs.placement.constraints import Constraints, kept_conditions
from tcs.placement.scoring.obstacles import with_obstacles

_NO_CONSTRAINTS = Constraints()


@dataclasses.dataclass(frozen=True)
class Job:
    """A task, a scene and a grid to score, before anything is built."""

    task: Task
    spec: SceneSpec
    grid: Grid
    """The configurations to choose from."""
    observed: tuple[Axis, ...] = ()
    """The axes that can only be observed; each of their states is scored into tables of its own."""
    constraints: Constraints = _NO_CONSTRAINTS
    """Constraints whose conditions and obstacles are part of `grid` and `spec` already; forbidden
    regions are applied when scoring."""

    @property
    def scored_grid(self) -> Grid:
        """The grid once for each observed state, in C order."""
        return Grid((*self.observed, *self.grid.axes))

    @property
    def tables(self) -> int:
        """Number of observed states."""
        return math.prod(axis.count for axis in self.observed)

    def scene(self, *, meshes: bool = False) -> Scene:
        """Return a new live scene that allows the contacts this task allows.

        Args:
            meshes: Whether to load the robot's visual meshes, for display; this takes seconds.
        """
        return Scene(self.spec, allowed_contacts=self.task.allowed_contacts, meshes=meshes)

    def lowered(self, scene: Scene) -> LoweredScene:
        """Return the scene as arrays."""
        return lower(scene, self.task, self.scored_grid)


def load_job(
    task: str | Path | Task,
    environment: str | Path | EnvironmentFile,
    robot: str | Path | RobotFile,
    *,
    only: Sequence[str] = (),
    constraints: Constraints = _NO_CONSTRAINTS,
    now: Mapping[str, float] | None = None,
    person: PersonLike | None = None,
) -> Job:
    """Load a task, an environment and a robot, check them against each other and return their job.

    Args:
        task: Name of a task, path of a task file, or a task.
        environment: Name of an environment, path of its file, or an environment.
        robot: Name of a robot, path of its file, or a robot.
        only: Conditions on axes of the grid, e.g. "head_rest >= 35 deg"; other values are not
            scored.
        constraints: Further conditions, axes that keep their present value, forbidden regions and
            obstacles. Preferences have no effect.
        now: Present values of axes [m or rad], for the axes to keep.
        person: Whose body the person has, as for `tcs.model.people.load_person`; by default that of
            the environment file. Goals on the person are moved to that body.

    Raises:
        UnknownNameError: If a task, environment, robot, axis or body measure of that name does not
            exist.
        DataFileError: If a file cannot be used, or the task is not for that environment.
        GridError: If the grid is empty or enormous, or a condition is invalid.
        SelectionError: If the present value of an axis to keep is missing or not scored.
    """
    task = task if isinstance(task, Task) else load_task(task)
    if not isinstance(environment, EnvironmentFile):
        environment = load_environment(environment)
    if person is not None:
        environment = with_person(environment, person)
    robot = robot if isinstance(robot, RobotFile) else load_robot(robot)
    # An environment of the user's own may take any task whose body frames it has.
    is_shipped = environment.name in environment_names()
    if is_shipped and environment.name not in task.environments:
        raise TaskError(
            f"Task '{task.name}' has no goals in environment '{environment.name}'. "
            f"It is for: {', '.join(task.environments)}."
        )
    grid = Grid.from_spec(environment.grid, where=f"environment '{environment.name}'")
    changes = task.grid_changes(environment.name)
    if changes:
        grid = grid.overridden(changes, where=f"task '{task.name}'")
    if robot.torso_joint is None:
        # Without a torso joint all torso levels are the same configuration.
        grid = grid.overridden({"torso": {"start": 0.0, "count": 1}}, where=f"robot '{robot.name}'")
    kept = kept_conditions(constraints.keep, now or {}, grid)
    conditions = (*only, *constraints.only, *kept)
    grid = restricted(grid, conditions)
    applied = dataclasses.replace(constraints, only=conditions, keep=())
    task = with_surface_goals(goals_on_person(task, environment), environment)
    spec = SceneSpec(robot, with_obstacles(environment, constraints.blocked))
    return Job(task, spec, grid, environment.observed_axes, applied)


def data_references(job: Job, task: object, environment: object, robot: object) -> dict[str, Any]:
    """Return the metadata that locates a job's data files, given the arguments of `load_job`.

    Returns:
        `task`, `environment` and `robot` as of `data_reference`, and under `given` the same as the
        caller wrote them.
    """
    loaded = {
        "task": (task, job.task.name),
        "environment": (environment, job.spec.environment.name),
        "robot": (robot, job.spec.robot.name),
    }
    return {
        **{key: data_reference(given, name) for key, (given, name) in loaded.items()},
        "given": {
            key: str(given) if isinstance(given, str | Path) else name
            for key, (given, name) in loaded.items()
        },
    }

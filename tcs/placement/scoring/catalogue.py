"""Rows of Table I of the TCS paper, each task in each of its environments, and their file names."""

from __future__ import annotations

from pathlib import Path

from tcs.errors import TaskError
from tcs.model.scene import environment_names, load_environment
from tcs.model.tasks import load_task, task_names


def task_environment_pairs(environment: str | None = None) -> tuple[tuple[str, str], ...]:
    """Return the names of task and environment of every row that `tcs` ships.

    Args:
        environment: Return only the rows in this environment.

    Returns:
        The rows, one environment after the other, with sorted tasks.

    Raises:
        UnknownNameError: If there is no such environment.
        TaskError: If no task has goals in it.
    """
    if environment is not None:
        load_environment(environment)
    tasks = {name: load_task(name).environments for name in task_names()}
    environments = environment_names() if environment is None else (environment,)
    found = tuple(
        (task, name) for name in environments for task, allowed in tasks.items() if name in allowed
    )
    if not found:
        known = sorted({name for allowed in tasks.values() for name in allowed})
        raise TaskError(
            f"No task has goals in environment '{environment}'. "
            f"There are tasks for: {', '.join(known)}."
        )
    return found


def default_path(task: str, environment: str, robot: str, arms: str | None = None) -> Path:
    """Return the default path of a score file, in the current folder.

    Args:
        task: Name or path of a task.
        environment: Name or path of an environment.
        robot: Name or path of a robot.
        arms: Name of an arm, or "both"; None for that of the robot file.

    >>> str(default_path("shaving", "environments/kitchen.yaml", "pr2"))
    'shaving-kitchen-pr2.tcs'
    """
    names = [Path(name).stem for name in (task, environment, robot)]
    return Path("-".join(names + ([arms] if arms else [])) + ".tcs")

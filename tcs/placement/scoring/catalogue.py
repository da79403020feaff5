"""Rows of Table I of the TCS paper, each task in each of its environments, and their file names."""

from __future__ import annotations

from pathlib import Path

from tcs.errors import TaskError
from tcs.model.scene import environment_names, load_environment
from tcs.model.tasks import load_task, task_names


def task_environment_pairs(environment: str | None = None) -> tuple[tuple[str, str], ...]:
    """Return the names of task and environment of every row that ships with `tcs`.

    Args:
        environment: Only the rows in this environment.

    Returns:
        One environment after the other, tasks sorted within it.

    Raises:
        UnknownNameError: If there is no such environment.
        TaskError: If no task was written for it.
    """
    if environment is not None:
        load_environment(environment)
    rows = [(load_task(name).environments, name) for name in task_names()]
    known = environment_names() if environment is None else (environment,)
    found = tuple((task, room) for room in known for rooms, task in rows if room in rooms)
    if not found:
        raise TaskError(
            f"No task has goals in environment '{environment}'. "
            f"There are tasks for: {', '.join(sorted({r for rooms, _ in rows for r in rooms}))}."
        )
    return found


def default_path(task: str, environment: str, robot: str) -> Path:
    """Return the default path of a score file, in the current folder.

    Args:
        task: Name or path of a task.
        environment: Name or path of an environment.
        robot: Name or path of a robot.

    >>> str(default_path("shaving", "rooms/kitchen.yaml", "pr2"))
    'shaving-kitchen-pr2.tcs'
    """
    return Path("-".join(Path(name).stem for name in (task, environment, robot)) + ".tcs")

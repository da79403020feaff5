"""Tasks: a few tool poses on the body, written as YAML."""

from __future__ import annotations

from tcs.model.tasks.files import load_task, task_names
from tcs.model.tasks.task import Goal, Task

__all__ = ["Goal", "Task", "load_task", "task_names"]

"""Tasks: goal poses of the tool, fixed to the person's body or another frame of the environment.

In: task files. Out: checked goals with weights, allowed contacts, and changes to the grid.
"""

from __future__ import annotations

from tcs.model.tasks.files import load_task, task_names
from tcs.model.tasks.task import Goal, Task

__all__ = ["Goal", "Task", "load_task", "task_names"]

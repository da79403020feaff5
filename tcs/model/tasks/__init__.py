"""Tasks: goal poses of the tool, each fixed to a body frame of the person or the environment.

In: task files. Out: checked goals with weights, allowed contacts, and changes to the grid.
"""

from __future__ import annotations

from tcs.model.tasks.freedom import Freedom
from tcs.model.tasks.hand import Hand
from tcs.model.tasks.surface import Surface
from tcs.model.tasks.task import TOOL_SPEED, Goal, GoalPose, KeepOut, Task, partners
from tcs.model.tasks.task_files import load_task, task_names
from tcs.model.tasks.tool_line import ToolLine

__all__ = [
    "TOOL_SPEED",
    "Freedom",
    "Goal",
    "GoalPose",
    "Hand",
    "KeepOut",
    "Surface",
    "Task",
    "ToolLine",
    "load_task",
    "partners",
    "task_names",
]

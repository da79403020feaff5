"""Capability maps: the base poses from which an end-effector pose is reached, and their scores.

In: a robot and a grid, and for an ITCM recorded arm configurations; tasks as tool poses. Out: maps
(ICM, IHCM, ITCM), their files and accuracy, and task maps with the best base pose.

Names that need Drake or the kernel are loaded on first use, so that maps are merged and ARPlace is
queried without either.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tcs.capability.grid import MapGrid
from tcs.capability.map import CapabilityMap
from tcs.capability.map_files import load_map, save_map
from tcs.capability.merge import BasePose, TaskMap, merge
from tcs.capability.recording import Recording, read_csv, recording_of, write_csv
from tcs.capability.sequence import Stop, split
from tcs.capability.task_shapes import (
    TaskShape,
    curved_task,
    linear_task,
    pick_and_place_task,
)
from tcs.capability.tasks import Grasp, GraspPosition, GraspTask
from tcs.capability.tolerant_base import ErrorTolerantBase, best_under_error
from tcs.capability.visibility import visibility
from tcs.capability.volume import MapVolume

if TYPE_CHECKING:
    from tcs.capability.check import MapCheck, check_file, check_map, check_stored
    from tcs.capability.from_ik import map_from_ik
    from tcs.capability.from_recording import RecordedMap, map_from_recording
    from tcs.capability.pose_errors import PoseErrors, TaskSuccess, success_under_error
    from tcs.capability.reach import Reach
    from tcs.capability.surroundings import Feasibility, Surroundings
    from tcs.capability.text import export_text, import_text, write_base_poses

__all__ = [
    "BasePose",
    "CapabilityMap",
    "ErrorTolerantBase",
    "Feasibility",
    "Grasp",
    "GraspPosition",
    "GraspTask",
    "MapCheck",
    "MapGrid",
    "MapVolume",
    "PoseErrors",
    "Reach",
    "RecordedMap",
    "Recording",
    "Stop",
    "Surroundings",
    "TaskMap",
    "TaskShape",
    "TaskSuccess",
    "best_under_error",
    "check_file",
    "check_map",
    "check_stored",
    "curved_task",
    "export_text",
    "import_text",
    "linear_task",
    "load_map",
    "map_from_ik",
    "map_from_recording",
    "merge",
    "pick_and_place_task",
    "read_csv",
    "recording_of",
    "save_map",
    "split",
    "success_under_error",
    "visibility",
    "write_base_poses",
    "write_csv",
]

_HOMES = {
    "Feasibility": "tcs.capability.surroundings",
    "MapCheck": "tcs.capability.check",
    "PoseErrors": "tcs.capability.pose_errors",
    "Reach": "tcs.capability.reach",
    "RecordedMap": "tcs.capability.from_recording",
    "Surroundings": "tcs.capability.surroundings",
    "TaskSuccess": "tcs.capability.pose_errors",
    "check_file": "tcs.capability.check",
    "check_map": "tcs.capability.check",
    "check_stored": "tcs.capability.check",
    "export_text": "tcs.capability.text",
    "import_text": "tcs.capability.text",
    "map_from_ik": "tcs.capability.from_ik",
    "map_from_recording": "tcs.capability.from_recording",
    "success_under_error": "tcs.capability.pose_errors",
    "write_base_poses": "tcs.capability.text",
}
"""Module of each name that is loaded on first use."""


def __getattr__(name: str) -> Any:
    """Return a name that is loaded on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module 'tcs.capability' has no attribute '{name}'")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

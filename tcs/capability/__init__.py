"""Capability maps: the base poses from which an end-effector pose is reached, and their scores.

In: a robot and a grid, and for an ITCM recorded arm configurations; tasks as tool poses. Out: maps
(ICM, IHCM, ITCM), their files and accuracy, and task maps with the best base pose.
"""

from __future__ import annotations

from tcs.capability.check import MapCheck, check_file, check_map, check_stored
from tcs.capability.files import load_map, save_map
from tcs.capability.from_ik import map_from_ik
from tcs.capability.from_recording import RecordedMap, map_from_recording
from tcs.capability.grid import MapGrid
from tcs.capability.map import CapabilityMap
from tcs.capability.merge import BasePose, TaskMap, merge
from tcs.capability.pose_errors import PoseErrors, TaskSuccess, success_under_error
from tcs.capability.reach import Reach
from tcs.capability.recording import Recording, read_csv, recording_of, write_csv
from tcs.capability.sequence import Stop, split
from tcs.capability.surroundings import Feasibility, Surroundings
from tcs.capability.task_shapes import (
    TaskShape,
    curved_task,
    linear_task,
    pick_and_place_task,
)
from tcs.capability.tasks import Grasp, GraspPosition, GraspTask
from tcs.capability.text import export_text, import_text, write_base_poses
from tcs.capability.tolerant_base import ErrorTolerantBase, best_under_error
from tcs.capability.visibility import visibility
from tcs.capability.volume import MapVolume

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

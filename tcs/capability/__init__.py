"""Capability maps: from which base poses an end-effector pose is reached, and how well.

Made from inverse kinematics (ICM, IHCM) or from recorded arm configurations (ITCM), and merged into
the map of a task.
"""

from __future__ import annotations

from tcs.capability.check import MapCheck, check_map, check_stored
from tcs.capability.files import export_text, import_text, load_map, save_map
from tcs.capability.from_ik import map_from_ik
from tcs.capability.from_recording import Recorded, map_from_recording
from tcs.capability.grid import MapGrid
from tcs.capability.map import CapabilityMap
from tcs.capability.merge import BasePose, TaskMap, merge
from tcs.capability.reach import Reach
from tcs.capability.recording import Recording, read_csv, recording_of, write_csv
from tcs.capability.sequence import Stop, split
from tcs.capability.tasks import (
    Grasp,
    GraspPosition,
    GraspTask,
    curved_task,
    linear_task,
    pick_and_place_task,
)
from tcs.capability.visibility import visibility
from tcs.capability.volume import MapVolume

__all__ = [
    "BasePose",
    "CapabilityMap",
    "Grasp",
    "GraspPosition",
    "GraspTask",
    "MapCheck",
    "MapGrid",
    "MapVolume",
    "Reach",
    "Recorded",
    "Recording",
    "Stop",
    "TaskMap",
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
    "visibility",
    "write_csv",
]

"""Capability maps of an experiment, one per controller.

The ITCM thesis records people with one controller and leaves open how the map depends on it. Here
all trials of an experiment with one controller form one recording, and its capability map gives
base poses for operators of that controller.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tcs.capability import (
    BasePose,
    CapabilityMap,
    Grasp,
    GraspPosition,
    GraspTask,
    MapGrid,
    Reach,
    map_from_recording,
    merge,
    recording_of,
)
from tcs.capability.from_ik import camera_view
from tcs.capability.grid import TILT, Z
from tcs.capability.map import ITCM
from tcs.capability.visibility import CORRECTED
from tcs.errors import SelectionError
from tcs.teleop.arm import Arm
from tcs_studies.experiment.within_subject import Experiment

STEP, YAW_BINS = 0.05, 16
"""Step of the grid [m], and number of yaw bins: those of the thesis."""


@dataclass(frozen=True, eq=False)
class ControllerMap:
    """The capability map of one controller's trials."""

    condition: str
    capability: CapabilityMap
    samples: int
    """Number of postures in the recording."""
    shared_fraction: float
    """Fraction of its cells that are also in the map of the first controller."""
    grasp_cells: int
    """Number of cells with the grasp that the maps are compared by."""
    best: BasePose | None
    """Best base pose for that grasp, relative to the tool; None if no cell has it."""

    @property
    def mean_score(self) -> float:
        """Mean score of the cells."""
        return float(self.capability.score().mean())


@dataclass(frozen=True, eq=False)
class ControllerMaps:
    """The maps of all controllers, and the grasp that they are compared by."""

    maps: tuple[ControllerMap, ...]
    height: float
    """Height of the tool above the floor [m]."""
    pitch: float
    """Pitch of the tool in its level frame E [rad]."""
    roll: float
    """Roll of the tool in E [rad]."""


def check_map_robot(arm: Arm) -> None:
    """Check that recordings of an arm can become a map, before they are made.

    Raises:
        RobotError: If the robot has no head file.
    """
    camera_view(_reach(arm), MapGrid.of(STEP, YAW_BINS), ITCM, CORRECTED)


def _reach(arm: Arm) -> Reach:
    return Reach(arm.robot, torso_height=arm.torso_height, step=STEP)


def controller_maps(experiment: Experiment) -> ControllerMaps:
    """Return the map of each controller.

    All maps are compared by one grasp: the tilt and height for which the smallest count of cells
    over the maps is greatest.

    Args:
        experiment: The experiment; its robot must have a head file.

    Raises:
        RobotError: If the robot has no head file.
        DataFileError: If a recording cannot become a map.
    """
    arm = experiment.arm
    reach = _reach(arm)
    grid = MapGrid.of(STEP, YAW_BINS, "all")
    found = {}
    for condition, drives in experiment.drives.items():
        postures = np.concatenate([trial for drive in drives for trial in drive.postures])
        where = f"trials with {condition}"
        recording = recording_of(arm.joints, postures, arm.robot, where=where)
        found[condition] = map_from_recording(reach, grid, recording)
    tilt, level = _grasp([one.capability for one in found.values()])
    pitch, roll = (tilt_steps * grid.yaw_step for tilt_steps in grid.tilts[tilt])
    height = -level * grid.step
    first = next(iter(found.values())).capability
    maps = []
    for condition, recorded in found.items():
        capability = recorded.capability
        cells = capability.cells
        maps.append(
            ControllerMap(
                condition=condition,
                capability=capability,
                samples=recorded.samples,
                shared_fraction=float((first.rows_of(cells) >= 0).mean()),
                grasp_cells=int(((cells[:, TILT] == tilt) & (cells[:, Z] == level)).sum()),
                best=_best(capability, height, (pitch, roll)),
            )
        )
    return ControllerMaps(tuple(maps), height, pitch, roll)


def _grasp(maps: Sequence[CapabilityMap]) -> tuple[int, int]:
    """Return the tilt and level whose smallest number of cells over the maps is greatest."""
    counts: dict[tuple[int, int], list[int]] = {}
    for number, capability in enumerate(maps):
        grasps, count = np.unique(capability.cells[:, [TILT, Z]], axis=0, return_counts=True)
        for (tilt, level), cells in zip(grasps.tolist(), count.tolist(), strict=True):
            counts.setdefault((tilt, level), [0] * len(maps))[number] = cells
    return max(sorted(counts), key=lambda grasp: (min(counts[grasp]), sum(counts[grasp])))


def _best(
    capability: CapabilityMap, height: float, approach: tuple[float, float]
) -> BasePose | None:
    task = GraspTask("one grasp", (GraspPosition(0.0, 0.0, height, (Grasp(0.0, approach),)),))
    try:
        return merge(capability, task, torso_height=capability.torso_height).best()
    except SelectionError:
        return None

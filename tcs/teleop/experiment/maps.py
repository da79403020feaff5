"""From operator to recording to map: what a capability map holds, by the controller that was used.

The ITCM thesis records people who drive with one controller, and asks what another one would change
(its open question). Here all that the operators of an experiment did with a controller is one
recording, and the map of it says where to stand for somebody who drives with that controller.
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
from tcs.teleop.experiment.within_subject import Experiment

STEP, YAW_BINS = 0.05, 16
"""Of the grid [m], and headings in a full turn: those of the thesis."""


@dataclass(frozen=True, eq=False)
class ControllerMap:
    """The map of what was driven with one controller."""

    condition: str
    capability: CapabilityMap
    samples: int
    """Postures in the recording."""
    shared: float
    """Share of its cells that the map of the first controller holds, too."""
    grasp_cells: int
    """Cells that hold the grasp asked for."""
    best: BasePose | None
    """Where to stand for that grasp, seen from the tool; None where no cell holds it."""

    @property
    def mean_score(self) -> float:
        """Mean score of the cells."""
        return float(self.capability.score().mean())


@dataclass(frozen=True, eq=False)
class ControllerMaps:
    """The maps of all controllers, and the grasp that they are asked for."""

    maps: tuple[ControllerMap, ...]
    height: float
    """Of the tool above the floor [m]."""
    pitch: float
    """Of the tool in its level frame [rad]."""
    roll: float
    """The same [rad]."""


def check_map_robot(arm: Arm) -> None:
    """Refuse an arm whose recordings can become no map, before they are made.

    Raises:
        UnknownNameError: If the robot has no head file.
    """
    camera_view(_reach(arm), MapGrid.of(STEP, YAW_BINS), ITCM, CORRECTED)


def _reach(arm: Arm) -> Reach:
    return Reach(arm.robot, torso_height=arm.torso_height, step=STEP)


def controller_maps(experiment: Experiment) -> ControllerMaps:
    """Return the map of each controller.

    One grasp is asked of all maps, so that their answers compare: of the grid's tilts and heights
    the one that the poorest map has the most cells for.

    Args:
        experiment: All of it; its robot must have a head file.

    Raises:
        UnknownNameError: If the robot has no head file.
        DataFileError: If a recording cannot become a map.
    """
    arm = experiment.arm
    reach = _reach(arm)
    grid = MapGrid.of(STEP, YAW_BINS, "all")
    found = {}
    for condition, drives in experiment.drives.items():
        postures = np.concatenate([trial for drive in drives for trial in drive.postures])
        where = f"what was driven with {condition}"
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
                shared=float((first.rows_of(cells) >= 0).mean()),
                grasp_cells=int(((cells[:, TILT] == tilt) & (cells[:, Z] == level)).sum()),
                best=_best(capability, height, (pitch, roll)),
            )
        )
    return ControllerMaps(tuple(maps), height, pitch, roll)


def _grasp(maps: Sequence[CapabilityMap]) -> tuple[int, int]:
    """Return tilt and level that the poorest map has the most cells for; the first of equals."""
    counts: dict[tuple[int, int], list[int]] = {}
    for number, capability in enumerate(maps):
        kinds, count = np.unique(capability.cells[:, [TILT, Z]], axis=0, return_counts=True)
        for (tilt, level), cells in zip(kinds.tolist(), count.tolist(), strict=True):
            counts.setdefault((tilt, level), [0] * len(maps))[number] = cells
    return max(sorted(counts), key=lambda kind: (min(counts[kind]), sum(counts[kind])))


def _best(
    capability: CapabilityMap, height: float, approach: tuple[float, float]
) -> BasePose | None:
    task = GraspTask("one grasp", (GraspPosition(0.0, 0.0, height, (Grasp(0.0, approach),)),))
    try:
        return merge(capability, task, torso_height=capability.torso_height).best()
    except SelectionError:
        return None

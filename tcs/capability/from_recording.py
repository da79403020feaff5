"""Maps from recorded arm configurations (ITCM): cells that the operator reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.capability.from_ik import camera_view, finished_map
from tcs.capability.grid import MapGrid, NearestCells
from tcs.capability.map import ITCM, CapabilityMap
from tcs.capability.reach import Reach
from tcs.capability.recording import Recording
from tcs.capability.visibility import CORRECTED
from tcs.errors import DataFileError
from tcs.kernel.arrays import FloatArray

_AXES = ("x", "y", "z", "roll", "pitch", "yaw")
_EDGE = 1e-9
"""Tolerance of half a cell [m or rad], for rounding."""


@dataclass(frozen=True, eq=False)
class RecordedMap:
    """A map of a recording, with statistics of the discretisation."""

    capability: CapabilityMap
    samples: int
    """Samples in the recording."""
    wrong_height: int
    """Samples left out because of the height of the tool."""
    wrong_tilt: int
    """Samples left out because no tilt of the grid is within half a cell."""
    offsets: FloatArray
    """Distances of the chosen sample from its cell: x, y, z [m], roll, pitch, yaw [rad], shape
    (cells, 6)."""

    def error_table(self) -> dict[str, dict[str, float]]:
        """Return mean and standard deviation of `offsets` by axis: ITCM thesis, Table 3."""
        return {
            axis: {"mean": float(column.mean()), "std": float(column.std())}
            for axis, column in zip(_AXES, self.offsets.T, strict=True)
        }

    def to_json(self) -> dict[str, Any]:
        """Return the statistics as plain containers, without the map."""
        return {
            "samples": self.samples,
            "wrong_height": self.wrong_height,
            "wrong_tilt": self.wrong_tilt,
            "cells": len(self.capability.cells),
            "discretisation_error": self.error_table(),
        }


def map_from_recording(
    reach: Reach,
    grid: MapGrid,
    recording: Recording,
    *,
    height: float | None = None,
    height_margin: float | None = None,
    view_rule: str = CORRECTED,
) -> RecordedMap:
    """Return the map of a recording.

    Args:
        reach: The robot, at the torso height of the map.
        grid: The cells.
        recording: Arm configurations; without torso heights, that of `reach` is assumed.
        height: Height of the tool above the floor [m]; samples at other heights are left out.
            None takes all samples.
        height_margin: Greatest difference from `height` [m]; None is half a step.
        view_rule: Visibility rule.

    Raises:
        DataFileError: If the height is not finite, or no sample is left.
        RobotError: If the robot has no head file.
        UnknownNameError: If there is no such rule.
        GridError: If there are more torso heights than a map can have.

    Source:
        ITCM thesis section II.B and Appendix C.2.3, eqs. (23) to (25). The sample of a cell is
        the one nearest to its centre: the distances in position and in orientation are each
        scaled linearly to [0, 1] over all samples, and multiplied.
    """
    camera_view(reach, grid, ITCM, view_rule)
    R_AT, p_AT = reach.tool_poses(recording.joints)
    R_BT = reach.R_BA @ R_AT
    p_BT = p_AT @ reach.R_BA.T + reach.p_BA
    kept = np.arange(len(recording))
    if height is not None:
        raised = (
            0.0 if recording.torso_height is None else recording.torso_height - reach.torso_height
        )
        margin = 0.5 * grid.step if height_margin is None else height_margin
        kept = np.flatnonzero(np.abs(p_BT[:, 2] + raised - height) <= margin + _EDGE)
    wrong_height = len(recording) - len(kept)
    near = grid.nearest(R_BT[kept], p_BT[kept])
    angles = _roll_pitch_yaw(near.R_CT)
    on_grid = (np.abs(angles) <= 0.5 * grid.yaw_step + _EDGE).all(axis=1)
    kept, near, angles = kept[on_grid], _rows(near, on_grid), angles[on_grid]
    if not len(kept):
        at = "" if height is None else f" at a height of {height:g} m"
        raise DataFileError(
            f"none of the {len(recording)} samples has the tool{at} within half a cell of the "
            "tilts of the grid. Check height, torso height, tool frame and grasps."
        )
    distance = _stretched(np.linalg.norm(near.offset, axis=1)) * _stretched(near.angle)
    keys = grid.keys(near.cells)
    order = np.lexsort((np.arange(len(keys)), distance, keys))
    _, first = np.unique(keys[order], return_index=True)
    rows = order[first]
    chosen = kept[rows]
    joints = recording.joints[chosen]
    # The arm was at this torso height, even where the enclosing shapes overlap.
    free = reach.free_torso_heights(joints) | np.uint32(1) << np.uint32(reach.level)
    capability = finished_map(
        reach, grid, ITCM, near.cells[rows], p_BT[chosen], reach.manipulability(joints), joints,
        free, view_rule, {"samples": len(recording), "height": height},
    )  # fmt: skip
    offsets = np.abs(np.hstack([near.offset[rows], angles[rows]]))
    return RecordedMap(
        capability, len(recording), wrong_height, len(recording) - wrong_height - len(kept), offsets
    )


def _rows(near: NearestCells, rows: Any) -> NearestCells:
    return NearestCells(near.cells[rows], near.heading[rows], near.offset[rows], near.R_CT[rows])


def _stretched(values: FloatArray) -> FloatArray:
    """Return values scaled linearly to [0, 1]; all 0 if they are equal."""
    low, high = float(values.min()), float(values.max())
    return (values - low) / (high - low) if high > low else np.zeros_like(values)


def _roll_pitch_yaw(R: FloatArray) -> FloatArray:
    """Return the angles of R = Rz(yaw) Ry(pitch) Rx(roll) [rad], shape (n, 3)."""
    return np.column_stack(
        [
            np.arctan2(R[:, 2, 1], R[:, 2, 2]),
            np.arcsin(np.clip(-R[:, 2, 0], -1.0, 1.0)),
            np.arctan2(R[:, 1, 0], R[:, 0, 0]),
        ]
    )

"""Maps from recorded arm configurations (ITCM): every cell is one that the operator did reach."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tcs.capability.from_ik import finished_map, seen_from
from tcs.capability.grid import MapGrid, NearestCells
from tcs.capability.map import ITCM, CapabilityMap
from tcs.capability.reach import Reach
from tcs.capability.recording import Recording
from tcs.capability.visibility import CORRECTED
from tcs.errors import DataFileError
from tcs.kernel.arrays import FloatArray

_AXES = ("x", "y", "z", "roll", "pitch", "yaw")
_EDGE = 1e-9
"""Poses this much past half a cell [m or rad] still belong to it: rounding, no more."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """A map, and how the recording became it."""

    capability: CapabilityMap
    samples: int
    """Samples in the recording."""
    off_height: int
    """Samples left out as higher or lower than asked for."""
    off_grid: int
    """Samples left out as tilted by more than half a cell from every tilt of the grid."""
    offsets: FloatArray
    """Of the sample chosen for each cell, distance from the cell along x, y, z [m], and about
    roll, pitch, yaw [rad], shape (cells, 6)."""

    def error_table(self) -> dict[str, dict[str, float]]:
        """Return mean and standard deviation of `offsets` by axis: ITCM thesis, Table 3."""
        return {
            axis: {"mean": float(column.mean()), "std": float(column.std())}
            for axis, column in zip(_AXES, self.offsets.T, strict=True)
        }

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers, without the map."""
        return {
            "samples": self.samples,
            "off_height": self.off_height,
            "off_grid": self.off_grid,
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
) -> Recorded:
    """Return the map of what was recorded.

    Args:
        reach: The robot, at the lift the map is for.
        grid: The cells.
        recording: Arm configurations; where no lift was recorded, it was that of `reach`.
        height: Height of the tool above the floor that counts [m]; None is any.
        height_margin: How far off it may be [m]; None is half a step.
        view_rule: How visibility is scored.

    Raises:
        DataFileError: If no sample is left.
        RobotError: If the robot has no head file.
        UnknownNameError: If there is no such rule.
        GridError: If there are more lifts than a map holds.

    Source:
        ITCM thesis section II.B and Appendix C.3, eqs. (23) to (25). Of the samples in a cell the
        one nearest to its centre counts: both distances, of position and of orientation, are
        stretched to 0 to 1 over all samples and multiplied.
    """
    seen_from(reach, grid, ITCM, view_rule)
    R_AT, p_AT = reach.tool_poses(recording.joints)
    R_BT = reach.R_BA @ R_AT
    p_BT = p_AT @ reach.R_BA.T + reach.p_BA
    kept = np.arange(len(recording))
    if height is not None:
        raised = 0.0 if recording.lift is None else recording.lift - reach.lift
        margin = 0.5 * grid.step if height_margin is None else height_margin
        kept = np.flatnonzero(np.abs(p_BT[:, 2] + raised - height) <= margin + _EDGE)
    off_height = len(recording) - len(kept)
    near = grid.nearest(R_BT[kept], p_BT[kept])
    angles = _roll_pitch_yaw(near.R_CT)
    on_grid = (np.abs(angles) <= 0.5 * grid.turn + _EDGE).all(axis=1)
    kept, near, angles = kept[on_grid], _rows(near, on_grid), angles[on_grid]
    if not len(kept):
        at = "" if height is None else f" at a height of {height:g} m"
        raise DataFileError(
            f"none of the {len(recording)} samples holds the tool{at} within half a cell of the "
            "grid's tilts. Check height, lift, tool frame and grasps."
        )
    distance = _stretched(np.linalg.norm(near.offset, axis=1)) * _stretched(near.turn)
    keys = grid.keys(near.cells)
    order = np.lexsort((np.arange(len(keys)), distance, keys))
    _, first = np.unique(keys[order], return_index=True)
    rows = order[first]
    chosen = kept[rows]
    joints = recording.joints[chosen]
    capability = finished_map(
        reach, grid, ITCM, near.cells[rows], p_BT[chosen], reach.manipulability(joints), joints,
        view_rule, {"samples": len(recording), "height": height},
    )  # fmt: skip
    # It was held there, whatever our enclosing shapes say.
    here = np.uint32(1) << np.uint32(reach.level)
    capability = replace(capability, free_lifts=capability.free_lifts | here)
    offsets = np.abs(np.hstack([near.offset[rows], angles[rows]]))
    return Recorded(
        capability, len(recording), off_height, len(recording) - off_height - len(kept), offsets
    )


def _rows(near: NearestCells, rows: Any) -> NearestCells:
    return NearestCells(near.cells[rows], near.heading[rows], near.offset[rows], near.R_CT[rows])


def _stretched(values: FloatArray) -> FloatArray:
    """Return distances divided by the largest; the thesis stretches them to 0 to 1."""
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

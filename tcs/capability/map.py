"""Capability maps: the base poses from which one end-effector pose is reached, and their scores."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.capability.grid import CellArray, MapGrid
from tcs.errors import StoreError, UnknownNameError
from tcs.files.quantities import JOINT_POSITION, POSITION
from tcs.kernel.arrays import FloatArray

ICM, IHCM, ITCM = "ICM", "IHCM", "ITCM"
MAP_TYPES = (ICM, IHCM, ITCM)
"""Maps from inverse kinematics, from inverse kinematics with visibility, and from recordings."""

MAX_TORSO_HEIGHTS = 32
"""Greatest number of torso heights: each has a bit of a 32-bit integer."""

FIXED, SPREAD = "fixed", "thesis"
SCALES = (FIXED, SPREAD)
"""Scales of `CapabilityMap.score`."""


@dataclass(frozen=True, eq=False)
class CapabilityMap:
    """Cells of a grid with manipulability and visibility.

    A map is made at one torso height. The z of a cell is the height of the base above the floor at
    that torso height; with the torso raised by z, the base stands on the floor.
    """

    map_type: str
    """ "ICM", "IHCM" or "ITCM"."""
    grid: MapGrid
    cells: CellArray
    """Cells sorted by `grid.keys`, without repetitions, shape (n, 5)."""
    manipulability: NDArray[np.float32]
    """Manipulability of each cell, in [0, 1], shape (n,)."""
    visibility: NDArray[np.float32]
    """Visibility of the tool from each cell, in [0, 1], shape (n,)."""
    torso_heights: FloatArray
    """Checked torso heights [m], `grid.step` apart, one of them `torso_height`, shape (levels,)."""
    torso_height: float
    """Torso height at which the map was made [m]."""
    free_torso_heights: NDArray[np.uint32]
    """Bit i is set where the posture is free of contact at `torso_heights[i]`, shape (n,)."""
    manipulability_scale: float
    """Greatest manipulability of the arm, which scales the scores of all its maps."""
    metadata: Mapping[str, Any]
    """Origin of the map, such as robot, tool and measure, as plain containers."""
    joints: NDArray[np.float32]
    """Posture of each cell [rad], shape (n, 7), or (0, 7) if unknown."""

    def __post_init__(self) -> None:
        """Check that the fields agree, and make the arrays read-only.

        Raises:
            UnknownNameError: If there is no such map type.
            StoreError: If arrays contradict each other.
        """
        if self.map_type not in MAP_TYPES:
            raise UnknownNameError("map type", self.map_type, MAP_TYPES)
        n = len(self.cells)
        shapes = {
            "cells": (n, 5), "manipulability": (n,), "visibility": (n,), "free_torso_heights": (n,),
            "joints": (n if len(self.joints) else 0, 7),
        }  # fmt: skip
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise StoreError(f"capability map: {name} has a shape other than {shape}.")
        if n:
            tilt, yaw = self.cells[:, 0], self.cells[:, 4]
            if min(tilt.min(), yaw.min()) < 0 or yaw.max() >= self.grid.yaw_bins:
                raise StoreError("capability map: a cell is outside the grid.")
            farthest = float(np.abs(self.cells[:, 1:4]).max()) * self.grid.step
            POSITION.check((farthest,), "capability map: the coordinate of a cell", StoreError)
            if tilt.max() >= len(self.grid.tilts) or np.any(np.diff(self.keys) <= 0):
                raise StoreError("capability map: cells are not sorted, or outside the grid.")
        for name in ("manipulability", "visibility"):
            values = getattr(self, name)
            if not np.all((values >= 0.0) & (values <= 1.0)):
                raise StoreError(f"capability map: {name} is not within 0 to 1 everywhere.")
        if (
            not 1 <= len(self.torso_heights) <= MAX_TORSO_HEIGHTS
            or self.torso_height not in self.torso_heights
        ):
            raise StoreError("capability map: its torso height is not one of those checked.")
        where = "capability map: a torso height"
        JOINT_POSITION.check(self.torso_heights, where, StoreError)
        if not np.all(np.diff(self.torso_heights) > 0.0):
            raise StoreError("capability map: its torso heights are not ascending.")
        if not self.manipulability_scale > 0.0:
            raise StoreError("capability map: the manipulability scale must be positive.")
        for name in (*shapes, "torso_heights"):
            getattr(self, name).flags.writeable = False

    @cached_property
    def keys(self) -> NDArray[np.int64]:
        """Key of each cell, ascending, shape (n,)."""
        return self.grid.keys(self.cells)

    def score(self, scale: str = FIXED) -> FloatArray:
        """Return the scores of the cells, shape (n,).

        The score is the manipulability for an ICM, and the mean of manipulability and visibility
        for other types.

        Args:
            scale: "fixed": manipulability divided by the greatest of the arm, so that maps are
                comparable. "thesis": both scaled linearly to [0, 1] within this map, ITCM thesis
                section II.B and eq. (18).

        Raises:
            UnknownNameError: If there is no such scale.
        """
        if scale not in SCALES:
            raise UnknownNameError("scale", scale, SCALES)
        visible = self.visibility.astype(np.float64)
        if scale == FIXED:
            dexterity = np.minimum(self.manipulability / self.manipulability_scale, 1.0)
        else:
            dexterity, visible = _stretched(self.manipulability), _stretched(self.visibility)
        return np.asarray(
            dexterity if self.map_type == ICM else 0.5 * (dexterity + visible), dtype=np.float64
        )

    def rows_of(self, cells: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the row of each cell, -1 for cells that are not in the map, shape (n,)."""
        keys = self.grid.keys(cells)
        if not len(self.cells):
            return np.full(len(keys), -1)
        row = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        return np.where(self.keys[row] == keys, row, -1)

    def look_up(self, R_BT: FloatArray, p_BT: FloatArray) -> NDArray[np.int64]:
        """Return the rows of the cells nearest to tool poses in the base, -1 where there is none.

        This is the query of a forward reachability map.

        Args:
            R_BT: Tool orientations in B, shape (n, 3, 3).
            p_BT: Tool positions in B at the map's torso height [m], shape (n, 3).
        """
        return self.rows_of(self.grid.nearest(R_BT, p_BT).cells)

    def of_type(self, map_type: str) -> CapabilityMap:
        """Return the same map as another type; an IHCM is an ICM with visibility."""
        return replace(self, map_type=map_type)


def _stretched(values: NDArray[np.float32]) -> FloatArray:
    """Return values scaled linearly to [0, 1]; all 1 if they are equal."""
    if not values.size or values.max() == values.min():
        return np.ones(values.shape)
    low, high = float(values.min()), float(values.max())
    return np.asarray((values.astype(np.float64) - low) / (high - low))

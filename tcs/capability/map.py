"""A capability map: the base poses from which one end-effector pose is reached, and how well."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.capability.grid import CellArray, MapGrid
from tcs.errors import StoreError, UnknownNameError
from tcs.kernel.arrays import FloatArray

ICM, IHCM, ITCM = "ICM", "IHCM", "ITCM"
KINDS = (ICM, IHCM, ITCM)
"""From inverse kinematics; the same with visibility; from what was recorded."""

MAX_LIFTS = 32
"""Lifts are told apart by the bits of one number."""

FIXED, SPREAD = "fixed", "thesis"
SCALES = (FIXED, SPREAD)


@dataclass(frozen=True, eq=False)
class CapabilityMap:
    """Cells of a grid, with what makes a base pose a good one.

    A map is made at one lift. A cell's z says how high the base would stand at that lift; with the
    lift raised by as much, it stands on the floor.
    """

    kind: str
    """ "ICM", "IHCM" or "ITCM"."""
    grid: MapGrid
    cells: CellArray
    """Sorted by `grid.keys`, each once, shape (n, 5)."""
    manipulability: NDArray[np.float32]
    """Shape (n,)."""
    visibility: NDArray[np.float32]
    """Shape (n,)."""
    lifts: FloatArray
    """Lifts that were looked at [m], `grid.step` apart, one of them `lift`, shape (levels,)."""
    lift: float
    """The lift the map was made at [m]."""
    free_lifts: NDArray[np.uint32]
    """Bit i is set where the posture touches nothing at `lifts[i]`, shape (n,)."""
    manipulability_scale: float
    """What counts as full manipulability: the best of the arm, the same for all its maps."""
    metadata: Mapping[str, Any]
    """Robot, tool, measure and so on, as plain containers."""
    joints: NDArray[np.float32]
    """Arm joints behind each cell [rad], shape (n, 7), or (0, 7) where they are not known."""

    def __post_init__(self) -> None:
        """Check the parts against each other, and make the arrays read-only.

        Raises:
            UnknownNameError: If there is no such kind of map.
            StoreError: If arrays contradict each other.
        """
        if self.kind not in KINDS:
            raise UnknownNameError("kind of map", self.kind, KINDS)
        n = len(self.cells)
        shapes = {
            "cells": (n, 5), "manipulability": (n,), "visibility": (n,), "free_lifts": (n,),
            "joints": (n if len(self.joints) else 0, 7),
        }  # fmt: skip
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise StoreError(f"capability map: {name} has a shape other than {shape}.")
        if n:
            tilt, yaw = self.cells[:, 0], self.cells[:, 4]
            if min(tilt.min(), yaw.min()) < 0 or yaw.max() >= self.grid.turns:
                raise StoreError("capability map: a cell is outside the grid.")
            if tilt.max() >= len(self.grid.tilts) or np.any(np.diff(self.keys) <= 0):
                raise StoreError("capability map: cells are not sorted, or outside the grid.")
        for name in ("manipulability", "visibility"):
            values = getattr(self, name)
            if not np.all((values >= 0.0) & (values <= 1.0)):
                raise StoreError(f"capability map: {name} is not within 0 to 1 everywhere.")
        if not 1 <= len(self.lifts) <= MAX_LIFTS or self.lift not in self.lifts:
            raise StoreError("capability map: its lift is none of those looked at.")
        if not self.manipulability_scale > 0.0:
            raise StoreError("capability map: the scale of manipulability must be positive.")
        for name in (*shapes, "lifts"):
            getattr(self, name).flags.writeable = False

    @cached_property
    def keys(self) -> NDArray[np.int64]:
        """One number for each cell, ascending, shape (n,)."""
        return self.grid.keys(self.cells)

    def score(self, scale: str = FIXED) -> FloatArray:
        """Return what cells are ranked by, shape (n,).

        An ICM counts manipulability alone, the others the mean of it and visibility.

        Args:
            scale: "fixed": manipulability by the arm's best, so that maps compare. "thesis": both
                stretched to fill 0 to 1 within this map, ITCM thesis section II.B and eq. (18).

        Raises:
            UnknownNameError: If there is no such scale.
        """
        if scale not in SCALES:
            raise UnknownNameError("scale", scale, SCALES)
        seen = self.visibility.astype(np.float64)
        if scale == FIXED:
            able = np.minimum(self.manipulability / self.manipulability_scale, 1.0)
        else:
            able, seen = _stretched(self.manipulability), _stretched(self.visibility)
        return np.asarray(able if self.kind == ICM else 0.5 * (able + seen), dtype=np.float64)

    def rows_of(self, cells: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the row of each cell, -1 where the map does not hold it, shape (n,)."""
        asked = self.grid.keys(cells)
        if not len(self.cells):
            return np.full(len(asked), -1)
        row = np.minimum(np.searchsorted(self.keys, asked), len(self.keys) - 1)
        return np.where(self.keys[row] == asked, row, -1)

    def look_up(self, R_BT: FloatArray, p_BT: FloatArray) -> NDArray[np.int64]:
        """Return the row of the nearest cell of tool poses in the base, -1 where there is none.

        "How well can this pose be reached from here?", as forward reachability maps are asked.

        Args:
            R_BT: Tool orientations in B, shape (n, 3, 3).
            p_BT: Tool positions in B at the map's lift [m], shape (n, 3).
        """
        return self.rows_of(self.grid.nearest(R_BT, p_BT).cells)

    def of_kind(self, kind: str) -> CapabilityMap:
        """Return the same map under another kind; an IHCM is an ICM that counts visibility."""
        return replace(self, kind=kind)


def _stretched(values: NDArray[np.float32]) -> FloatArray:
    """Return values stretched to fill 0 to 1; all 1 where they are equal."""
    if not values.size or values.max() == values.min():
        return np.ones(values.shape)
    low, high = float(values.min()), float(values.max())
    return np.asarray((values.astype(np.float64) - low) / (high - low))

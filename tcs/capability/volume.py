"""A map as dense arrays, so that maps of several tool poses combine by slicing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.capability.grid import TILT, YAW, X, Y, Z
from tcs.capability.map import FIXED, CapabilityMap
from tcs.errors import SelectionError
from tcs.files.quantities import VOLUME
from tcs.kernel.arrays import FloatArray, IntArray

_WHOLE = 1e-6
"""Tolerance of whole cells and levels [steps]."""


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle of base positions on the grid of the task: corner and size, in cells."""

    x: int
    y: int
    width: int
    depth: int

    @classmethod
    def shared(cls, boxes: Sequence[Box]) -> Box | None:
        """Return the intersection of boxes, None if it is empty."""
        x, y = max(b.x for b in boxes), max(b.y for b in boxes)
        width = min(b.x + b.width for b in boxes) - x
        depth = min(b.y + b.depth for b in boxes) - y
        return cls(x, y, width, depth) if min(width, depth) > 0 else None

    @classmethod
    def union(cls, boxes: Sequence[Box]) -> Box:
        """Return the smallest box around all boxes."""
        x, y = min(b.x for b in boxes), min(b.y for b in boxes)
        width = max(b.x + b.width for b in boxes) - x
        return cls(x, y, width, max(b.y + b.depth for b in boxes) - y)


@dataclass(frozen=True, slots=True)
class Nearness:
    """Largest distances between tool poses and their nearest cells."""

    offset: float
    """Largest offset along x, y or z [m]."""
    angle: float
    """Largest angle of tilt and heading together, an upper bound [rad]."""

    @classmethod
    def worst(cls, several: Sequence[Nearness]) -> Nearness:
        """Return the largest offset and the largest angle."""
        return cls(max(n.offset for n in several), max(n.angle for n in several))


@dataclass(frozen=True, slots=True)
class _Layer:
    """One tilt of a map over z, x, y and yaw."""

    score: NDArray[np.float32]
    """NaN where there is no cell."""
    free: NDArray[np.uint32]
    """Bit i is set where the posture is free at the i-th torso height."""


class MapVolume:
    """Scores of a map in arrays over z, x, y and yaw, one array per tilt."""

    def __init__(self, capability: CapabilityMap, scale: str = FIXED) -> None:
        """Score the map; the arrays of a tilt are filled at their first use.

        Args:
            capability: The map.
            scale: See `CapabilityMap.score`.
        """
        self.capability, self.scale = capability, scale
        cells = capability.cells
        self._score = capability.score(scale).astype(np.float32)
        self._low = cells.min(axis=0) if len(cells) else np.zeros(5, np.int32)
        self._high = cells.max(axis=0) if len(cells) else np.zeros(5, np.int32)
        self._far = float(np.hypot(cells[:, X], cells[:, Y]).max(initial=0.0))
        self._of_tilt: dict[int, _Layer] = {}

    def box_about(self, x: float, y: float) -> Box:
        """Return a box of all base positions that may reach a tool at (x, y) [m]."""
        step = self.capability.grid.step
        # Covers every heading of the map about the tool; one more cell for rounding.
        far = math.ceil(self._far) + 1
        return Box(round(x / step) - far, round(y / step) - far, 2 * far + 1, 2 * far + 1)

    def scores(
        self, R_FT: FloatArray, p_FT: FloatArray, box: Box, torso_heights: FloatArray
    ) -> tuple[NDArray[np.float32], Nearness]:
        """Return the scores of base poses for one tool pose, NaN where it is not reached.

        Args:
            R_FT: Orientation of the tool in the task frame, shape (3, 3).
            p_FT: Position of the tool, z above the floor [m], shape (3,).
            box: Base positions.
            torso_heights: Torso heights [m].

        Returns:
            Scores of shape (torso heights, box width, box depth, yaws), and distances to the cells.
        """
        grid = self.capability.grid
        tilts, headings = grid.nearest_tilts(R_FT[None])
        tilt, heading = int(tilts[0]), float(headings[0])
        c, s = math.cos(heading), math.sin(heading)
        # Positions of the box in E.
        dx = (box.x + np.arange(box.width)) * grid.step - p_FT[0]
        dy = (box.y + np.arange(box.depth)) * grid.step - p_FT[1]
        along = (c * dx[:, None] + s * dy[None, :]) / grid.step
        across = (-s * dx[:, None] + c * dy[None, :]) / grid.step
        up = (torso_heights - self.capability.torso_height - p_FT[2]) / grid.step
        i, j, level = (np.floor(u + 0.5 + _WHOLE).astype(np.int64) for u in (along, across, up))
        shift = -heading / grid.yaw_step
        shift_bins = math.floor(shift + 0.5 + _WHOLE)
        off_tilt = R_FT - np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ grid.R_ET[tilt]
        angle = 2.0 * math.asin(min(1.0, float(np.linalg.norm(off_tilt)) / math.sqrt(8.0)))
        offset = max(float(np.abs(u).max()) for u in (along - i, across - j, up - level))
        nearness = Nearness(
            _clean(offset * grid.step), _clean(angle + abs(shift - shift_bins) * grid.yaw_step)
        )
        return self._gathered(tilt, level, i, j, shift_bins, torso_heights), nearness

    def _gathered(
        self,
        tilt: int,
        level: IntArray,
        i: IntArray,
        j: IntArray,
        shift_bins: int,
        torso_heights: FloatArray,
    ) -> NDArray[np.float32]:
        """Return the scores of cells of one tilt, NaN where there is no cell.

        Args:
            tilt: The tilt.
            level: z of the cells, shape (torso heights,).
            i: x of the cells, shape (width, depth).
            j: y of the cells, shape (width, depth).
            shift_bins: Yaw bin of the map that becomes yaw 0.
            torso_heights: Torso heights of `level` [m].
        """
        layer = self._layer(tilt)
        shape = (len(level), *i.shape, self.capability.grid.yaw_bins)
        values = np.full(shape, np.nan, np.float32)
        inside = (i >= self._low[X]) & (i <= self._high[X])
        inside &= (j >= self._low[Y]) & (j <= self._high[Y])
        a, b = np.nonzero(inside)
        x, y = i[a, b] - self._low[X], j[a, b] - self._low[Y]
        for row in np.flatnonzero((level >= self._low[Z]) & (level <= self._high[Z])):
            z = level[row] - self._low[Z]
            found = layer.score[z][x, y]
            bits = self._bits(float(torso_heights[row]))
            found[(layer.free[z][x, y] & bits) != bits] = np.nan
            values[row, a, b] = np.roll(found, -shift_bins, axis=1)
        return values

    def _bits(self, torso_height: float) -> np.uint32:
        """Return the bits of the checked torso heights on both sides of a torso height."""
        torso_heights = self.capability.torso_heights
        at = (torso_height - torso_heights[0]) / self.capability.grid.step
        most = len(torso_heights) - 1
        low, high = math.floor(at + _WHOLE), math.ceil(at - _WHOLE)
        return np.uint32((1 << min(max(low, 0), most)) | (1 << min(max(high, 0), most)))

    def _layer(self, tilt: int) -> _Layer:
        if tilt not in self._of_tilt:
            cells = self.capability.cells
            rows = np.flatnonzero(cells[:, TILT] == tilt)
            z, x, y = (cells[rows, column] - self._low[column] for column in (Z, X, Y))
            size = self._high - self._low + 1
            shape = (*size[[Z, X, Y]].tolist(), self.capability.grid.yaw_bins)
            check_volume(shape)
            layer = _Layer(np.full(shape, np.nan, np.float32), np.zeros(shape, np.uint32))
            layer.score[z, x, y, cells[rows, YAW]] = self._score[rows]
            layer.free[z, x, y, cells[rows, YAW]] = self.capability.free_torso_heights[rows]
            self._of_tilt[tilt] = layer
        return self._of_tilt[tilt]


def check_volume(shape: Sequence[int]) -> None:
    """Refuse an array of cells that would fill the memory.

    Raises:
        SelectionError: If it has more than `VOLUME` cells.
    """
    VOLUME.check((math.prod(shape),), "the size of the map, as an array,", SelectionError)


def _clean(value: float) -> float:
    """Return the value, or 0 if it is 0 within rounding."""
    return 0.0 if value < _WHOLE else value

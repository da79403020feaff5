"""A map spread out over its grid, so that maps of several tool poses meet by plain slicing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.capability.grid import TILT, YAW, X, Y, Z
from tcs.capability.map import FIXED, CapabilityMap
from tcs.kernel.arrays import FloatArray, IntArray

_WHOLE = 1e-6
"""Coordinates this close to whole cells, or levels, are on them."""


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle of base places on the task's grid: corner and size, in cells."""

    x: int
    y: int
    width: int
    depth: int

    @classmethod
    def shared(cls, boxes: Sequence[Box]) -> Box | None:
        """Return what all boxes have in common, None if nothing."""
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
    """How far tool poses are from the cells that stood in for them."""

    offset: float
    """Farthest along x, y or z [m]."""
    turn: float
    """Largest angle of tilt and heading together, an upper bound [rad]."""

    @classmethod
    def worst(cls, several: Sequence[Nearness]) -> Nearness:
        """Return the largest of each."""
        return cls(max(n.offset for n in several), max(n.turn for n in several))


@dataclass(frozen=True, slots=True)
class _Spread:
    """One tilt of a map over z, x, y and yaw."""

    score: NDArray[np.float32]
    """NaN where there is no cell."""
    free: NDArray[np.uint32]
    """Free lifts as bits."""


class MapVolume:
    """A map's scores in arrays over z, x, y and yaw, one array per tilt."""

    def __init__(self, capability: CapabilityMap, scale: str = FIXED) -> None:
        """Score the map; arrays of a tilt are made when it is first asked for.

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
        self._of_tilt: dict[int, _Spread] = {}

    def box_about(self, x: float, y: float) -> Box:
        """Return the base places from which a tool at (x, y) [m] may be reached at all."""
        step = self.capability.grid.step
        # However the map is turned about the tool; one more for the rounding.
        far = math.ceil(self._far) + 1
        return Box(round(x / step) - far, round(y / step) - far, 2 * far + 1, 2 * far + 1)

    def scores(
        self, R_FT: FloatArray, p_FT: FloatArray, box: Box, lifts: FloatArray
    ) -> tuple[NDArray[np.float32], Nearness]:
        """Return the scores of base poses for one tool pose, NaN where it is not reached.

        Args:
            R_FT: Orientation of the tool in the task frame, shape (3, 3).
            p_FT: Its place, z above the floor [m], shape (3,).
            box: Base places.
            lifts: Lifts [m].

        Returns:
            Scores of shape (lifts, box width, box depth, yaws), and how near the cells are.
        """
        grid = self.capability.grid
        tilts, headings = grid.nearest_tilts(R_FT[None])
        tilt, heading = int(tilts[0]), float(headings[0])
        c, s = math.cos(heading), math.sin(heading)
        # Where each place of the box lies in E.
        dx = (box.x + np.arange(box.width)) * grid.step - p_FT[0]
        dy = (box.y + np.arange(box.depth)) * grid.step - p_FT[1]
        along = (c * dx[:, None] + s * dy[None, :]) / grid.step
        across = (-s * dx[:, None] + c * dy[None, :]) / grid.step
        up = (lifts - self.capability.lift - p_FT[2]) / grid.step
        i, j, level = (np.floor(u + 0.5 + _WHOLE).astype(np.int64) for u in (along, across, up))
        shift = -heading / grid.turn
        turns = math.floor(shift + 0.5 + _WHOLE)
        off_tilt = R_FT - np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ grid.R_ET[tilt]
        angle = 2.0 * math.asin(min(1.0, float(np.linalg.norm(off_tilt)) / math.sqrt(8.0)))
        offset = max(float(np.abs(u).max()) for u in (along - i, across - j, up - level))
        nearness = Nearness(
            _clean(offset * grid.step), _clean(angle + abs(shift - turns) * grid.turn)
        )
        return self._gathered(tilt, level, i, j, turns, lifts), nearness

    def _gathered(
        self, tilt: int, level: IntArray, i: IntArray, j: IntArray, turns: int, lifts: FloatArray
    ) -> NDArray[np.float32]:
        """Return cells of one tilt, NaN where there is none.

        Args:
            tilt: The tilt.
            level: z of the cells, shape (lifts,).
            i: x of the cells, shape (width, depth).
            j: y of the cells, shape (width, depth).
            turns: Yaw of the cell that yaw 0 stands for.
            lifts: Lifts that belong to `level` [m].
        """
        spread = self._spread(tilt)
        shape = (len(level), *i.shape, self.capability.grid.turns)
        values = np.full(shape, np.nan, np.float32)
        inside = (i >= self._low[X]) & (i <= self._high[X])
        inside &= (j >= self._low[Y]) & (j <= self._high[Y])
        a, b = np.nonzero(inside)
        x, y = i[a, b] - self._low[X], j[a, b] - self._low[Y]
        for row in np.flatnonzero((level >= self._low[Z]) & (level <= self._high[Z])):
            z = level[row] - self._low[Z]
            found = spread.score[z][x, y]
            bits = self._bits(float(lifts[row]))
            found[(spread.free[z][x, y] & bits) != bits] = np.nan
            values[row, a, b] = np.roll(found, -turns, axis=1)
        return values

    def _bits(self, lift: float) -> np.uint32:
        """Return the lifts looked at next to a lift, on both sides, as bits."""
        lifts = self.capability.lifts
        at = (lift - lifts[0]) / self.capability.grid.step
        most = len(lifts) - 1
        low, high = math.floor(at + _WHOLE), math.ceil(at - _WHOLE)
        return np.uint32((1 << min(max(low, 0), most)) | (1 << min(max(high, 0), most)))

    def _spread(self, tilt: int) -> _Spread:
        if tilt not in self._of_tilt:
            cells = self.capability.cells
            rows = np.flatnonzero(cells[:, TILT] == tilt)
            z, x, y = (cells[rows, column] - self._low[column] for column in (Z, X, Y))
            size = self._high - self._low + 1
            shape = (size[Z], size[X], size[Y], self.capability.grid.turns)
            spread = _Spread(np.full(shape, np.nan, np.float32), np.zeros(shape, np.uint32))
            spread.score[z, x, y, cells[rows, YAW]] = self._score[rows]
            spread.free[z, x, y, cells[rows, YAW]] = self.capability.free_lifts[rows]
            self._of_tilt[tilt] = spread
        return self._of_tilt[tilt]


def _clean(value: float) -> float:
    """Return 0 for what rounding leaves of it."""
    return 0.0 if value < _WHOLE else value

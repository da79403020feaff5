"""The grid of base poses seen from an end-effector pose: integer cells and what they stand for.

Frames: W world, z up; T the tool; B the robot's base, which stands upright. E is the level frame
at the tool: its origin is that of T, its z axis points up, and it has the tool's heading. How T
lies in E is its tilt, R_ET = Ry(pitch) Rx(roll): none for a side grasp, pitch 90 deg for a top
grasp. In E an upright base has four coordinates, x, y, z and yaw. As quarter turns and multiples of
the step bring E's grid to itself, maps of several tool poses meet cell on cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.errors import GridError, UnknownNameError
from tcs.kernel.arrays import FloatArray

CellArray = NDArray[np.int32]
TILT, X, Y, Z, YAW = range(5)
"""Columns of a cell."""

SIDE, TOP = "side", "top"
GRASPS = (SIDE, TOP, "side+top", "all")
"""Named choices of tilts."""

_BITS = {TILT: 12, X: 13, Y: 13, Z: 13, YAW: 10}
_HALF = 1 << 12
"""Cells count to this many either way along x, y and z."""
_CHUNK = 20_000
"""Poses whose tilt is looked for at once: some tens of MB of scratch."""


@dataclass(frozen=True, slots=True)
class NearestCells:
    """The cells nearest to poses, and how far off they are."""

    cells: CellArray
    """Shape (n, 5)."""
    heading: FloatArray
    """Heading of E in W that goes with the tilt [rad], shape (n,)."""
    offset: FloatArray
    """From the centre of the cell to the base, in E [m], shape (n, 3)."""
    R_CT: FloatArray
    """From the tool orientation of the cell to that of the pose, shape (n, 3, 3)."""

    @property
    def turn(self) -> FloatArray:
        """Angle of that rotation [rad], shape (n,)."""
        return angle_of(self.R_CT)


@dataclass(frozen=True)
class MapGrid:
    """Which base poses a map tells apart.

    >>> MapGrid.of(0.05, 16, "side+top").tilts
    ((0, 0), (4, 0))
    """

    step: float
    """Distance of neighbours along x, y and z [m]."""
    turns: int
    """Headings in a full turn; a multiple of 4."""
    tilts: tuple[tuple[int, int], ...]
    """Pitch and roll of the tool in E for each tilt, in turns of 2 pi / `turns`."""

    def __post_init__(self) -> None:
        """Refuse what is no grid.

        Raises:
            GridError: If a number is out of range or a tilt comes twice.
        """
        if not (math.isfinite(self.step) and 0.001 <= self.step <= 1.0):
            raise GridError(f"the map's step is {self.step!r} m; must be from 0.001 to 1.")
        if self.turns % 4 or not 4 <= self.turns < 1 << _BITS[YAW]:
            raise GridError(
                f"the map has {self.turns} headings; must be a multiple of 4 from 4 to "
                f"{(1 << _BITS[YAW]) - 4}, e.g. 16 for 22.5 deg."
            )
        if not self.tilts or len(set(self.tilts)) < len(self.tilts):
            raise GridError("the map has no tilt of the tool, or one twice.")
        if len(self.tilts) >= 1 << _BITS[TILT]:
            raise GridError(
                f"the map has {len(self.tilts)} tilts; {1 << _BITS[TILT]} are too many."
            )

    @classmethod
    def of(cls, step: float = 0.05, turns: int = 16, grasps: str = "side+top") -> MapGrid:
        """Return a grid with a named choice of tilts.

        Args:
            step: Distance of neighbours [m].
            turns: Headings in a full turn.
            grasps: "side", "top", "side+top" or "all".

        Raises:
            UnknownNameError: If there is no such choice.
            GridError: If a number is out of range.
        """
        if grasps not in GRASPS:
            raise UnknownNameError("choice of grasps", grasps, GRASPS)
        quarter = turns // 4
        if grasps == "all":
            # Up, as the tool sees it, on circles of latitude; straight along x it has no roll.
            level = [(p, r) for p in range(1 - quarter, quarter) for r in range(turns)]
            return cls(step, turns, ((-quarter, 0), *level, (quarter, 0)))
        named = {SIDE: (0, 0), TOP: (quarter, 0)}
        return cls(step, turns, tuple(named[name] for name in grasps.split("+")))

    @property
    def turn(self) -> float:
        """Angle between neighbouring headings [rad]."""
        return 2.0 * math.pi / self.turns

    @cached_property
    def R_ET(self) -> FloatArray:
        """Orientation of the tool in E for each tilt, shape (tilts, 3, 3)."""
        angles = np.array(self.tilts) * self.turn
        (cp, cr), (sp, sr) = np.cos(angles).T, np.sin(angles).T
        zero = np.zeros_like(cp)
        rows = [[cp, sp * sr, sp * cr], [zero, cr, -sr], [-sp, cp * sr, cp * cr]]
        # A quarter turn has a cosine of 6e-17, which would show in exported files.
        R = np.array(rows).transpose(2, 0, 1)
        R[np.abs(R) < 1e-15] = 0.0
        return R

    def keys(self, cells: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return one number for each cell, shape (n,); they sort as the columns do.

        Raises:
            GridError: If a cell lies farther out than numbers go.
        """
        wide = np.asarray(cells, dtype=np.int64)
        if wide.size and np.abs(wide[:, X:YAW]).max() >= _HALF:
            raise GridError(f"the map reaches beyond {_HALF} cells of {self.step:g} m.")
        key = wide[:, TILT]
        for column in (X, Y, Z):
            key = (key << _BITS[column]) | (wide[:, column] + _HALF)
        return (key << _BITS[YAW]) | wide[:, YAW]

    def cells_of(self, keys: NDArray[np.int64]) -> CellArray:
        """Return the cells of numbers that `keys` gave, shape (n, 5)."""
        rest = np.asarray(keys, dtype=np.int64)
        cells = np.empty((len(rest), 5), np.int32)
        for column in (YAW, Z, Y, X):
            value = rest & ((1 << _BITS[column]) - 1)
            cells[:, column] = value if column == YAW else value - _HALF
            rest = rest >> _BITS[column]
        cells[:, TILT] = rest
        return cells

    def base_in_level_frame(self, cells: NDArray[np.integer]) -> tuple[FloatArray, FloatArray]:
        """Return positions in E [m], shape (n, 3), and yaws [rad], shape (n,), of cells."""
        wide = cells.astype(np.float64)
        return wide[:, X:YAW] * self.step, wide[:, YAW] * self.turn

    def tool_in_base(self, cells: NDArray[np.integer]) -> tuple[FloatArray, FloatArray]:
        """Return X_BT of cells: rotations (n, 3, 3) and positions [m] (n, 3)."""
        p_EB, yaw = self.base_in_level_frame(cells)
        R_BE = np.swapaxes(yaw_rotation(yaw), 1, 2)
        return R_BE @ self.R_ET[cells[:, TILT]], -np.einsum("nij,nj->ni", R_BE, p_EB)

    def base_in_tool(self, cells: NDArray[np.integer]) -> tuple[FloatArray, FloatArray]:
        """Return X_TB of cells: rotations (n, 3, 3) and positions [m] (n, 3)."""
        p_EB, yaw = self.base_in_level_frame(cells)
        R_TE = np.swapaxes(self.R_ET, 1, 2)[cells[:, TILT]]
        return R_TE @ yaw_rotation(yaw), np.einsum("nij,nj->ni", R_TE, p_EB)

    def nearest(self, R_BT: FloatArray, p_BT: FloatArray) -> NearestCells:
        """Return the cells nearest to tool poses in the base.

        Args:
            R_BT: Orientations, shape (n, 3, 3).
            p_BT: Positions [m], shape (n, 3).
        """
        tilt, heading = self.nearest_tilts(R_BT)
        R_EB = np.swapaxes(yaw_rotation(heading), 1, 2)
        p_EB = -np.einsum("nij,nj->ni", R_EB, p_BT)
        xyz = np.floor(p_EB / self.step + 0.5)
        yaw = np.floor(-heading / self.turn + 0.5)
        cells = np.column_stack([tilt, xyz, yaw % self.turns]).astype(np.int32)
        # The cell's own tool orientation beside the real one.
        R_BC = np.swapaxes(yaw_rotation(yaw * self.turn), 1, 2) @ self.R_ET[tilt]
        R_CT = np.swapaxes(R_BC, 1, 2) @ R_BT
        return NearestCells(cells, heading, p_EB - xyz * self.step, R_CT)

    def nearest_tilts(self, R_WT: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """Return the tilt of the least rotation to each tool orientation, and the heading of E.

        Args:
            R_WT: Orientations in any frame with z up, shape (n, 3, 3).

        Returns:
            Tilts, and headings [rad] in (-pi, pi], both of shape (n,).
        """
        tilt = np.empty(len(R_WT), np.int64)
        heading = np.empty(len(R_WT))
        # R_WT = Rz(psi) R_ET D: the trace of D is greatest over psi in closed form. Of the product
        # R_WT R_ET^T it needs five entries, in three sums over products of entries.
        first, second, third = self.R_ET[:, 0].T, self.R_ET[:, 1].T, self.R_ET[:, 2].T
        for start in range(0, len(R_WT), _CHUNK):
            part = slice(start, start + _CHUNK)
            x, y, z = (np.ascontiguousarray(R_WT[part, row]) for row in range(3))
            along, across = x @ first + y @ second, y @ first - x @ second
            best = np.argmax(z @ third + np.hypot(along, across), axis=1)
            rows = np.arange(len(best))
            tilt[part] = best
            heading[part] = np.arctan2(across[rows, best], along[rows, best])
        return tilt, heading


def yaw_rotation(yaw: FloatArray) -> FloatArray:
    """Return rotations about z, shape (n, 3, 3), by angles [rad], shape (n,)."""
    c, s = np.cos(yaw), np.sin(yaw)
    R = np.zeros((len(yaw), 3, 3))
    R[:, 0, 0], R[:, 0, 1], R[:, 1, 0], R[:, 1, 1], R[:, 2, 2] = c, -s, s, c, 1.0
    return R


def angle_of(R: FloatArray) -> FloatArray:
    """Return the angles of rotations [rad], shape (n,), from matrices of shape (n, 3, 3)."""
    # By the distance from the identity: the arc cosine of the trace is blunt at small angles.
    gap = np.linalg.norm(R - np.eye(3), axis=(1, 2)) / math.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.clip(gap, 0.0, 1.0)))

"""The grid of base poses relative to an end-effector pose: integer cells and their poses.

Frames: W world, z up; T the tool; B the robot's base, upright. E is the level frame at the tool:
its origin is that of T, its z axis points up, and its heading is that of the tool. The tilt of the
tool is its orientation in E, R_ET = Ry(pitch) Rx(roll): zero for a side grasp, 90 deg of pitch for
a top grasp. In E an upright base has four coordinates, x, y, z and yaw. Rotations by 90 deg and
translations by multiples of the step map the grid of E to itself, so the cells of maps of several
tool poses coincide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.errors import GridError, UnknownNameError
from tcs.files.quantities import MAP_STEP
from tcs.kernel.arrays import FloatArray

CellArray = NDArray[np.int32]
TILT, X, Y, Z, YAW = range(5)
"""Columns of a cell array."""

SIDE, TOP = "side", "top"
GRASPS = (SIDE, TOP, "side+top", "all")
"""Named sets of tilts."""

_BITS = {TILT: 12, X: 13, Y: 13, Z: 13, YAW: 10}
_HALF = 1 << 12
"""Cell coordinates along x, y and z are less than this in magnitude."""
_CHUNK = 20_000
"""Poses whose nearest tilt is computed at once, with some tens of MB of scratch."""


@dataclass(frozen=True, slots=True)
class NearestCells:
    """The cells nearest to poses, and the differences."""

    cells: CellArray
    """Shape (n, 5)."""
    heading: FloatArray
    """Heading of E in W for that tilt [rad], shape (n,)."""
    offset: FloatArray
    """Position of the base relative to the centre of the cell, in E [m], shape (n, 3)."""
    R_CT: FloatArray
    """Orientation of the tool relative to that of the cell, shape (n, 3, 3)."""

    @property
    def angle(self) -> FloatArray:
        """Angle of `R_CT` [rad], shape (n,)."""
        return angle_of(self.R_CT)


def _check_yaw_bins(yaw_bins: int) -> None:
    """Raise for a number of yaw bins that a map cannot have."""
    if yaw_bins % 4 or not 4 <= yaw_bins < 1 << _BITS[YAW]:
        raise GridError(
            f"the map has {yaw_bins} yaw bins; must be a multiple of 4 from 4 to "
            f"{(1 << _BITS[YAW]) - 4}, e.g. 16 for 22.5 deg."
        )


@dataclass(frozen=True)
class MapGrid:
    """Discretisation of base poses and tool tilts.

    >>> MapGrid.of(0.05, 16, "side+top").tilts
    ((0, 0), (4, 0))
    """

    step: float
    """Distance between neighbours along x, y and z [m]."""
    yaw_bins: int
    """Number of yaws in 360 deg; a multiple of 4."""
    tilts: tuple[tuple[int, int], ...]
    """Pitch and roll of the tool in E for each tilt, in multiples of 2 pi / `yaw_bins`."""

    def __post_init__(self) -> None:
        """Validate the numbers.

        Raises:
            GridError: If a number is out of range or a tilt comes twice.
        """
        if not MAP_STEP.admits(self.step):
            raise GridError(f"the step of the map is {self.step!r} m; must be {MAP_STEP.span}.")
        _check_yaw_bins(self.yaw_bins)
        if not self.tilts or len(set(self.tilts)) < len(self.tilts):
            raise GridError("the map has no tilt of the tool, or a tilt twice.")
        if len(self.tilts) >= 1 << _BITS[TILT]:
            raise GridError(
                f"the map has {len(self.tilts)} tilts; must be at most {(1 << _BITS[TILT]) - 1}."
            )
        if any(abs(bins) > self.yaw_bins for tilt in self.tilts for bins in tilt):
            raise GridError(
                "the map has a tilt with pitch or roll beyond one turn; in yaw steps they must be "
                f"-{self.yaw_bins} to {self.yaw_bins}."
            )

    @classmethod
    def of(cls, step: float = 0.05, yaw_bins: int = 16, grasps: str = "side+top") -> MapGrid:
        """Return a grid with a named set of tilts.

        Args:
            step: Distance between neighbours [m].
            yaw_bins: Number of yaws in 360 deg.
            grasps: "side", "top", "side+top" or "all".

        Raises:
            UnknownNameError: If there is no such set of tilts.
            GridError: If a number is out of range.
        """
        if grasps not in GRASPS:
            raise UnknownNameError("set of grasps", grasps, GRASPS)
        # Before the tilts are listed: there are as many as the square of the bins.
        _check_yaw_bins(yaw_bins)
        quarter = yaw_bins // 4
        if grasps == "all":
            # Circles of latitude of the vertical in the tool frame; at the poles roll equals yaw.
            level = [(p, r) for p in range(1 - quarter, quarter) for r in range(yaw_bins)]
            return cls(step, yaw_bins, ((-quarter, 0), *level, (quarter, 0)))
        named = {SIDE: (0, 0), TOP: (quarter, 0)}
        return cls(step, yaw_bins, tuple(named[name] for name in grasps.split("+")))

    @property
    def yaw_step(self) -> float:
        """Angle between neighbouring yaws [rad]."""
        return 2.0 * math.pi / self.yaw_bins

    @cached_property
    def R_ET(self) -> FloatArray:
        """Orientation of the tool in E for each tilt, shape (tilts, 3, 3)."""
        angles = np.array(self.tilts) * self.yaw_step
        (cp, cr), (sp, sr) = np.cos(angles).T, np.sin(angles).T
        zero = np.zeros_like(cp)
        rows = [[cp, sp * sr, sp * cr], [zero, cr, -sr], [-sp, cp * sr, cp * cr]]
        # The cosine of 90 deg is 6e-17 in floating point, which would show in exported files.
        R = np.array(rows).transpose(2, 0, 1)
        R[np.abs(R) < 1e-15] = 0.0
        return R

    def keys(self, cells: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return an integer key for each cell, shape (n,); keys sort as the columns do.

        Raises:
            GridError: If a cell is beyond the range of the keys.
        """
        wide = np.asarray(cells, dtype=np.int64)
        if wide.size and np.abs(wide[:, X:YAW]).max() >= _HALF:
            raise GridError(f"the map reaches beyond {_HALF} cells of {self.step:g} m.")
        key = wide[:, TILT]
        for column in (X, Y, Z):
            key = (key << _BITS[column]) | (wide[:, column] + _HALF)
        return (key << _BITS[YAW]) | wide[:, YAW]

    def cells_of(self, keys: NDArray[np.int64]) -> CellArray:
        """Return the cells of `keys`, shape (n, 5)."""
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
        return wide[:, X:YAW] * self.step, wide[:, YAW] * self.yaw_step

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
        yaw = np.floor(-heading / self.yaw_step + 0.5)
        cells = np.column_stack([tilt, xyz, yaw % self.yaw_bins]).astype(np.int32)
        # The tool orientation of the cell.
        R_BC = np.swapaxes(yaw_rotation(yaw * self.yaw_step), 1, 2) @ self.R_ET[tilt]
        R_CT = np.swapaxes(R_BC, 1, 2) @ R_BT
        return NearestCells(cells, heading, p_EB - xyz * self.step, R_CT)

    def nearest_tilts(self, R_WT: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """Return the tilt nearest to each tool orientation, and the heading of E.

        Args:
            R_WT: Orientations in any frame with z up, shape (n, 3, 3).

        Returns:
            Tilts, and headings [rad] in (-pi, pi], both of shape (n,).
        """
        tilt = np.empty(len(R_WT), np.int64)
        heading = np.empty(len(R_WT))
        # With R_WT = Rz(psi) R_ET D, the greatest trace of D over psi has a closed form in five
        # entries of R_WT R_ET^T.
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
    # From the distance to the identity: the arc cosine of the trace is inaccurate at small angles.
    gap = np.linalg.norm(R - np.eye(3), axis=(1, 2)) / math.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.clip(gap, 0.0, 1.0)))

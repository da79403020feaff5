"""Capability maps as text: the file format of the ITCM thesis, and tables of base poses."""

from __future__ import annotations

import os
from importlib.metadata import version
from pathlib import Path

import numpy as np

from tcs.capability.grid import MapGrid
from tcs.capability.head import head_view
from tcs.capability.map import FIXED, ITCM, CapabilityMap
from tcs.capability.merge import TaskMap
from tcs.capability.reach import Reach
from tcs.capability.visibility import CORRECTED, visibility
from tcs.errors import DataFileError
from tcs.files.reading import read_text
from tcs.files.writing import whole_file
from tcs.kernel.arrays import BoolArray, FloatArray

MAX_BYTES = 1024**3
"""Most bytes of a text file: some ten million base poses."""
_COLUMNS = 13
"""Columns of a text file: score x y z R11 R12 R13 R21 R22 R23 R31 R32 R33."""
_POSITION_TOLERANCE = 1e-3
"""Greatest distance of a pose in a text file from its cell [m], enough for four decimals."""
_ROTATION_TOLERANCE = 1e-2
"""Greatest angle of a pose in a text file from its cell [rad]."""


def export_text(
    path: str | os.PathLike[str], capability: CapabilityMap, score: str = "manipulability"
) -> None:
    """Write a map as text: per line a score and a base pose in T, score x y z R11 .. R33.

    Args:
        path: File to write; its folder must exist.
        capability: The map.
        score: "manipulability", as in the thesis, or "combined" with visibility.

    Raises:
        OutputError: If the file cannot be written.

    Source:
        ITCM thesis, Appendix C.2.4 and eq. (26).
    """
    R_TB, p_TB = capability.grid.base_in_tool(capability.cells)
    values = capability.manipulability if score == "manipulability" else capability.score(FIXED)
    table: FloatArray = np.column_stack([values, p_TB, R_TB.reshape(-1, 9)]).astype(np.float64)
    # Adding 0.0 turns -0.0 into 0.0.
    with whole_file(Path(path), "Text file") as stream:
        np.savetxt(stream, table + 0.0, fmt="%.9g")


def import_text(
    path: str | os.PathLike[str],
    reach: Reach,
    grid: MapGrid,
    *,
    map_type: str = ITCM,
    view_rule: str = CORRECTED,
) -> CapabilityMap:
    """Return the map in a text file; its scores are manipulability, visibility is computed.

    A text file contains no postures, so all torso heights count as free of contact, as in the
    thesis.

    Args:
        path: The file.
        reach: The robot, at the torso height of the map.
        grid: The grid of the poses.
        map_type: Map type.
        view_rule: Visibility rule.

    Raises:
        DataFileError: If a line is not a pose of the grid, or its score is not in 0 to 1.
    """
    path = Path(path)
    table = _numbers(path)
    R_TB = table[:, 4:].reshape(-1, 3, 3)
    square = np.abs(R_TB @ np.swapaxes(R_TB, 1, 2) - np.eye(3)).max(axis=(1, 2))
    R_BT = np.swapaxes(R_TB, 1, 2)
    p_BT = -np.einsum("nij,nj->ni", R_BT, table[:, 1:4])
    _check_rows(
        path, (square < _ROTATION_TOLERANCE) & (np.linalg.det(R_TB) > 0), "does not hold a rotation"
    )
    near = grid.nearest(R_BT, p_BT)
    on_grid = (np.abs(near.offset).max(axis=1) < _POSITION_TOLERANCE) & (
        near.angle < _ROTATION_TOLERANCE
    )
    spacing = f"{grid.step:g} m and {360 / grid.yaw_bins:g} deg"
    message = f"is not a pose of a grid of {spacing} with these tilts"
    _check_rows(path, on_grid, message)
    _check_rows(path, (table[:, 0] >= 0) & (table[:, 0] <= 1), "has a score outside 0 to 1")
    # Of equal poses the one with the best score is kept, as in the thesis, Appendix B.1.3.
    order = np.lexsort((-table[:, 0], grid.keys(near.cells)))
    _, first = np.unique(grid.keys(near.cells)[order], return_index=True)
    rows = order[first]
    cells = near.cells[rows]
    view = head_view(reach.scene, reach.torso_height, reach.head)
    visible = visibility(view, grid.tool_in_base(cells)[1], view_rule)
    return CapabilityMap(
        map_type=map_type,
        grid=grid,
        cells=cells,
        manipulability=table[rows, 0].astype(np.float32),
        visibility=visible.astype(np.float32),
        torso_heights=np.array(reach.torso_heights, dtype=np.float64),
        torso_height=float(reach.torso_height),
        free_torso_heights=np.full(len(rows), 0xFFFFFFFF, np.uint32),
        manipulability_scale=float(table[:, 0].max(initial=0.0)) or 1.0,
        metadata={
            "robot": reach.robot_reference,
            "tool": reach.robot.tool_frame,
            "view_rule": view_rule,
            "imported_from": path.name,
            "program_version": version("tcs"),
        },
        joints=np.empty((0, 7), np.float32),
    )


def _numbers(path: Path) -> FloatArray:
    text = read_text(path, f"text file '{path}'", DataFileError, limit=MAX_BYTES)
    rows = [line.split() for line in text.splitlines() if line.strip()]
    if not rows:
        raise DataFileError(
            f"text file '{path}' is empty; each line must be: score x y z R11..R33."
        )
    for i, row in enumerate(rows):
        try:
            numbers = [float(word) for word in row]
        except ValueError:
            numbers = []
        if len(numbers) != _COLUMNS or not np.all(np.isfinite(numbers)):
            raise DataFileError(
                f"text file '{path}', line {i + 1}: must be {_COLUMNS} finite numbers: "
                "score x y z R11 R12 R13 R21 R22 R23 R31 R32 R33."
            )
    return np.array(rows, dtype=np.float64)


def _check_rows(path: Path, valid: BoolArray, message: str) -> None:
    bad = np.flatnonzero(~valid)
    if bad.size:
        more = f" (and {bad.size - 1} more)" if bad.size > 1 else ""
        raise DataFileError(f"text file '{path}', line {bad[0] + 1} {message}{more}.")


def write_base_poses(path: str | os.PathLike[str], task_map: TaskMap) -> None:
    """Write every base pose of a task map as CSV: x, y, yaw_deg, torso_height, score.

    Args:
        path: File to write; its folder must exist.
        task_map: The task map.

    Raises:
        OutputError: If the file cannot be written.
    """
    poses = task_map.base_poses.copy()
    poses[:, 2] = np.degrees(poses[:, 2])
    with whole_file(Path(path), "Table") as stream:
        header = "x,y,yaw_deg,torso_height,score"
        np.savetxt(stream, poses, fmt="%.9g", delimiter=",", header=header, comments="")

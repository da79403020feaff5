"""Capability maps in files: joblib of plain containers, and the thesis's text form."""

from __future__ import annotations

import os
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from tcs.capability.grid import MapGrid
from tcs.capability.head import head_view
from tcs.capability.map import FIXED, ITCM, CapabilityMap
from tcs.capability.reach import Reach
from tcs.capability.visibility import CORRECTED, visibility
from tcs.errors import DataFileError, StoreFormatError, TcsError
from tcs.files.compression import ascending_from, compress, decompress, differences
from tcs.files.joblib_file import check_header, check_types, header, write_joblib
from tcs.files.plain import plain
from tcs.files.reader import explained, read_joblib
from tcs.files.writing import whole_file
from tcs.kernel.arrays import FloatArray

FORMAT = "tcs capability map"
FORMAT_VERSION = 1
WHAT = "Capability map"
AGAIN = "Make it again with `tcs capability from-ik`, `record` or `from-bag`."

_COLUMNS = 13
"""score x y z R11 R12 R13 R21 R22 R23 R31 R32 R33."""
_OFF_GRID = 1e-3
"""How far a pose in a text file may be from its cell [m]: files with four decimals pass, those of
another grid do not."""
_OFF_GRID_TURN = 1e-2
"""The same for its orientation [rad]."""


def save_map(path: str | os.PathLike[str], capability: CapabilityMap) -> None:
    """Write a capability map, wholly or not at all.

    Args:
        path: Where to write; its folder must exist.
        capability: What to write.

    Raises:
        OutputError: If it cannot be written there.
    """
    write_joblib(Path(path), _encode(capability), WHAT)


def load_map(path: str | os.PathLike[str]) -> CapabilityMap:
    """Read a capability map, trusting nothing in it.

    Raises:
        StoreError: If it cannot be read.
        StoreFormatError: If it is truncated, foreign, of another version, or contradicts itself.
        UnsafeStoreError: If it names anything outside the store's allow-list.
    """
    path = Path(path)
    content = read_joblib(path, WHAT, AGAIN)
    return explained(path, lambda: _decode(content), WHAT, AGAIN)


def export_text(
    path: str | os.PathLike[str], capability: CapabilityMap, score: str = "manipulability"
) -> None:
    """Write a map as text, a base pose seen from the tool per line: score x y z R11 .. R33.

    Args:
        path: Where to write; its folder must exist.
        capability: The map.
        score: "manipulability", as in the thesis, or "combined" with visibility.

    Raises:
        OutputError: If it cannot be written there.

    Source:
        ITCM thesis, Appendix C.4 and eq. (26).
    """
    R_TB, p_TB = capability.grid.base_in_tool(capability.cells)
    first = capability.manipulability if score == "manipulability" else capability.score(FIXED)
    table: FloatArray = np.column_stack([first, p_TB, R_TB.reshape(-1, 9)]).astype(np.float64)
    # Adding 0.0 turns -0.0 into 0.0.
    with whole_file(Path(path), "Text file") as stream:
        np.savetxt(stream, table + 0.0, fmt="%.9g")


def import_text(
    path: str | os.PathLike[str],
    reach: Reach,
    grid: MapGrid,
    *,
    kind: str = ITCM,
    view_rule: str = CORRECTED,
) -> CapabilityMap:
    """Return the map of a text file; scores are manipulability, visibility is computed.

    A text file tells no postures, so that no lift is known to be free: all are taken for free, as
    the thesis does.

    Args:
        path: The file.
        reach: The robot, at the lift the map was made at.
        grid: The grid of its poses.
        kind: Kind of map.
        view_rule: How visibility is scored.

    Raises:
        DataFileError: If a line is no pose of the grid, or its score is not within 0 to 1.
    """
    path = Path(path)
    table = _numbers(path)
    R_TB = table[:, 4:].reshape(-1, 3, 3)
    square = np.abs(R_TB @ np.swapaxes(R_TB, 1, 2) - np.eye(3)).max(axis=(1, 2))
    R_BT = np.swapaxes(R_TB, 1, 2)
    p_BT = -np.einsum("nij,nj->ni", R_BT, table[:, 1:4])
    _check_rows(path, (square < _OFF_GRID_TURN) & (np.linalg.det(R_TB) > 0), "holds no rotation")
    near = grid.nearest(R_BT, p_BT)
    off = (np.abs(near.offset).max(axis=1) < _OFF_GRID) & (near.turn < _OFF_GRID_TURN)
    words = f"is no pose of a grid of {grid.step:g} m and {360 / grid.turns:g} deg with these tilts"
    _check_rows(path, off, words)
    _check_rows(path, (table[:, 0] >= 0) & (table[:, 0] <= 1), "has a score outside 0 to 1")
    # Where a pose comes twice the best score counts, as in the thesis, Appendix B.1.3.
    order = np.lexsort((-table[:, 0], grid.keys(near.cells)))
    _, first = np.unique(grid.keys(near.cells)[order], return_index=True)
    rows = order[first]
    cells = near.cells[rows]
    view = head_view(reach.scene, reach.lift, reach.head)
    seen = visibility(view, grid.tool_in_base(cells)[1], view_rule)
    return CapabilityMap(
        kind=kind,
        grid=grid,
        cells=cells,
        manipulability=table[rows, 0].astype(np.float32),
        visibility=seen.astype(np.float32),
        lifts=np.array(reach.lifts, dtype=np.float64),
        lift=float(reach.lift),
        free_lifts=np.full(len(rows), 0xFFFFFFFF, np.uint32),
        manipulability_scale=float(table[:, 0].max(initial=0.0)) or 1.0,
        metadata={
            "robot": reach.found_as,
            "tool": reach.robot.tool_frame,
            "view_rule": view_rule,
            "imported_from": path.name,
            "program_version": version("tcs"),
        },
        joints=np.empty((0, 7), np.float32),
    )


def _numbers(path: Path) -> FloatArray:
    try:
        with path.open(encoding="utf-8") as stream:
            rows = [line.split() for line in stream if line.strip()]
    except OSError as error:
        raise DataFileError(f"text file '{path}' cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise DataFileError(f"text file '{path}' is no text in UTF-8.") from None
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


def _check_rows(path: Path, sound: Any, words: str) -> None:
    bad = np.flatnonzero(~sound)
    if bad.size:
        more = f" ({bad.size - 1} more after this one)" if bad.size > 1 else ""
        raise DataFileError(f"text file '{path}', line {bad[0] + 1} {words}{more}.")


def _encode(capability: CapabilityMap) -> dict[str, Any]:
    c = capability
    return {
        **header(FORMAT, FORMAT_VERSION),
        "kind": c.kind,
        "step": c.grid.step,
        "turns": c.grid.turns,
        "tilts": [list(tilt) for tilt in c.grid.tilts],
        "lift": c.lift,
        "manipulability_scale": c.manipulability_scale,
        "metadata": plain("metadata", dict(c.metadata)),
        "key_step": compress(differences(c.keys).astype(np.uint64)),
        "lifts": compress(np.asarray(c.lifts, np.float64)),
        **{
            name: compress(getattr(c, name))
            for name in ("manipulability", "visibility", "free_lifts", "joints")
        },
    }


def _decode(content: object) -> CapabilityMap:
    content = check_header(content, FORMAT, FORMAT_VERSION)
    types = {"kind": str, "step": float, "turns": int, "tilts": list, "lift": float}
    check_types(content, {**types, "manipulability_scale": float, "metadata": dict})
    tilts = content["tilts"]
    if not all(isinstance(t, list) and [type(n) for n in t] == [int, int] for t in tilts):
        raise StoreFormatError("lacks sound 'tilts'")
    grid = MapGrid(content["step"], content["turns"], tuple((p, r) for p, r in tilts))
    keys = ascending_from(decompress(content, "key_step", "u8", (None,)), 2**62, "cells")
    count = (keys.size,)
    joints = decompress(content, "joints", "f4", (None, 7))
    try:
        return CapabilityMap(
            kind=content["kind"],
            grid=grid,
            cells=grid.cells_of(keys),
            manipulability=decompress(content, "manipulability", "f4", count),
            visibility=decompress(content, "visibility", "f4", count),
            lifts=decompress(content, "lifts", "f8", (None,)),
            lift=content["lift"],
            free_lifts=decompress(content, "free_lifts", "u4", count),
            manipulability_scale=content["manipulability_scale"],
            metadata=content["metadata"],
            joints=joints,
        )
    except TcsError as error:
        raise StoreFormatError(str(error)) from None

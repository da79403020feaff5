"""Cells of a map solved in blocks: what was solved once is taken from a folder."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.capability.grid import CellArray, MapGrid
from tcs.capability.reach import OnProgress, Reach
from tcs.errors import StoreFormatError
from tcs.files.blocks import BlockFolder, Blocks, opened_if
from tcs.files.compression import AtMost, compress, decompress
from tcs.model.program import program_digest

BLOCK = 24 * 2048
"""Cells of a block: some seconds of work."""


@dataclass(frozen=True, slots=True, eq=False)
class SolvedCells:
    """The cells that are reached, with the best posture of each."""

    rows: NDArray[np.int64]
    """Their rows among the cells that were considered, ascending, shape (n,)."""
    manipulability: NDArray[np.float32]
    """The measure of the posture, shape (n,)."""
    joints: NDArray[np.float32]
    """The posture [rad], shape (n, 7)."""
    free_torso_heights: NDArray[np.uint32]
    """Torso heights at which it is free of contact, as `Reach.free_torso_heights`, shape (n,)."""


def solved_in_blocks(
    reach: Reach,
    grid: MapGrid,
    cells: CellArray,
    folder: BlockFolder | None,
    *,
    jobs: int,
    on_progress: OnProgress | None,
) -> SolvedCells:
    """Return which cells are reached, with the best collision-free posture of each.

    Args:
        reach: The robot.
        grid: The grid of the cells.
        cells: The cells to consider, shape (m, 5).
        folder: Folder in which finished blocks are kept; None to keep none.
        jobs: Number of threads; the results do not depend on it.
        on_progress: Called with the number of cells done and of all.

    Raises:
        OutputError: If blocks cannot be kept, or another process is at work in the folder.
    """
    with opened_if(folder, lambda: _key(reach, grid)) as blocks:
        found = list(_parts(reach, grid, cells, blocks, jobs, on_progress))
    return SolvedCells(
        np.concatenate([np.empty(0, np.int64), *(first + part.rows for first, part in found)]),
        *(
            np.concatenate([getattr(part, name) for _, part in found])
            for name in ("manipulability", "joints", "free_torso_heights")
        ),
    )


def _key(reach: Reach, grid: MapGrid) -> str:
    """Return the hash of what all postures of a robot follow from, but for the cells."""
    parts = (
        *("cells", program_digest(), reach.lowered.digest(), str(reach.level), reach.measure),
        *(repr(grid.step), str(grid.yaw_bins), repr(grid.tilts)),
    )
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def _parts(
    reach: Reach,
    grid: MapGrid,
    cells: CellArray,
    blocks: Blocks | None,
    jobs: int,
    on_progress: OnProgress | None,
) -> Iterator[tuple[int, SolvedCells]]:
    """Yield the first row of each block, and the cells of it that are reached."""
    for first in range(0, len(cells), BLOCK):
        part = cells[first : first + BLOCK]
        tell = _offset(on_progress, first, len(cells))
        name = hashlib.sha256(np.asarray(part, dtype="<i4").tobytes()).hexdigest()[:24]
        found = None
        if blocks is not None:
            found = blocks.load(name, partial(_decode, count=len(part)))
        if found is None:
            found = _solved(reach, grid, part, jobs, tell)
            if blocks is not None:
                blocks.save(name, _encode(found, len(part)))
        else:
            tell(len(part), len(part))
        yield first, found


def _solved(
    reach: Reach,
    grid: MapGrid,
    cells: CellArray,
    jobs: int,
    on_progress: Callable[[int, int], None],
) -> SolvedCells:
    """Return the cells of one block that are reached."""
    solved = reach.solve(*grid.tool_in_base(cells), jobs=jobs, on_progress=on_progress)
    joints = solved.joints[solved.reached]
    free = reach.free_torso_heights(joints.astype(np.float64), jobs=jobs)
    rows = np.flatnonzero(solved.reached)
    return SolvedCells(rows, solved.manipulability[rows], joints, free)


def _offset(on_progress: OnProgress | None, before: int, total: int) -> Callable[[int, int], None]:
    """Return a progress function of one block, which counts those before it."""

    def told(done: int, _: int) -> None:
        if on_progress is not None:
            on_progress(before + done, total)

    return told


def _encode(found: SolvedCells, count: int) -> dict[str, Any]:
    reached = np.zeros(count, np.bool_)
    reached[found.rows] = True
    return {
        "reached": compress(np.packbits(reached)),
        "manipulability": compress(found.manipulability),
        "joints": compress(found.joints),
        "free_torso_heights": compress(found.free_torso_heights),
    }


def _decode(content: dict[str, Any], count: int) -> SolvedCells:
    packed = decompress(content, "reached", "u1", (-(-count // 8),))
    rows = np.flatnonzero(np.unpackbits(packed, count=count))
    values = decompress(content, "manipulability", "f4", (AtMost(count),))
    postures = decompress(content, "joints", "f4", (AtMost(count), 7))
    free = decompress(content, "free_torso_heights", "u4", (AtMost(count),))
    if not rows.size == len(values) == len(postures) == len(free):
        raise StoreFormatError("has postures of other cells than are reached")
    return SolvedCells(rows, values, postures, free)

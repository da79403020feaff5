"""Cells of a map solved in blocks: what was solved once is taken from a folder."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from typing import Any

import numpy as np

from tcs.capability.reach import OnProgress, Reach, Solved
from tcs.errors import StoreFormatError
from tcs.files.blocks import BlockFolder, Blocks, opened_if
from tcs.files.compression import AtMost, compress, decompress
from tcs.kernel.arrays import FloatArray
from tcs.model.program import program_digest

BLOCK = 24 * 2048
"""Tool poses of a block: some seconds of work."""


def solved_in_blocks(
    reach: Reach,
    R_BT: FloatArray,
    p_BT: FloatArray,
    folder: BlockFolder | None,
    *,
    jobs: int,
    on_progress: OnProgress | None,
) -> Solved:
    """Return the best collision-free posture for each tool pose, as `Reach.solve`.

    Args:
        reach: The robot.
        R_BT: Tool orientations in B, shape (n, 3, 3).
        p_BT: Tool positions in B [m], shape (n, 3).
        folder: Folder in which finished blocks are kept; None to keep none.
        jobs: Number of threads; the results do not depend on it.
        on_progress: Called with the number of poses done and of all.

    Raises:
        OutputError: If blocks cannot be kept, or another process is at work in the folder.
    """
    if folder is None:
        return reach.solve(R_BT, p_BT, jobs=jobs, on_progress=on_progress)
    count = len(p_BT)
    solved = Solved(
        np.zeros(count, np.bool_), np.zeros(count, np.float32), np.zeros((count, 7), np.float32)
    )
    with opened_if(folder, lambda: _key(reach)) as blocks:
        assert blocks is not None
        for first in range(0, count, BLOCK):
            rows = slice(first, min(first + BLOCK, count))
            found = _solved(
                reach, R_BT[rows], p_BT[rows], blocks, jobs, _offset(on_progress, first, count)
            )
            solved.reached[rows] = found.reached
            solved.manipulability[rows] = found.manipulability
            solved.joints[rows] = found.joints
    return solved


def _key(reach: Reach) -> str:
    """Return the hash of what all postures of a robot follow from, but for the tool poses."""
    parts = ("cells", program_digest(), reach.lowered.digest(), str(reach.level), reach.measure)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def _solved(
    reach: Reach,
    R_BT: FloatArray,
    p_BT: FloatArray,
    blocks: Blocks,
    jobs: int,
    on_progress: Callable[[int, int], None],
) -> Solved:
    """Return the postures of one block."""
    sha = hashlib.sha256()
    for array in (R_BT, p_BT):
        sha.update(np.asarray(array, dtype="<f8").tobytes())
    name = sha.hexdigest()[:24]
    found = blocks.load(name, lambda content: _decode(content, len(p_BT)))
    if found is None:
        found = reach.solve(R_BT, p_BT, jobs=jobs, on_progress=on_progress)
        blocks.save(name, _encode(found))
    else:
        on_progress(len(p_BT), len(p_BT))
    return found


def _offset(on_progress: OnProgress | None, before: int, total: int) -> Callable[[int, int], None]:
    """Return a progress function of one block, which counts those before it."""

    def told(done: int, _: int) -> None:
        if on_progress is not None:
            on_progress(before + done, total)

    return told


def _encode(solved: Solved) -> dict[str, Any]:
    return {
        "reached": compress(np.packbits(solved.reached)),
        "manipulability": compress(solved.manipulability[solved.reached]),
        "joints": compress(solved.joints[solved.reached]),
    }


def _decode(content: dict[str, Any], count: int) -> Solved:
    packed = decompress(content, "reached", "u1", (-(-count // 8),))
    reached = np.unpackbits(packed, count=count).astype(np.bool_)
    manipulability, joints = np.zeros(count, np.float32), np.zeros((count, 7), np.float32)
    values = decompress(content, "manipulability", "f4", (AtMost(count),))
    postures = decompress(content, "joints", "f4", (AtMost(count), 7))
    if not len(values) == len(postures) == np.count_nonzero(reached):
        raise StoreFormatError("has postures of other poses than are reached")
    manipulability[reached], joints[reached] = values, postures
    return Solved(reached, manipulability, joints)

"""Sets as a block: those of the same scores are taken from a folder."""

from __future__ import annotations

import hashlib
import json
from typing import Unpack

from tcs.files.blocks import BlockFolder
from tcs.files.mapped import chunks
from tcs.model.grid import Grid
from tcs.model.program import program_digest
from tcs.placement.scoring.sets import SetOptions, build_sets
from tcs.placement.store.set_encoding import decode_sets, encode_sets
from tcs.placement.tables import ScoreTable, SetTable

_NAME = "sets"


def kept_sets(
    blocks: BlockFolder | None,
    scores: ScoreTable,
    grid: Grid,
    *,
    jobs: int,
    **options: Unpack[SetOptions],
) -> SetTable:
    """Return the sets of scores as `build_sets` does, from a folder of blocks if they are there.

    Args:
        blocks: The folder; None to build the sets and keep nothing.
        scores: Scores of every configuration of the grid.
        grid: The grid.
        jobs: Number of threads.
        **options: Options of the kept sets, all of them.

    Raises:
        OutputError: If the block cannot be written, or another process builds the same sets.
        TcsError: As `build_sets`.
    """
    if blocks is None:
        return build_sets(scores, grid, jobs=jobs, **options)
    with blocks.opened(_key(scores, grid, options)) as opened:
        found = opened.load(_NAME, lambda content: decode_sets(content, grid))
        if found is None:
            found = build_sets(scores, grid, jobs=jobs, **options)
            opened.save(_NAME, encode_sets(found))
        return found


def _key(scores: ScoreTable, grid: Grid, options: SetOptions) -> str:
    """Return the hash of everything that sets follow from."""
    plain = json.dumps([grid.to_dict(), options], sort_keys=True)
    sha = hashlib.sha256(f"sets\0{program_digest()}\0{plain}\0".encode())
    sha.update(scores.weights.tobytes())
    for rows in chunks(scores.reason, scores.dexterity):
        sha.update(scores.reason[rows].tobytes())
        sha.update(scores.dexterity[rows].tobytes())
    return sha.hexdigest()

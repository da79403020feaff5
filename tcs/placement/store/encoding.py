"""Encode a score file as plain containers and compressed arrays, and decode it."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tcs.errors import StoreFormatError
from tcs.files.compression import check_claims, compress, decompress, smallest_unsigned
from tcs.files.joblib_file import check_header, header
from tcs.files.reader import explained
from tcs.model.grid import Grid
from tcs.placement.store.refined_encoding import decode_refined, encode_refined
from tcs.placement.store.score_file import (
    DESCRIPTIONS,
    ScoreFile,
    StateTables,
    check_sets_of,
)
from tcs.placement.store.set_encoding import decode_sets, encode_sets
from tcs.placement.store.success_encoding import decode_success, encode_success
from tcs.placement.tables import Reason, ScoreTable, SetTable

FORMAT = "tcs scores"
"""Name of the format."""

_PER_PAIR = ("reason", "pair_plus_one")
"""Arrays with a number for each configuration and goal, often all equal."""

FORMAT_VERSION = 4
"""Version of the format; files of other versions are refused."""


def encode(file: ScoreFile) -> dict[str, Any]:
    """Return the plain containers that `decode` takes."""
    return {
        **header(FORMAT, FORMAT_VERSION),
        **{name: getattr(file, name) for name in DESCRIPTIONS},
        "observed": file.observed,
        "tables": [
            {
                "sets": encode_sets(table.sets),
                "scores": _encode_scores(table.scores, table.sets),
                "success": encode_success(table.success),
                "refined": encode_refined(table.refined),
            }
            for table in file.tables
        ],
    }


def decode(content: object, path: Path | None = None) -> ScoreFile:
    """Return the score file that was encoded.

    The scores of each table are decoded when they are first accessed.

    Args:
        content: What `encode` returned.
        path: Where it was read from, for the messages of scores that turn out damaged.

    Raises:
        StoreFormatError: If it is not a score file, or of another version.
        TcsError: If its content is inconsistent.
    """
    content = check_header(content, FORMAT, FORMAT_VERSION)
    check_claims(content, exempt=_PER_PAIR)
    descriptions = {name: _dict(content.get(name), name) for name in DESCRIPTIONS}
    grid = Grid.from_dict(descriptions["grid"])
    return ScoreFile(
        **descriptions,
        observed=_list(content, "observed"),
        tables=tuple(
            _decode_table(_dict(table, "table"), grid, path) for table in _list(content, "tables")
        ),
    )


def _decode_table(encoded: dict[str, Any], grid: Grid, path: Path | None) -> StateTables:
    """Return the tables of one state, whose scores are decoded on first access."""
    sets = decode_sets(_dict(encoded.get("sets"), "sets"), grid)
    scores = _dict(encoded.get("scores"), "scores")
    success = decode_success(encoded.get("success"))
    refined = decode_refined(encoded.get("refined"), sets.weights)
    return StateTables(sets, partial(_read_scores, scores, sets, grid.size, path), success, refined)


def _read_scores(
    encoded: dict[str, Any], sets: SetTable, size: int, path: Path | None
) -> ScoreTable:
    """Return decoded scores that belong to the sets; errors name the file."""

    def read() -> ScoreTable:
        scores = _decode_scores(encoded, sets, size)
        check_sets_of(scores, sets)
        return scores

    return read() if path is None else explained(path, read)


def _encode_scores(scores: ScoreTable, sets: SetTable) -> dict[str, Any]:
    rest = scores.reached.copy()
    rest[sets.candidates] = False
    return {
        # The dexterity of the candidates is stored with the sets.
        "dexterity_rest": compress(scores.dexterity[rest]),
        "reason": compress(scores.reason),
        "pair_plus_one": compress(smallest_unsigned(scores.pair.astype(np.int64) + 1)),
        "pair_names": [list(names) for names in scores.pair_names],
        "arm_joints": compress(scores.arm_joints),
    }


def _decode_scores(encoded: dict[str, Any], sets: SetTable, size: int) -> ScoreTable:
    reason = decompress(encoded, "reason", "u1", (size, sets.weights.size))
    if len(sets.candidates) and sets.candidates[-1] >= size:
        raise StoreFormatError("has sets of more configurations than scores")
    dexterity = np.zeros(reason.shape, dtype=np.float32)
    dexterity[sets.candidates] = sets.dexterity
    rest = reason == Reason.REACHED
    rest[sets.candidates] = False
    dexterity[rest] = decompress(encoded, "dexterity_rest", "f4", (int(np.count_nonzero(rest)),))
    pair = decompress(encoded, "pair_plus_one", "u", reason.shape).astype(np.int64) - 1
    names = encoded.get("pair_names")
    if not isinstance(names, list) or not all(
        isinstance(n, list) and len(n) == 2 and all(isinstance(body, str) for body in n)
        for n in names
    ):
        raise StoreFormatError("has pair_names that are not pairs of names")
    if np.any(pair >= len(names)):
        raise StoreFormatError(f"has a pair of bodies beyond its {len(names)} pair_names")
    return ScoreTable(
        dexterity=dexterity,
        reason=reason,
        pair=pair.astype(np.int32),
        pair_names=tuple((first, second) for first, second in names),
        arm_joints=decompress(
            encoded, "arm_joints", "f4", (int(np.count_nonzero(reason == Reason.REACHED)), 7)
        ),
        weights=sets.weights,
    )


def _dict(value: object, what: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise StoreFormatError(f"has no {what}")
    return value


def _list(content: dict[str, Any], name: str) -> list[Any]:
    value = content.get(name)
    if not isinstance(value, list):
        raise StoreFormatError(f"has no {name}")
    return value

"""Encode a score file as plain containers and compressed arrays, and decode it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.files.compression import check_claims, compress, decoded_bytes, decompress
from tcs.files.joblib_file import check_header, header
from tcs.files.mapped import chunks, large_zeros
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

_PER_PAIR = ("reason", "pair_plus_one", "hand")
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


def decode(content: object, path: Path | None = None, most: int | None = None) -> ScoreFile:
    """Return the score file that was encoded.

    The scores of each table are decoded when they are first accessed.

    Args:
        content: What `encode` returned.
        path: Where it was read from, for the messages of scores that turn out damaged.
        most: Most bytes that its arrays may take once they are decoded; None for any.

    Raises:
        StoreFormatError: If it is not a score file, of another version, or takes more memory.
        TcsError: If its content is inconsistent.
    """
    content = check_header(content, FORMAT, FORMAT_VERSION)
    check_claims(content, exempt=_PER_PAIR)
    size = decoded_bytes(content, narrow=_PER_PAIR)
    if most is not None and size > most:
        raise StoreFormatError(
            f"takes {size:,} bytes of memory; at most {most:,} are accepted here. Score a coarser "
            "grid or fewer axes"
        )
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
    return {
        # The dexterity of the candidates is stored with the sets.
        "dexterity_rest": compress(
            np.concatenate(
                [
                    np.empty(0, np.float32),
                    *(
                        scores.dexterity[rows][rest]
                        for rows, rest in _rest(scores.reason, sets, scores.dexterity)
                    ),
                ]
            )
        ),
        "reason": compress(scores.reason),
        "pair_plus_one": compress(_plus_one(scores.pair)),
        "pair_names": [list(names) for names in scores.pair_names],
        "arm_joints": compress(scores.arm_joints),
        **({} if scores.hand is None else {"hand": compress(scores.hand)}),
    }


def _decode_scores(encoded: dict[str, Any], sets: SetTable, size: int) -> ScoreTable:
    reason = decompress(encoded, "reason", "u1", (size, sets.weights.size))
    if len(sets.candidates) and sets.candidates[-1] >= size:
        raise StoreFormatError("has sets of more configurations than scores")
    names = encoded.get("pair_names")
    if not isinstance(names, list) or not all(
        isinstance(n, list) and len(n) == 2 and all(isinstance(body, str) for body in n)
        for n in names
    ):
        raise StoreFormatError("has pair_names that are not pairs of names")
    stored = decompress(encoded, "pair_plus_one", "u", reason.shape)
    pair: NDArray[Any] = large_zeros(reason.shape, _pair_type(len(names)))
    for rows in chunks(stored, pair):
        if np.any(stored[rows] > len(names)):
            raise StoreFormatError(f"has a pair of bodies beyond its {len(names)} pair_names")
        pair[rows] = stored[rows]
        pair[rows] -= 1
    reached = sum(int(np.count_nonzero(reason[rows] == Reason.REACHED)) for rows in chunks(reason))
    return ScoreTable(
        dexterity=_decode_dexterity(encoded, sets, reason),
        reason=reason,
        pair=pair,
        pair_names=tuple((first, second) for first, second in names),
        arm_joints=decompress(encoded, "arm_joints", "f4", (reached, 7)),
        weights=sets.weights,
        hand=decompress(encoded, "hand", "u1", reason.shape) if "hand" in encoded else None,
    )


def _decode_dexterity(
    encoded: dict[str, Any], sets: SetTable, reason: NDArray[np.uint8]
) -> NDArray[np.float32]:
    """Return the dexterity of every pair: of the candidates, and of the others that are reached."""
    count = sum(int(np.count_nonzero(rest)) for _, rest in _rest(reason, sets))
    values = decompress(encoded, "dexterity_rest", "f4", (count,))
    dexterity: NDArray[np.float32] = large_zeros(reason.shape, np.float32)
    done = 0
    for rows, rest in _rest(reason, sets, dexterity):
        found = values[done : done + int(np.count_nonzero(rest))]
        dexterity[rows][rest] = found
        done += len(found)
    dexterity[sets.candidates] = sets.dexterity
    return dexterity


def _rest(
    reason: NDArray[np.uint8], sets: SetTable, *others: NDArray[Any]
) -> Iterator[tuple[slice, NDArray[np.bool_]]]:
    """Yield rows, and which of their pairs are reached by configurations without sets.

    Args:
        reason: Reasons of all pairs, shape (H, G).
        sets: The sets.
        *others: Further arrays of as many rows, of which the caller reads the same ones.
    """
    alone = np.ones((len(reason), 1), dtype=np.bool_)
    alone[sets.candidates] = False
    for rows in chunks(reason, *others):
        yield rows, (reason[rows] == Reason.REACHED) & alone[rows]


def _plus_one(pair: NDArray[Any]) -> NDArray[Any]:
    """Return numbers of pairs of bodies without a sign, in the smallest type for the greatest."""
    greatest = max((int(pair[rows].max(initial=-1)) for rows in chunks(pair)), default=-1)
    stored: NDArray[Any] = large_zeros(pair.shape, np.min_scalar_type(greatest + 1))
    for rows in chunks(pair, stored):
        stored[rows] = pair[rows].astype(np.int32) + 1
    return stored


def _pair_type(names: int) -> type[np.int16] | type[np.int32]:
    """Return the type of indices into names of pairs, as `ScoreTable.pair`."""
    return np.int16 if names <= np.iinfo(np.int16).max else np.int32


def _dict(value: object, what: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise StoreFormatError(f"has no {what}")
    return value


def _list(content: dict[str, Any], name: str) -> list[Any]:
    value = content.get(name)
    if not isinstance(value, list):
        raise StoreFormatError(f"has no {name}")
    return value

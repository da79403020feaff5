"""Turn a score file into plain containers and small arrays, and back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tcs.errors import StoreFormatError
from tcs.files.compression import compress, decompress, smallest_unsigned
from tcs.placement.store.score_file import DESCRIPTIONS, ScoreFile, StateTables
from tcs.placement.store.set_encoding import decode_sets, encode_sets
from tcs.placement.store.success_encoding import decode_success, encode_success
from tcs.placement.tables import Reason, ScoreTable, SetTable

FORMAT = "tcs scores"
"""What the file calls itself."""

FORMAT_VERSION = 3
"""Grows when the form of the file changes; other versions are refused."""

Explain = Callable[[Callable[[], ScoreTable]], ScoreTable]
"""Calls a function and turns what it raises into one line about the file."""


def encode(file: ScoreFile) -> dict[str, Any]:
    """Return the plain containers that `decode` takes."""
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        **{name: getattr(file, name) for name in DESCRIPTIONS},
        "observed": file.observed,
        "tables": [
            {
                "sets": encode_sets(table.sets),
                "scores": _packed_scores(table.scores, table.sets),
                "success": encode_success(table.success),
            }
            for table in file.tables
        ],
    }


def decode(content: object, explain: Explain = lambda read: read()) -> ScoreFile:
    """Return the score file that was packed.

    Args:
        content: What `encode` returned.
        explain: Called around the unfolding of scores, which waits until they are asked for.

    Raises:
        StoreFormatError: If it is no score file, or of another version.
        TcsError: If its content contradicts itself.
    """
    content = _dict(content, "the file")
    if content.get("format") != FORMAT:
        raise StoreFormatError("is a joblib file, but not one of tcs")
    version = content.get("format_version")
    if type(version) is not int or version < 1:
        raise StoreFormatError("has no format version")
    if version > FORMAT_VERSION:
        raise StoreFormatError(
            f"has format version {version}, and this program reads version {FORMAT_VERSION}: "
            "update tcs"
        )
    if version < FORMAT_VERSION:
        raise StoreFormatError(
            f"has format version {version}, written by an older tcs, and this program reads "
            f"version {FORMAT_VERSION}: score the task again"
        )
    return ScoreFile(
        **{name: _dict(content.get(name), name) for name in DESCRIPTIONS},
        observed=_list(content, "observed"),
        tables=tuple(
            _unpacked_table(_dict(table, "table"), explain) for table in _list(content, "tables")
        ),
    )


def _unpacked_table(packed: dict[str, Any], explain: Explain) -> StateTables:
    """Return a table whose scores are unfolded when they are first asked for."""
    sets = decode_sets(_dict(packed.get("sets"), "sets"))
    scores = _dict(packed.get("scores"), "scores")

    def unfold() -> ScoreTable:
        table = _unpacked_scores(scores, sets)
        StateTables(sets, lambda: table).check(table)
        return table

    success = decode_success(packed.get("success"))
    return StateTables(sets, lambda: explain(unfold), success)


def _packed_scores(scores: ScoreTable, sets: SetTable) -> dict[str, Any]:
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


def _unpacked_scores(packed: dict[str, Any], sets: SetTable) -> ScoreTable:
    goals = sets.weights.size
    reason = decompress(packed, "reason", "u1", (None, goals))
    if len(sets.candidates) and sets.candidates[-1] >= len(reason):
        raise StoreFormatError("has sets of more configurations than scores")
    dexterity = np.zeros(reason.shape, dtype=np.float32)
    dexterity[sets.candidates] = sets.dexterity
    rest = reason == Reason.REACHED
    rest[sets.candidates] = False
    dexterity[rest] = decompress(packed, "dexterity_rest", "f4", (int(np.count_nonzero(rest)),))
    pair = decompress(packed, "pair_plus_one", "u", reason.shape).astype(np.int64) - 1
    names = packed.get("pair_names")
    if not isinstance(names, list) or not all(
        isinstance(n, list) and len(n) == 2 and all(isinstance(body, str) for body in n)
        for n in names
    ):
        raise StoreFormatError("has pair_names that are no pairs of names")
    if np.any(pair >= len(names)):
        raise StoreFormatError(f"has a pair of bodies beyond its {len(names)} pair_names")
    return ScoreTable(
        dexterity=dexterity,
        reason=reason,
        pair=pair.astype(np.int32),
        pair_names=tuple((first, second) for first, second in names),
        arm_joints=decompress(packed, "arm_joints", "f4", (None, 7)),
        weights=sets.weights,
    )


def _dict(value: object, what: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise StoreFormatError(f"has no {what}" if what != "the file" else "is not one of tcs")
    return value


def _list(content: dict[str, Any], name: str) -> list[Any]:
    value = content.get(name)
    if not isinstance(value, list):
        raise StoreFormatError(f"has no {name}")
    return value

"""Turn a score file into plain containers and small arrays, and back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.store.folding import fold, unfolded
from tcs.store.score_file import DESCRIPTIONS, Scored, ScoreFile
from tcs.tables import ScoreTable, SetTable

FORMAT = "tcs scores"
"""What the file calls itself."""

FORMAT_VERSION = 2
"""Grows when the form of the file changes; other versions are refused."""

Explain = Callable[[Callable[[], ScoreTable]], ScoreTable]
"""Calls a function and turns what it raises into one line about the file."""


def pack(file: ScoreFile) -> dict[str, Any]:
    """Return the plain containers that `unpack` takes."""
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        **{name: getattr(file, name) for name in DESCRIPTIONS},
        "observed": file.observed,
        "tables": [
            {"sets": _packed_sets(table.sets), "scores": _packed_scores(table.scores)}
            for table in file.tables
        ],
    }


def unpack(content: object, explain: Explain = lambda read: read()) -> ScoreFile:
    """Return the score file that was packed.

    Args:
        content: What `pack` returned.
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
            f"has format version {version} of an older tcs, and this program reads version "
            f"{FORMAT_VERSION}"
        )
    return ScoreFile(
        **{name: _dict(content.get(name), name) for name in DESCRIPTIONS},
        observed=_list(content, "observed"),
        tables=tuple(
            _unpacked_table(_dict(table, "table"), explain) for table in _list(content, "tables")
        ),
    )


def _unpacked_table(packed: dict[str, Any], explain: Explain) -> Scored:
    """Return a table whose scores are unfolded when they are first asked for."""
    sets = _unpacked_sets(_dict(packed.get("sets"), "sets"))
    scores = _dict(packed.get("scores"), "scores")

    def unfold() -> ScoreTable:
        table = _unpacked_scores(scores, sets)
        Scored(sets, lambda: table).check(table)
        return table

    return Scored(sets, lambda: explain(unfold))


def _packed_scores(scores: ScoreTable) -> dict[str, Any]:
    return {
        "reason": fold(scores.reason),
        "pair_plus_one": fold(_small(scores.pair.astype(np.int64) + 1)),
        "pair_names": [list(names) for names in scores.pair_names],
        "arm_joints": fold(scores.arm_joints),
    }


def _unpacked_scores(packed: dict[str, Any], sets: SetTable) -> ScoreTable:
    goals = sets.weights.size
    reason = unfolded(packed, "reason", "u1", (None, goals))
    if len(sets.candidates) and sets.candidates[-1] >= len(reason):
        raise StoreFormatError("has sets of more configurations than scores")
    isotropy = np.zeros(reason.shape, dtype=np.float32)
    isotropy[sets.candidates] = sets.isotropy
    pair = unfolded(packed, "pair_plus_one", "u", reason.shape).astype(np.int64) - 1
    names = packed.get("pair_names")
    if not isinstance(names, list) or not all(
        isinstance(n, list) and len(n) == 2 and all(isinstance(body, str) for body in n)
        for n in names
    ):
        raise StoreFormatError("has pair_names that are no pairs of names")
    if np.any(pair >= len(names)):
        raise StoreFormatError(f"has a pair of bodies beyond its {len(names)} pair_names")
    return ScoreTable(
        isotropy=isotropy,
        reason=reason,
        pair=pair.astype(np.int32),
        pair_names=tuple((first, second) for first, second in names),
        arm_joints=unfolded(packed, "arm_joints", "f4", (None, 7)),
        weights=sets.weights,
    )


def _packed_sets(sets: SetTable) -> dict[str, Any]:
    cells = len(sets.cell_xy)
    numbers = sets.pair_cells[:, 0].astype(np.int64) * cells + sets.pair_cells[:, 1]
    # There are few different values: one for each subset of the goals at most.
    values, code = np.unique(sets.pair_reachability, return_inverse=True)
    return {
        "rule": sets.rule,
        "min_distance": float(sets.min_distance),
        "weights": fold(sets.weights),
        # Steps from one to the next are mostly small, and compress to little.
        "candidate_step": fold(_steps(sets.candidates.astype(np.int64))),
        "reached": fold(sets.reached.astype(np.uint8)),
        "isotropy": fold(sets.isotropy[sets.reached]),
        "cell": fold(_small(sets.cell.astype(np.int64))),
        "cell_xy": fold(sets.cell_xy),
        "pair_step": fold(_steps(numbers)),
        "pair_count": fold(_small(sets.pair_count)),
        "reachability_values": fold(values),
        "reachability_code": fold(_small(code.astype(np.int64))),
        "pair_manipulability": fold(sets.pair_manipulability),
        "pair_sum": fold(sets.pair_sum),
        "best": list(sets.best),
        "best_single": list(sets.best_single),
    }


def _unpacked_sets(packed: dict[str, Any]) -> SetTable:
    rule, min_distance = packed.get("rule"), packed.get("min_distance")
    if not isinstance(rule, str) or not isinstance(min_distance, float):
        raise StoreFormatError("has sets without a rule or a least distance")
    weights = unfolded(packed, "weights", "f8", (None,))
    # A table has at most 20 million configurations: see `tcs.space.MAX_CONFIGURATIONS`.
    candidates = _ascending(unfolded(packed, "candidate_step", "u", (None,)), 2**31, "candidates")
    reached = unfolded(packed, "reached", "u1", (candidates.size, weights.size)) != 0
    isotropy = np.zeros(reached.shape, dtype=np.float32)
    isotropy[reached] = unfolded(packed, "isotropy", "f4", (int(np.count_nonzero(reached)),))
    cell_xy = unfolded(packed, "cell_xy", "f8", (None, 2))
    values = unfolded(packed, "reachability_values", "f8", (None,))
    step = unfolded(packed, "pair_step", "u", (None,))
    kept = (step.size,)
    numbers = _ascending(step, len(cell_xy) ** 2 + 1, "pairs of cells")
    code = unfolded(packed, "reachability_code", "u", kept).astype(np.int64)
    if np.any(code >= values.size):
        raise StoreFormatError(f"has a reachability code beyond its {values.size} values")
    pair_cells = np.stack(np.divmod(numbers, max(len(cell_xy), 1)), axis=1)
    return SetTable(
        rule=rule,
        min_distance=min_distance,
        weights=weights,
        candidates=candidates.astype(np.int32),
        reached=reached,
        isotropy=isotropy,
        cell=_int32(unfolded(packed, "cell", "u", candidates.shape)),
        cell_xy=cell_xy,
        pair_cells=pair_cells.astype(np.int32),
        pair_count=unfolded(packed, "pair_count", "u", kept).astype(np.int64),
        pair_reachability=values[code],
        pair_manipulability=unfolded(packed, "pair_manipulability", "f4", kept),
        pair_sum=unfolded(packed, "pair_sum", "f4", kept),
        best=_indices(packed, "best"),
        best_single=_indices(packed, "best_single"),
    )


def _ascending(step: NDArray[Any], end: int, what: str) -> NDArray[np.int64]:
    """Return the sums of steps, all of them below `end`."""
    # Summed in floating point first: forged steps must not wrap round to valid ones.
    if step.sum(dtype=np.float64) >= float(end):
        raise StoreFormatError(f"has {what} that do not exist")
    return np.cumsum(step.astype(np.int64))


def _dict(value: object, what: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise StoreFormatError(f"has no {what}" if what != "the file" else "is not one of tcs")
    return value


def _list(content: dict[str, Any], name: str) -> list[Any]:
    value = content.get(name)
    if not isinstance(value, list):
        raise StoreFormatError(f"has no {name}")
    return value


def _indices(packed: dict[str, Any], name: str) -> tuple[int, ...]:
    members = packed.get(name)
    if not isinstance(members, list) or not all(type(h) is int and 0 <= h < 2**31 for h in members):
        raise StoreFormatError(f"has a '{name}' that is no list of configurations")
    return tuple(members)


def _int32(values: NDArray[Any]) -> NDArray[np.int32]:
    if np.any(values > np.iinfo(np.int32).max):
        raise StoreFormatError("has a number of a cell that is out of range")
    return values.astype(np.int32)


def _small(values: NDArray[np.int64]) -> NDArray[Any]:
    """Return whole numbers >= 0 in the smallest unsigned type that holds them all."""
    return values.astype(np.min_scalar_type(int(values.max(initial=0))))


def _steps(ascending: NDArray[np.int64]) -> NDArray[Any]:
    """Return the differences of ascending numbers, from 0."""
    return _small(np.asarray(np.diff(ascending, prepend=0), dtype=np.int64))

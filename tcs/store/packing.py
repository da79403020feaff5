"""Turn a score file into plain containers and small arrays, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.store.score_file import ScoreFile
from tcs.tables import Reason, ScoreTable, SetTable
from tcs.tables.sets import candidates_of

FORMAT = "tcs scores"
"""What the file calls itself."""

FORMAT_VERSION = 1
"""Grows when older programs can no longer read a new file."""

_DESCRIPTIONS = ("metadata", "task", "robot", "environment", "grid")


def pack(file: ScoreFile) -> dict[str, Any]:
    """Return the plain containers that `unpack` takes."""
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        **{name: getattr(file, name) for name in _DESCRIPTIONS},
        "scores": _packed_scores(file.scores),
        "sets": _packed_sets(file.sets),
    }


def unpack(content: object) -> ScoreFile:
    """Return the score file that was packed.

    Raises:
        StoreFormatError: If it is no score file, or of a version from the future.
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
            f"has format version {version}, and this program reads up to {FORMAT_VERSION}: "
            "update tcs"
        )
    scores = _unpacked_scores(_dict(content.get("scores"), "scores"))
    return ScoreFile(
        **{name: _dict(content.get(name), name) for name in _DESCRIPTIONS},
        scores=scores,
        sets=_unpacked_sets(_dict(content.get("sets"), "sets"), scores),
    )


def _packed_scores(scores: ScoreTable) -> dict[str, Any]:
    return {
        "reason": np.array(scores.reason),
        "isotropy": scores.isotropy[scores.reached],
        "pair_plus_one": _small(scores.pair.astype(np.int64) + 1),
        "pair_names": [list(names) for names in scores.pair_names],
        "arm_joints": _planes(scores.arm_joints),
        "weights": np.array(scores.weights),
    }


def _unpacked_scores(packed: dict[str, Any]) -> ScoreTable:
    reason = _array(packed, "reason", "u1", 2)
    reached = reason == Reason.REACHED
    count = int(np.count_nonzero(reached))
    isotropy = np.zeros(reason.shape, dtype=np.float32)
    isotropy[reached] = _array(packed, "isotropy", "f4", 1, count)
    pair = _array(packed, "pair_plus_one", "u", 2).astype(np.int64) - 1
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
        arm_joints=_from_planes(_array(packed, "arm_joints", "u1", 2, 4), 7),
        weights=_array(packed, "weights", "f8", 1),
    )


def _packed_sets(sets: SetTable) -> dict[str, Any]:
    cells = len(sets.cell_xy)
    numbers = sets.pair_cells[:, 0].astype(np.int64) * cells + sets.pair_cells[:, 1]
    # There are few different values: one for each subset of the goals at most.
    values, code = np.unique(sets.pair_reachability, return_inverse=True)
    return {
        "rule": sets.rule,
        "min_distance": float(sets.min_distance),
        "cell": _small(sets.cell.astype(np.int64)),
        "cell_xy": np.array(sets.cell_xy),
        # Steps from one pair of cells to the next are mostly 1, and compress to nothing.
        "pair_step": _small(np.diff(numbers, prepend=0)),
        "pair_count": _small(sets.pair_count),
        "reachability_values": values,
        "reachability_code": _small(code.astype(np.int64)),
        "pair_manipulability": np.array(sets.pair_manipulability),
        "pair_sum": np.array(sets.pair_sum),
        "best": list(sets.best),
        "best_single": list(sets.best_single),
    }


def _unpacked_sets(packed: dict[str, Any], scores: ScoreTable) -> SetTable:
    rule, min_distance = packed.get("rule"), packed.get("min_distance")
    if not isinstance(rule, str) or not isinstance(min_distance, float):
        raise StoreFormatError("has sets without a rule or a least distance")
    candidates = candidates_of(scores.reached)
    cell_xy = _array(packed, "cell_xy", "f8", 2)
    values = _array(packed, "reachability_values", "f8", 1)
    step = _array(packed, "pair_step", "u", 1)
    kept = step.size
    # Signed and summed in floating point first: forged steps must not wrap round to valid ones.
    if step.sum(dtype=np.float64) > float(len(cell_xy)) ** 2:
        raise StoreFormatError("has pairs of cells that do not exist")
    numbers = np.cumsum(step.astype(np.int64))
    code = _array(packed, "reachability_code", "u", 1, kept).astype(np.int64)
    if np.any(code >= values.size):
        raise StoreFormatError(f"has a reachability code beyond its {values.size} values")
    pair_cells = np.stack(np.divmod(numbers, max(len(cell_xy), 1)), axis=1)
    return SetTable(
        rule=rule,
        min_distance=min_distance,
        weights=scores.weights,
        candidates=candidates,
        reached=scores.reached[candidates],
        isotropy=scores.isotropy[candidates],
        cell=_int32(_array(packed, "cell", "u", 1, candidates.size)),
        cell_xy=cell_xy,
        pair_cells=pair_cells.astype(np.int32),
        pair_count=_array(packed, "pair_count", "u", 1, kept).astype(np.int64),
        pair_reachability=values[code],
        pair_manipulability=_array(packed, "pair_manipulability", "f4", 1, kept),
        pair_sum=_array(packed, "pair_sum", "f4", 1, kept),
        best=_indices(packed, "best"),
        best_single=_indices(packed, "best_single"),
    )


def _dict(value: object, what: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise StoreFormatError(f"has no {what}" if what != "the file" else "is not one of tcs")
    return value


def _array(
    packed: dict[str, Any], name: str, kind: str, dimensions: int, length: int | None = None
) -> NDArray[Any]:
    """Return one array, checked: `kind` is an element type, or "u" for any unsigned one."""
    array = packed.get(name)
    if not isinstance(array, np.ndarray):
        raise StoreFormatError(f"lacks the array '{name}'")
    fits = array.dtype.kind == "u" if kind == "u" else array.dtype == np.dtype(kind)
    if not fits or array.ndim != dimensions or (length is not None and len(array) != length):
        raise StoreFormatError(
            f"has an array '{name}' of type {array.dtype} and shape {array.shape}, which does not "
            "belong there"
        )
    return array


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


def _planes(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the bytes of float32 values sorted by significance, shape (4, n).

    Signs and exponents repeat and compress well once they stand together; mantissas do not.
    """
    return np.ascontiguousarray(values.astype("<f4").reshape(-1, 1).view(np.uint8).T)


def _from_planes(planes: NDArray[np.uint8], columns: int) -> NDArray[np.float32]:
    """Return the float32 values that `_planes` took apart, shape (n / columns, columns)."""
    if planes.shape[1] % columns:
        raise StoreFormatError(f"has arm joints that do not come in rows of {columns}")
    values = np.ascontiguousarray(planes.T).view("<f4")
    return values.astype(np.float32, copy=False).reshape(-1, columns)

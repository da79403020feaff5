"""Score files encoded as plain containers and compressed arrays: saved, loaded, decoded."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.files.compression import (
    MAX_BYTES,
    AtMost,
    ascending_from,
    check_claims,
    compress,
    decoded_bytes,
    decompress,
    differences,
    smallest_unsigned,
)
from tcs.files.joblib_file import check_header, check_types, header, write_joblib
from tcs.files.mapped import chunks, large_zeros
from tcs.files.quantities import GOALS
from tcs.files.reader import SCORE_FILE, explained, read_joblib
from tcs.model.grid import Grid
from tcs.placement.store.score_file import (
    DESCRIPTIONS,
    ScoreFile,
    StateTables,
    check_sets_of,
)
from tcs.placement.tables import (
    BaseLattice,
    Reason,
    RefinedSuccess,
    RefinedTable,
    ScoreTable,
    SetTable,
    SuccessTable,
)
from tcs.placement.tables.sets import BOUNDS, MOVES, Groups
from tcs.placement.tables.success import NO_MEMBER

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


_PLAIN = {
    "rule": str,
    "max_members": int,
    "min_distance": float,
    "same_environment": bool,
    "state_size": int,
}
"""Type of each field of a set table that is a single value."""


def encode_sets(sets: SetTable) -> dict[str, Any]:
    """Return the plain containers that `decode_sets` takes."""
    cells = len(sets.cell_xy)
    numbers = sets.pair_cells[:, 0].astype(np.int64) * cells + sets.pair_cells[:, 1]
    # There are few different values: at most one for each subset of the goals.
    values, code = np.unique(sets.pair_reachability, return_inverse=True)
    return {
        "rule": sets.rule,
        "max_members": int(sets.max_members),
        "min_distance": float(sets.min_distance),
        "same_environment": bool(sets.same_environment),
        "state_size": int(sets.state_size),
        "tile": float(sets.tile),
        "weights": compress(sets.weights),
        "candidate_step": _encode_ascending(sets.candidates.astype(np.int64)),
        "reached": compress(sets.reached.astype(np.uint8)),
        "dexterity": compress(sets.dexterity[sets.reached]),
        **({} if sets.hand is None else {"hand": compress(sets.hand)}),
        "cell": compress(smallest_unsigned(sets.cell.astype(np.int64))),
        "cell_xy": compress(sets.cell_xy),
        "pair_step": _encode_ascending(numbers),
        "pair_count": compress(smallest_unsigned(sets.pair_count)),
        "reachability_values": compress(values),
        "reachability_code": compress(smallest_unsigned(code.astype(np.int64))),
        "pair_manipulability": compress(sets.pair_manipulability),
        "pair_sum": compress(sets.pair_sum),
        "member_reachability": compress(sets.member_reachability),
        "member_manipulability": compress(sets.member_manipulability),
        "member_sum": compress(sets.member_sum),
        "triples": None if sets.triples is None else _encode_groups(sets.triples, cells),
        "best": list(sets.best),
        "best_single": list(sets.best_single),
        "lattice": {
            "start": list(sets.lattice.start),
            "step": list(sets.lattice.step),
            "shape": list(sets.lattice.shape),
            "moves": compress(np.packbits(sets.lattice.moves)),
        },
    }


def decode_sets(encoded: dict[str, Any], grid: Grid) -> SetTable:
    """Return the encoded sets.

    Args:
        encoded: What `encode_sets` returned.
        grid: Grid of the configurations.

    Raises:
        StoreFormatError: If something is missing or out of range.
        TcsError: If the sets contradict themselves.
    """
    check_types(encoded, _PLAIN)
    # Files from before there were such sets do not name it.
    if type(encoded.get("tile", 0.0)) is not float:
        raise StoreFormatError("lacks a valid 'tile' (float)")
    configurations = grid.size
    weights = decompress(encoded, "weights", "f8", (AtMost(int(GOALS.high)),))
    candidates = ascending_from(
        decompress(encoded, "candidate_step", "u", (AtMost(configurations),)),
        configurations,
        "candidates",
    )
    reached = decompress(encoded, "reached", "u1", (candidates.size, weights.size)) != 0
    dexterity = np.zeros(reached.shape, dtype=np.float32)
    dexterity[reached] = decompress(encoded, "dexterity", "f4", (int(np.count_nonzero(reached)),))
    cell_xy = decompress(encoded, "cell_xy", "f8", (AtMost(candidates.size), 2))
    values = decompress(encoded, "reachability_values", "f8", (None,))
    step = decompress(encoded, "pair_step", "u", (AtMost(len(cell_xy) ** 2),))
    kept = (step.size,)
    numbers = ascending_from(step, len(cell_xy) ** 2 + 1, "pairs of cells")
    code = decompress(encoded, "reachability_code", "u", kept)
    if np.any(code >= values.size):
        raise StoreFormatError(f"has a reachability code beyond its {values.size} values")
    pair_cells = _digits(numbers, len(cell_xy), 2)
    return SetTable(
        **{name: encoded[name] for name in _PLAIN},
        tile=encoded.get("tile", 0.0),
        weights=weights,
        candidates=candidates.astype(np.int32),
        reached=reached,
        dexterity=dexterity,
        hand=decompress(encoded, "hand", "u1", reached.shape) if "hand" in encoded else None,
        cell=_int32(decompress(encoded, "cell", "u", candidates.shape)),
        cell_xy=cell_xy,
        pair_cells=pair_cells,
        pair_count=decompress(encoded, "pair_count", "u", kept).astype(np.int64),
        pair_reachability=values[code],
        pair_manipulability=decompress(encoded, "pair_manipulability", "f4", kept),
        pair_sum=decompress(encoded, "pair_sum", "f4", kept),
        member_reachability=decompress(encoded, "member_reachability", "f8", candidates.shape),
        member_manipulability=decompress(encoded, "member_manipulability", "f4", candidates.shape),
        member_sum=decompress(encoded, "member_sum", "f4", candidates.shape),
        triples=_decode_groups(encoded.get("triples"), len(cell_xy)),
        best=_indices(encoded, "best"),
        best_single=_indices(encoded, "best_single"),
        lattice=_decode_lattice(encoded.get("lattice")),
    )


def _encode_groups(groups: Groups, cells: int) -> dict[str, Any]:
    """Return the plain containers that `_decode_groups` takes."""
    number = np.zeros(len(groups.cells), dtype=np.int64)
    for column in groups.cells.T.astype(np.int64):
        number = number * cells + column
    return {
        "least": float(groups.least),
        "step": _encode_ascending(number),
        **{name: compress(getattr(groups, name)) for name in BOUNDS},
        "count": compress(smallest_unsigned(groups.count)),
    }


def _decode_groups(encoded: object, cells: int) -> Groups | None:
    """Return the encoded sets of three, checked; None where there are none."""
    if encoded is None:
        return None
    if not isinstance(encoded, dict) or type(encoded.get("least")) is not float:
        raise StoreFormatError("has invalid sets of three")
    steps = decompress(encoded, "step", "u", (None,))
    number = ascending_from(steps, cells**3 + 1, "triples of cells")
    wide = {"reachability": "f8", "member_reachability": "f8"}
    return Groups(
        least=encoded["least"],
        cells=_digits(number, cells, 3),
        count=decompress(encoded, "count", "u", number.shape).astype(np.int64),
        **{name: decompress(encoded, name, wide.get(name, "f4"), (None,)) for name in BOUNDS},
    )


def _digits(numbers: NDArray[np.int64], base: int, count: int) -> NDArray[np.int32]:
    """Return the digits of numbers >= 0, which are used up; the most significant comes first.

    The columns are made one after the other: together, in 64 bits, they would take several times
    the memory of the result.
    """
    digits, base = np.empty((len(numbers), count), dtype=np.int32), max(base, 1)
    for column in reversed(range(1, count)):
        digits[:, column] = numbers % base
        numbers //= base
    # Not less than the base in a file that was changed: the table refuses it.
    digits[:, 0] = numbers
    return digits


def _decode_lattice(encoded: object) -> BaseLattice:
    """Return the encoded base lattice, checked."""
    if not isinstance(encoded, dict):
        raise StoreFormatError("has sets without a base lattice")
    pairs = {}
    for name, number in (("start", float), ("step", float), ("shape", int)):
        values = encoded.get(name)
        if not isinstance(values, list) or [type(value) for value in values] != [number] * 2:
            raise StoreFormatError(f"has a base lattice without '{name}'")
        pairs[name] = values
    shape = (len(MOVES), *pairs["shape"])
    if min(shape) < 1 or math.prod(shape) > MAX_BYTES:
        raise StoreFormatError(f"has a base lattice of shape {shape}")
    bits = decompress(encoded, "moves", "u1", (-(-math.prod(shape) // 8),))
    moves = np.unpackbits(bits, count=math.prod(shape)).astype(np.bool_).reshape(shape)
    return BaseLattice(
        start=(pairs["start"][0], pairs["start"][1]),
        step=(pairs["step"][0], pairs["step"][1]),
        moves=moves,
    )


def _indices(encoded: dict[str, Any], name: str) -> tuple[int, ...]:
    members = encoded.get(name)
    if not isinstance(members, list) or not all(type(h) is int and 0 <= h < 2**31 for h in members):
        raise StoreFormatError(f"has a '{name}' that is not a list of configurations")
    return tuple(members)


def _int32(values: NDArray[Any]) -> NDArray[np.int32]:
    if np.any(values > np.iinfo(np.int32).max):
        raise StoreFormatError("has a number of a cell that is out of range")
    return values.astype(np.int32)


def _encode_ascending(numbers: NDArray[np.int64]) -> dict[str, Any]:
    return compress(smallest_unsigned(differences(numbers)))


def encode_success(success: SuccessTable | None) -> dict[str, Any] | None:
    """Return the plain containers that `decode_success` takes; None where there is nothing."""
    if success is None:
        return None
    return {
        "members_plus_one": compress(
            smallest_unsigned(success.members.astype(np.int64) - NO_MEMBER)
        ),
        "success": compress(success.success),
        "low": compress(success.low),
        "high": compress(success.high),
        "samples": compress(smallest_unsigned(success.samples.astype(np.int64))),
    }


def decode_success(encoded: object) -> SuccessTable | None:
    """Return the encoded estimates; None for a file without estimates.

    Raises:
        StoreFormatError: If something is missing or out of range.
        TcsError: If they contradict themselves.
    """
    if encoded is None:
        return None
    if not isinstance(encoded, dict):
        raise StoreFormatError("has invalid estimates of success")
    members = decompress(encoded, "members_plus_one", "u", (None, None))
    rows = (len(members),)
    samples = decompress(encoded, "samples", "u", rows)
    for numbers in (members, samples):
        if np.any(numbers >= np.iinfo(np.int32).max):
            raise StoreFormatError("has estimates of success out of range")
    return SuccessTable(
        members=(members.astype(np.int64) + NO_MEMBER).astype(np.int32),
        success=decompress(encoded, "success", "f8", rows),
        low=decompress(encoded, "low", "f8", rows),
        high=decompress(encoded, "high", "f8", rows),
        samples=samples.astype(np.int32),
    )


def encode_refined(refined: RefinedTable | None) -> dict[str, Any] | None:
    """Return the plain containers that `decode_refined` takes; None where there is nothing."""
    if refined is None:
        return None
    return {
        "origin_plus_one": compress(smallest_unsigned(refined.origin.astype(np.int64) - NO_MEMBER)),
        "values": compress(refined.values),
        "reached": compress(refined.reached.astype(np.uint8)),
        "dexterity": compress(refined.dexterity),
        "arm_joints": compress(refined.arm_joints),
        **({} if refined.hand is None else {"hand": compress(refined.hand)}),
        "objective": compress(refined.objective),
        "success": None if refined.success is None else _encode_success(refined.success),
    }


def decode_refined(encoded: object, weights: np.ndarray[Any, Any]) -> RefinedTable | None:
    """Return the encoded refined sets; None for a file without them.

    Args:
        encoded: What `encode_refined` returned.
        weights: Weights of the goals, sum 1, shape (G,).

    Raises:
        StoreFormatError: If something is missing or out of range.
        TcsError: If the arrays contradict each other.
    """
    if encoded is None:
        return None
    if not isinstance(encoded, dict):
        raise StoreFormatError("has invalid refined sets")
    origin = decompress(encoded, "origin_plus_one", "u", (None, None))
    if np.any(origin >= np.iinfo(np.int32).max):
        raise StoreFormatError("has refined sets out of range")
    shape = (*origin.shape, weights.size)
    return RefinedTable(
        origin=(origin.astype(np.int64) + NO_MEMBER).astype(np.int32),
        values=decompress(encoded, "values", "f8", (*origin.shape, None)),
        reached=decompress(encoded, "reached", "u1", shape).astype(np.bool_),
        dexterity=decompress(encoded, "dexterity", "f4", shape),
        arm_joints=decompress(encoded, "arm_joints", "f4", (*shape, 7)),
        objective=decompress(encoded, "objective", "f8", origin.shape[:1]),
        weights=weights,
        success=_decode_success(encoded.get("success"), origin.shape[:1]),
        hand=decompress(encoded, "hand", "u1", shape) if "hand" in encoded else None,
    )


def _encode_success(success: RefinedSuccess) -> dict[str, Any]:
    """Return the plain containers that `_decode_success` takes."""
    arrays = {"mean": success.mean, "low": success.low, "high": success.high}
    return {**{name: compress(array) for name, array in arrays.items()}, "samples": success.samples}


def _decode_success(encoded: object, shape: tuple[int, ...]) -> RefinedSuccess | None:
    """Return the encoded success of refined sets; None without one."""
    if encoded is None:
        return None
    if not isinstance(encoded, dict) or type(encoded.get("samples")) is not int:
        raise StoreFormatError("has an invalid success of its refined sets")
    mean, low, high = (decompress(encoded, name, "f8", shape) for name in ("mean", "low", "high"))
    return RefinedSuccess(mean=mean, low=low, high=high, samples=encoded["samples"])


def save_scores(path: str | os.PathLike[str], file: ScoreFile) -> None:
    """Write a score file, wholly or not at all.

    Args:
        path: Where to write; its folder must exist.
        file: What to write.

    Raises:
        OutputError: If it cannot be written there.
    """
    write_joblib(Path(path), encode(file), SCORE_FILE)


def load_scores(path: str | os.PathLike[str], most: int | None = None) -> ScoreFile:
    """Read a score file without trusting it: nothing in it is called or imported.

    Reading it takes at most four times the memory of its decoded arrays.

    Args:
        path: A file written by `save_scores`.
        most: Most bytes that its arrays may take once they are decoded; None for any.

    Raises:
        StoreError: If it cannot be read.
        StoreFormatError: If it is truncated, foreign, inconsistent, of another format version, or
            takes more memory.
        UnsafeStoreError: If it names anything outside the allow-list.
    """
    path = Path(path)
    content = read_joblib(path)
    return explained(path, lambda: decode(content, path, most))

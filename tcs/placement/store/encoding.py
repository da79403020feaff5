"""Score files encoded as plain containers and compressed arrays: saved, loaded, decoded."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

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
from tcs.placement.store.codec import decode_columns, decode_names, encode_columns
from tcs.placement.store.score_file import (
    DESCRIPTIONS,
    ScoreFile,
    StateTables,
    check_sets_of,
)
from tcs.placement.tables import (
    BaseLattice,
    Estimates,
    Reason,
    RefinedTable,
    ScoreTable,
    SetTable,
    SuccessTable,
    WindowTable,
)
from tcs.placement.tables.columns import ArrayTable
from tcs.placement.tables.sets import MOVES, Groups

Table = TypeVar("Table", bound=ArrayTable)

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
                "success": None if table.success is None else encode_columns(table.success),
                "refined": _encode_refined(table.refined),
                "windows": None if table.windows is None else encode_columns(table.windows),
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
    success = _decode_if(SuccessTable, encoded.get("success"), "estimates of success")
    refined = _decode_refined(encoded.get("refined"), sets.weights)
    windows = _decode_if(WindowTable, encoded.get("windows"), "parking windows")
    read_scores = partial(_read_scores, scores, sets, grid.size, path)
    return StateTables(sets, read_scores, success, refined, windows)


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
        "pair_plus_one": compress(_plus_one(scores.pair)),
        "pair_names": [list(names) for names in scores.pair_names],
        **encode_columns(scores),
    }


def _decode_scores(encoded: dict[str, Any], sets: SetTable, size: int) -> ScoreTable:
    goals = sets.weights.size
    columns = decode_columns(
        ScoreTable, encoded, {"H": size, "G": goals, "R": AtMost(size * goals)}
    )
    reason = columns["reason"]
    if len(sets.candidates) and sets.candidates[-1] >= size:
        raise StoreFormatError("has sets of more configurations than scores")
    names = decode_names(encoded)
    stored = decompress(encoded, "pair_plus_one", "u", reason.shape)
    pair: NDArray[Any] = large_zeros(reason.shape, _pair_type(len(names)))
    for rows in chunks(stored, pair):
        if np.any(stored[rows] > len(names)):
            raise StoreFormatError(f"has a pair of bodies beyond its {len(names)} pair_names")
        pair[rows] = stored[rows]
        pair[rows] -= 1
    return ScoreTable(
        **columns,
        dexterity=_decode_dexterity(encoded, sets, reason),
        pair=pair,
        pair_names=names,
        weights=sets.weights,
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
_OF_PAIRS = {
    "count": "pair_count",
    "manipulability": "pair_manipulability",
    "total": "pair_sum",
    "member_total": "member_sum",
}
"""Names in files of columns of the groups of pairs that are named otherwise."""


def encode_sets(sets: SetTable) -> dict[str, Any]:
    """Return the plain containers that `decode_sets` takes."""
    cells, triples = len(sets.cell_xy), None
    if sets.triples is not None:
        triples = {
            "least": float(sets.triples.least),
            "step": compress(_steps(sets.triples, cells)),
            "reachability": compress(sets.triples.reachability),
            **encode_columns(sets.triples),
        }
    # There are few different values: at most one for each subset of the goals.
    values, code = np.unique(sets.pairs.reachability, return_inverse=True)
    return {
        **{name: type_(getattr(sets, name)) for name, type_ in _PLAIN.items()},
        "tile": float(sets.tile),
        **encode_columns(sets),
        "dexterity": compress(sets.dexterity[sets.reached]),
        "pair_step": compress(_steps(sets.pairs, cells)),
        **encode_columns(sets.pairs, _OF_PAIRS),
        "reachability_values": compress(values),
        "reachability_code": compress(smallest_unsigned(code.astype(np.int64))),
        "triples": triples,
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
    size = grid.size
    lengths = {"G": AtMost(int(GOALS.high)), "C": AtMost(size), "N": AtMost(size)}
    columns = decode_columns(SetTable, encoded, lengths, size)
    reached, cell_xy = columns["reached"], columns["cell_xy"]
    dexterity = np.zeros(reached.shape, dtype=np.float32)
    dexterity[reached] = decompress(encoded, "dexterity", "f4", (int(np.count_nonzero(reached)),))
    return SetTable(
        **{name: encoded[name] for name in _PLAIN},
        tile=encoded.get("tile", 0.0),
        **columns,
        dexterity=dexterity,
        pairs=_decode_pairs(encoded, len(cell_xy)),
        triples=_decode_triples(encoded.get("triples"), len(cell_xy)),
        best=_indices(encoded, "best"),
        best_single=_indices(encoded, "best_single"),
        lattice=_decode_lattice(encoded.get("lattice")),
    )


def _steps(groups: Groups, cells: int) -> NDArray[Any]:
    """Return differences of the numbers that the cells of groups are the digits of."""
    number = np.zeros(len(groups.cells), dtype=np.int64)
    for column in groups.cells.T.astype(np.int64):
        number = number * cells + column
    return smallest_unsigned(differences(number))


def _decode_pairs(encoded: dict[str, Any], cells: int) -> Groups:
    """Return the encoded sets of two."""
    values = decompress(encoded, "reachability_values", "f8", (None,))
    step = decompress(encoded, "pair_step", "u", (AtMost(cells**2),))
    code = decompress(encoded, "reachability_code", "u", step.shape)
    if np.any(code >= values.size):
        raise StoreFormatError(f"has a reachability code beyond its {values.size} values")
    columns = decode_columns(Groups, encoded, {"K": step.size}, keys=_OF_PAIRS)
    return Groups(**columns, cells=_cells(step, cells, 2), reachability=values[code])


def _decode_triples(encoded: object, cells: int) -> Groups | None:
    """Return the encoded sets of three; None where there are none."""
    if encoded is None:
        return None
    if not isinstance(encoded, dict) or type(encoded.get("least")) is not float:
        raise StoreFormatError("has invalid sets of three")
    step = decompress(encoded, "step", "u", (None,))
    return Groups(
        **decode_columns(Groups, encoded, {"K": step.size}),
        cells=_cells(step, cells, 3),
        reachability=decompress(encoded, "reachability", "f8", step.shape),
        least=encoded["least"],
    )


def _cells(steps: NDArray[Any], cells: int, members: int) -> NDArray[np.int32]:
    """Return the cells of groups of which `_steps` are given."""
    return _digits(ascending_from(steps, cells**members + 1, "groups of cells"), cells, members)


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


def _decode_if(
    table: type[Table],
    encoded: object,
    what: str,
    lengths: dict[str, int] | None = None,
    **others: Any,
) -> Table | None:
    """Return a table that is stored as its columns alone; None where there is none.

    Args:
        table: Its class.
        encoded: What `encode_columns` returned, or None.
        what: Name of the table in an error message.
        lengths: Lengths that are known, as for `decode_columns`.
        **others: Fields that are not stored in it.

    Raises:
        StoreFormatError: If something is missing or out of range.
        TcsError: If the arrays contradict each other.
    """
    if encoded is None:
        return None
    if not isinstance(encoded, dict):
        raise StoreFormatError(f"has invalid {what}")
    return table(**decode_columns(table, encoded, lengths), **others)


def _encode_refined(refined: RefinedTable | None) -> dict[str, Any] | None:
    if refined is None:
        return None
    success = refined.success
    return {
        **encode_columns(refined),
        "success": None if success is None else encode_columns(success),
    }


def _decode_refined(encoded: object, weights: NDArray[np.float64]) -> RefinedTable | None:
    """Return the encoded refined sets; None for a file without them."""
    success = encoded.get("success") if isinstance(encoded, dict) else None
    if isinstance(success, dict) and type(success.get("samples")) is int:
        # Files from before had one number of samples, and the mean under another name.
        mean = decompress(success, "mean", "f8", (None,))
        samples = np.full(mean.shape, max(0, min(success["samples"], 2**31 - 1)), np.uint32)
        success = {**success, "success": success["mean"], "samples": compress(samples)}
    return _decode_if(
        RefinedTable,
        encoded,
        "refined sets",
        {"G": weights.size},
        weights=weights,
        success=_decode_if(Estimates, success, "success of its refined sets"),
    )


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

"""Encode a set table as plain containers and compressed arrays, and decode it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.files.compression import (
    MAX_BYTES,
    AtMost,
    ascending_from,
    compress,
    decompress,
    differences,
    smallest_unsigned,
)
from tcs.files.joblib_file import check_types
from tcs.files.quantities import GOALS
from tcs.model.grid import Grid
from tcs.placement.tables import BaseLattice, SetTable
from tcs.placement.tables.base_lattice import MOVES
from tcs.placement.tables.groups import BOUNDS, Groups

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

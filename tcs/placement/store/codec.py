"""The codec of stored tables: their columns as compressed arrays, as `COLUMNS` describes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.files.compression import (
    AtMost,
    ascending_from,
    compress,
    decompress,
    differences,
    smallest_unsigned,
)
from tcs.placement.tables.columns import ArrayTable, Column, Form

NO_KEYS: Mapping[str, str] = {}
_UNSIGNED = (Form.SMALLEST, Form.PLUS_ONE, Form.STEPS)


def encode_columns(table: ArrayTable, keys: Mapping[str, str] = NO_KEYS) -> dict[str, Any]:
    """Return the columns of a table as plain containers, but for those that are stored apart.

    Args:
        table: The table.
        keys: Names in the file of columns that are named otherwise there.
    """
    encoded = {}
    for name, column in table.COLUMNS.items():
        array = getattr(table, name)
        if array is not None and column.form is not Form.APART:
            encoded[keys.get(name, _key(name, column))] = compress(_stored(array, column.form))
    return encoded


def decode_columns(
    table: type[ArrayTable],
    encoded: dict[str, Any],
    lengths: Mapping[str, int | AtMost] | None = None,
    end: int = np.iinfo(np.int32).max,
    keys: Mapping[str, str] = NO_KEYS,
) -> dict[str, Any]:
    """Return the columns that `encode_columns` encoded, by name; None for one that may be missing.

    Args:
        table: The class of the table.
        encoded: Plain containers with the columns, and maybe others.
        lengths: Lengths by their names in `COLUMNS`; others follow from the first column.
        end: Exclusive upper bound of ascending numbers.
        keys: As for `encode_columns`.

    Raises:
        StoreFormatError: If one is missing, damaged, or of another type, shape or range.
    """
    known: dict[str, int | AtMost] = dict(lengths or {})
    decoded: dict[str, Any] = {}
    for name, column in table.COLUMNS.items():
        key = keys.get(name, _key(name, column))
        if column.form is Form.APART:
            continue
        if column.optional and key not in encoded:
            decoded[name] = None
            continue
        dtype = np.dtype(column.dtype)  # type: ignore[arg-type]
        element = {Form.FLAGS: "u1"} | dict.fromkeys(_UNSIGNED, "u")
        plain = f"{dtype.kind}{dtype.itemsize}"
        shape = column.lengths(known)
        stored = decompress(encoded, key, element.get(column.form, plain), shape)
        known |= column.named(stored.shape)
        decoded[name] = _restored(stored, name, column.form, dtype, end)
    return decoded


def _key(name: str, column: Column) -> str:
    """Return the name of a column in a file."""
    return column.key or (f"{name}_plus_one" if column.form is Form.PLUS_ONE else name)


def _stored(array: NDArray[Any], form: Form) -> NDArray[Any]:
    """Return an array of numbers as they are stored."""
    if form is Form.FLAGS:
        return array.astype(np.uint8)
    if form not in _UNSIGNED:
        return array
    numbers = array.astype(np.int64)
    if form is Form.PLUS_ONE:
        numbers += 1
    return smallest_unsigned(differences(numbers) if form is Form.STEPS else numbers)


def _restored(
    stored: NDArray[Any], name: str, form: Form, dtype: np.dtype[Any], end: int
) -> NDArray[Any]:
    """Return stored numbers as an array of a table."""
    if form is Form.FLAGS:
        return np.asarray(stored != 0)
    if form is Form.STEPS:
        return ascending_from(stored, end, name).astype(dtype)
    if form is Form.PLAIN:
        return stored
    if np.any(stored > np.iinfo(dtype).max):
        raise StoreFormatError(f"has numbers of '{name}' that are out of range")
    restored = stored.astype(dtype)
    return np.subtract(restored, 1, dtype=dtype) if form is Form.PLUS_ONE else restored


def decode_names(encoded: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    """Return the stored names of pairs of bodies.

    Raises:
        StoreFormatError: If they are not pairs of names.
    """
    names = encoded.get("pair_names")
    if not isinstance(names, list) or not all(
        isinstance(n, list) and len(n) == 2 and all(isinstance(body, str) for body in n)
        for n in names
    ):
        raise StoreFormatError("has 'pair_names' that are not pairs of names")
    return tuple((first, second) for first, second in names)

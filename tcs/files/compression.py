"""Arrays of numbers, compressed one by one, so that each can be decompressed on demand."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.files.mapped import CHUNK_BYTES, chunks, large_zeros, release

LEVEL = 3
"""Compression level of zlib. Joint angles are nearly incompressible: higher levels and lzma take
much longer to save a few percent, and lzma is slow to decompress as well."""

MAX_BYTES = 2 * 1024**3
"""Greatest size of a decompressed array [bytes]: several times that of any array of `tcs`, and less
than the memory of a common machine."""

MAX_RATIO = 200
"""Most bytes that a byte of a file may decompress to on average, beyond FREE_BYTES. Numbers of
a real file decompress to three or four; a file made to fill the memory to a thousand."""
FREE_BYTES = 32 * 1024**2
"""Bytes that any file may decompress to: small files of equal numbers compress without limit."""

_WIDEST = 8
"""Most bytes of a decoded number."""
_ENDLESS = 1 << 62
"""Sum of sizes beyond which it does not matter."""
_TYPES = ("u1", "u2", "u4", "u8", "f4", "f8")


@dataclass(frozen=True, slots=True)
class AtMost:
    """A length of an array that may be anything up to a greatest one."""

    length: int


def compress(array: NDArray[Any]) -> dict[str, Any]:
    """Return an array of numbers as plain containers around its compressed bytes."""
    values = np.ascontiguousarray(array)
    size = values.dtype.itemsize
    flat = values.reshape(-1, 1)
    compressor = zlib.compressobj(LEVEL)
    parts = []
    # Bytes of equal significance together: signs and exponents repeat, mantissas do not.
    for plane in range(size):
        for rows in chunks(flat):
            little = flat[rows].astype(values.dtype.newbyteorder("<"), copy=False)
            parts.append(compressor.compress(little.view(np.uint8)[:, plane].tobytes()))
    parts.append(compressor.flush())
    return {
        "type": f"{array.dtype.kind}{size}",
        "shape": list(array.shape),
        "bytes": np.frombuffer(b"".join(parts), dtype=np.uint8),
    }


def smallest_unsigned(values: NDArray[np.int64]) -> NDArray[Any]:
    """Return whole numbers >= 0 in the smallest unsigned type that can represent them."""
    return values.astype(np.min_scalar_type(int(values.max(initial=0))))


def check_claims(content: object, exempt: Container[str] = ()) -> None:
    """Refuse a file whose arrays claim far more bytes than it has, before any is decompressed.

    Args:
        content: The containers of the file.
        exempt: Names of arrays whose size follows from others, e.g. one number for each pair of
            configuration and goal: `decompress` checks their exact shape.

    Raises:
        StoreFormatError: If they claim more than `FREE_BYTES` and `MAX_RATIO` times the file's.
    """
    data: dict[int, int] = {}

    def claimed(name: str, array: Mapping[str, Any]) -> int:
        data[id(array["bytes"])] = array["bytes"].nbytes
        elements = 0 if name in exempt else _elements(array)
        return elements and elements * int(array["type"][1])

    total = _total(content, claimed)
    stored = sum(data.values())
    most = FREE_BYTES + MAX_RATIO * stored
    if total > most:
        raise StoreFormatError(
            f"claims arrays of {total:,} bytes in {stored:,} bytes of the file; at most {most:,} "
            "are possible"
        )


def decoded_bytes(content: object, narrow: Container[str] = ()) -> int:
    """Return the memory that the arrays of a file take once they are decoded, or less.

    Whole numbers are stored in the smallest type that has room for them, and decoded to others.

    Args:
        content: The containers of the file.
        narrow: Names of arrays that take half as much for each number.
    """
    return _total(
        content,
        lambda name, array: _elements(array) * (_WIDEST // 2 if name in narrow else _WIDEST),
    )


def _total(content: object, size_of: Callable[[str, Mapping[str, Any]], int]) -> int:
    """Return the sum of the sizes of all arrays in containers, of each as often as it is there.

    A list may contain another one many times over, or itself: each is looked at once.
    """
    totals: dict[int, int] = {}
    begun: set[int] = set()
    waiting = [content]
    while waiting:
        value = waiting[-1]
        if id(value) in totals:
            waiting.pop()
            continue
        parts = _parts(value)
        if id(value) not in begun:
            begun.add(id(value))
            waiting.extend(one for _, one in parts if id(one) not in begun and not _is_array(one))
        else:
            sizes = (
                size_of(name, one) if _is_array(one) else totals.get(id(one), 0)
                for name, one in parts
            )
            totals[id(value)] = min(sum(sizes), _ENDLESS)
    return totals[id(content)]


def _parts(value: object) -> list[tuple[str, Any]]:
    """Return the containers in a container, each with the key it is under."""
    entries: Iterable[tuple[Any, Any]] = ()
    if isinstance(value, dict):
        entries = value.items()
    elif isinstance(value, list | tuple):
        entries = (("", entry) for entry in value)
    return [(str(key), entry) for key, entry in entries if isinstance(entry, dict | list | tuple)]


def _is_array(value: object) -> TypeGuard[Mapping[str, Any]]:
    """Return whether containers are those of an array."""
    return isinstance(value, dict) and isinstance(value.get("bytes"), np.ndarray)


def _elements(encoded: Mapping[str, Any]) -> int:
    """Return the number of elements that an encoded array claims; 0 if that cannot be read."""
    shape = encoded.get("shape")
    if encoded.get("type") not in _TYPES or not isinstance(shape, list):
        return 0
    if not all(type(n) is int and 0 <= n <= MAX_BYTES for n in shape):
        return 0
    return math.prod(shape)


def decompress(
    encoded: dict[str, Any], name: str, element: str, shape: tuple[int | AtMost | None, ...]
) -> NDArray[Any]:
    """Return the array stored under a name, decompressed and checked.

    Args:
        encoded: Containers with the arrays, by name.
        name: Name of the array.
        element: Required element type, "u" for any unsigned one.
        shape: Required shape: None for an arbitrary length, `AtMost` for one up to a bound.

    Raises:
        StoreFormatError: If the array is missing, damaged, or of another type or shape.
    """
    compressed = encoded.get(name)
    if not isinstance(compressed, dict):
        raise StoreFormatError(f"lacks the array '{name}'")
    found, stated, data = compressed.get("type"), compressed.get("shape"), compressed.get("bytes")
    if (
        found not in _TYPES
        or not isinstance(stated, list)
        or not all(type(n) is int and 0 <= n <= MAX_BYTES for n in stated)
        or not isinstance(data, np.ndarray)
        or data.dtype != np.uint8
        or data.ndim != 1
    ):
        raise StoreFormatError(f"has an invalid array '{name}'")
    fits = found[0] == "u" if element == "u" else found == element
    if (
        not fits
        or len(stated) != len(shape)
        or not all(_fits(n, m) for n, m in zip(shape, stated, strict=True))
    ):
        raise StoreFormatError(
            f"has an array '{name}' of type {found} and shape {stated}, which does not belong there"
        )
    dtype = np.dtype(f"<{found}")
    rows = math.prod(stated)
    if rows * dtype.itemsize > MAX_BYTES:
        raise StoreFormatError(
            f"has an array '{name}' of {rows * dtype.itemsize} bytes; at most {MAX_BYTES} are "
            "allowed"
        )
    values: NDArray[np.uint8] = large_zeros((rows, dtype.itemsize), np.uint8)
    _inflate(name, data, values)
    return values.view(dtype).reshape(stated).astype(dtype.newbyteorder("="), copy=False)


def _fits(length: int | AtMost | None, stated: int) -> bool:
    """Return whether the stated length of an array is the one it must have."""
    if isinstance(length, AtMost):
        return stated <= length.length
    return length is None or length == stated


def _inflate(name: str, data: NDArray[np.uint8], values: NDArray[np.uint8]) -> None:
    """Fill the columns of an array, one after the other, with exactly the decompressed bytes."""
    decompressor = zlib.decompressobj()
    waiting: bytes | memoryview = np.ascontiguousarray(data).data
    size = values.size

    def next_bytes(most: int) -> bytes:
        nonlocal waiting
        found = decompressor.decompress(waiting, most)
        waiting = decompressor.unconsumed_tail
        return found

    def damaged(what: object) -> StoreFormatError:
        return StoreFormatError(f"has a damaged array '{name}' ({what})")

    try:
        for column in values.T:
            filled = 0
            while filled < column.size:
                found = next_bytes(min(CHUNK_BYTES, column.size - filled))
                if not found:
                    raise damaged(f"not {size} bytes")
                column[filled : filled + len(found)] = np.frombuffer(found, np.uint8)
                filled += len(found)
                release(values)
        if next_bytes(1) or not decompressor.eof or decompressor.unused_data:
            raise damaged(f"not {size} bytes")
    except (zlib.error, MemoryError) as error:
        raise damaged(error) from None


def differences(ascending: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the differences of ascending numbers >= 0, the first from 0; they compress well."""
    return np.asarray(np.diff(ascending, prepend=0), dtype=np.int64)


def ascending_from(steps: NDArray[Any], end: int, what: str) -> NDArray[np.int64]:
    """Return the ascending numbers that have these differences, the inverse of `differences`.

    Args:
        steps: Unsigned differences, the first from 0.
        end: Exclusive upper bound of the numbers.
        what: Name of the numbers in messages.

    Raises:
        StoreFormatError: If a number is not less than `end`.
    """
    # Summed in floating point first: integer overflow must not make forged steps valid.
    if steps.sum(dtype=np.float64) >= float(end):
        raise StoreFormatError(f"has {what} that do not exist")
    return np.cumsum(steps, dtype=np.int64)

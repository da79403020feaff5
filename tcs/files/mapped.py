"""Large arrays in a memory-mapped scratch file, so that their size is bounded by the disk alone."""

from __future__ import annotations

import math
import mmap
import os
import tempfile
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tcs.errors import OutputError

LEAST_BYTES = 64 * 1024**2
"""Arrays of fewer bytes stay in memory: all of the paper's grids."""

CHUNK_BYTES = 16 * 1024**2
"""Bytes of an array that are worked on at once, with temporary arrays of some times that size."""


def large_zeros(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """Return an array of zeros; a large one is mapped to a scratch file without a name.

    The file is in the folder of `tempfile.gettempdir`, which the environment variable TMPDIR sets,
    and vanishes with the array or with the process, however that ends.

    Raises:
        OutputError: If the folder has no room for it.
    """
    count, element = math.prod(shape), np.dtype(dtype)
    size = count * element.itemsize
    if size < LEAST_BYTES:
        return np.zeros(shape, element)
    folder = tempfile.gettempdir()
    try:
        with tempfile.TemporaryFile(dir=folder, prefix="tcs-") as stream:
            # Without it, a disk that fills up later would end the process by a signal.
            os.posix_fallocate(stream.fileno(), 0, size)
            mapped = mmap.mmap(stream.fileno(), size)
    except OSError as error:
        raise OutputError(
            f"Scratch file of {size:,} bytes cannot be made in '{folder}': {error.strerror}. "
            "Make room, or set TMPDIR to a folder with room for it."
        ) from error
    return np.frombuffer(mapped, element, count).reshape(shape)


def release(array: NDArray[Any]) -> None:
    """Let the system take the memory of a mapped array back; its values stay in the file.

    Other arrays are left as they are.
    """
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    if isinstance(base, memoryview):
        base = base.obj
    if isinstance(base, mmap.mmap):
        base.madvise(mmap.MADV_DONTNEED)


def chunks(*arrays: NDArray[Any]) -> Iterator[slice]:
    """Yield slices of rows that together cover arrays of equal length, some megabytes at a time.

    The memory of each slice of a mapped array may be taken back when the next one is asked for.

    >>> list(chunks(np.zeros((3, 2))))
    [slice(0, 3, None)]
    """
    rows = len(arrays[0])
    width = max(array.nbytes for array in arrays) // max(rows, 1)
    length = max(1, CHUNK_BYTES // max(width, 1))
    for start in range(0, rows, length):
        yield slice(start, min(start + length, rows))
        for array in arrays:
            release(array)

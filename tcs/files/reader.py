"""Read a joblib file without trusting it.

A joblib file is a pickle, and a pickle is a program: it may name any function of any
module and call it. This reader takes the part of the pickle language that plain
containers need, and knows three names. They stand for inert tokens, not for the
classes themselves, so nothing that a file contains is ever called:

    joblib.numpy_pickle.NumpyArrayWrapper   an array follows
    numpy.ndarray, numpy.dtype              its class and its element type

Arrays are views of the file's bytes, read by us: joblib's own reader would hand
arrays of Python objects to pickle again.
"""

from __future__ import annotations

import io
import math
import os
import pickle
import stat
import zlib
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreError, StoreFormatError, TcsError, UnsafeStoreError

MAX_BYTES = 2 * 1024**3
"""Most bytes a file may decompress to: several times the largest store, within a common machine."""

ELEMENT_TYPES = ("u1", "u2", "u4", "u8", "i4", "i8", "f4", "f8")
"""Element types of arrays: plain numbers. Objects ("O") would be pickles inside the pickle."""

MAX_DIMENSIONS = 4
"""Our arrays have one or two."""

AGAIN = "Make it again with `tcs score`."

SCORE_FILE = "Score file"
"""What messages call a file when the caller gives it no other name."""

_PLAIN_OPERATIONS = (
    *(pickle.PROTO, pickle.FRAME, pickle.STOP, pickle.MARK),
    *(pickle.NONE, pickle.NEWTRUE, pickle.NEWFALSE, pickle.BINFLOAT),
    *(pickle.BININT, pickle.BININT1, pickle.BININT2, pickle.LONG1),
    *(pickle.SHORT_BINUNICODE, pickle.BINUNICODE),
    *(pickle.EMPTY_TUPLE, pickle.TUPLE1, pickle.TUPLE2, pickle.TUPLE3, pickle.TUPLE),
    *(pickle.EMPTY_LIST, pickle.APPEND, pickle.APPENDS),
    *(pickle.EMPTY_DICT, pickle.SETITEM, pickle.SETITEMS),
    *(pickle.MEMOIZE, pickle.BINPUT, pickle.LONG_BINPUT, pickle.BINGET, pickle.LONG_BINGET),
    # These name a global, and end in our `find_class`.
    *(pickle.GLOBAL, pickle.STACK_GLOBAL, pickle.INST),
)
_REFUSED_OPERATIONS = (
    *(pickle.EXT1, pickle.EXT2, pickle.EXT4, pickle.PERSID, pickle.BINPERSID),
    *(pickle.OBJ, pickle.NEWOBJ_EX),
)

Value = TypeVar("Value")


class _Known(Enum):
    """The names a file may use, as tokens without any behaviour."""

    ARRAY_FOLLOWS = ("joblib.numpy_pickle", "NumpyArrayWrapper")
    ARRAY = ("numpy", "ndarray")
    ELEMENT_TYPE = ("numpy", "dtype")


class _ElementType:
    """An element type under construction: `np.dtype` is never given anything but two letters."""

    def __init__(self, code: object) -> None:
        if code not in ELEMENT_TYPES:
            raise UnsafeStoreError(
                f"has an array of type {_shown(code)}; only plain numbers are allowed "
                f"({', '.join(ELEMENT_TYPES)})"
            )
        self.dtype = np.dtype(str(code))

    def set_byte_order(self, state: object) -> None:
        """Take the byte order from the state that numpy pickles: (version, order, ...)."""
        order = state[1] if isinstance(state, tuple) and len(state) > 1 else None
        if order not in ("<", ">", "|"):
            raise StoreFormatError("has an array of unknown byte order")
        self.dtype = self.dtype.newbyteorder(order)


class _ArrayToCome:
    """Stands on the stack between the name of the array wrapper and its state."""


class _Reader(pickle._Unpickler):
    """The restricted reader of one file's bytes."""

    def __init__(self, data: bytes) -> None:
        self._file = io.BytesIO(data)
        self._data = data
        self.stack: list[Any] = []
        super().__init__(self._file)

    def load(self) -> object:
        """Return the one value in the file."""
        value = super().load()
        if self._file.tell() != len(self._data):
            raise StoreFormatError("goes on after its end")
        return value

    def find_class(self, module: str, name: str) -> _Known:
        """Return the token of a known name.

        Raises:
            UnsafeStoreError: If the name is any other.
        """
        try:
            return _Known((module, name))
        except ValueError:
            raise UnsafeStoreError(
                f"asks for {_shown(f'{module}.{name}')}, which is outside the allow-list "
                "(numpy arrays and plain containers)"
            ) from None

    def load_reduce(self) -> None:
        """Where pickle would call anything: build an element type, the only call we know."""
        arguments = self.stack.pop()
        called = self.stack.pop()
        if called is not _Known.ELEMENT_TYPE or not isinstance(arguments, tuple) or not arguments:
            raise UnsafeStoreError(f"calls {_shown(called)}, and files may call nothing")
        self.stack.append(_ElementType(arguments[0]))

    def load_newobj(self) -> None:
        """Where pickle would make an object of any class: announce an array, nothing else."""
        arguments = self.stack.pop()
        made = self.stack.pop()
        if made is not _Known.ARRAY_FOLLOWS or arguments != ():
            raise UnsafeStoreError(f"makes an object of {_shown(made)}; only arrays are allowed")
        self.stack.append(_ArrayToCome())

    def load_build(self) -> None:
        """Where pickle would set any attribute: complete an element type or an array."""
        state = self.stack.pop()
        built = self.stack[-1]
        if isinstance(built, _ElementType):
            built.set_byte_order(state)
        elif isinstance(built, _ArrayToCome):
            self.stack[-1] = self._array(state)
        else:
            raise UnsafeStoreError(f"sets attributes of {_shown(built)}; only of arrays is allowed")

    def refuse(self) -> None:
        """Refuse an operation that reaches outside the file by other means than a name."""
        raise UnsafeStoreError("asks for objects from outside the file (a pickle extension)")

    def _array(self, state: object) -> NDArray[Any]:
        """Return the array whose description has just been read and whose bytes follow."""
        if not isinstance(state, dict):
            raise StoreFormatError("has an array without a description")
        element, shape, order = state.get("dtype"), state.get("shape"), state.get("order")
        if state.get("subclass") is not _Known.ARRAY or not isinstance(element, _ElementType):
            raise StoreFormatError("has an array of unknown kind")
        if (
            not isinstance(shape, tuple)
            or len(shape) > MAX_DIMENSIONS
            or not all(type(n) is int and 0 <= n <= MAX_BYTES for n in shape)
            or order not in ("C", "F")
        ):
            raise StoreFormatError(f"has an array of impossible shape {_shown(shape)}")
        if state.get("numpy_array_alignment_bytes") is not None:
            padding = self._file.read(1)
            self._file.seek(padding[0] if padding else 0, io.SEEK_CUR)
        begin, count = self._file.tell(), math.prod(shape)
        end = begin + count * element.dtype.itemsize
        if end > len(self._data):
            raise StoreFormatError(f"claims an array of shape {shape}, but ends before it does")
        self._file.seek(end)
        if not count:
            return np.zeros(shape, dtype=element.dtype.newbyteorder("="))
        array = np.frombuffer(self._data, dtype=element.dtype, count=count, offset=begin)
        array = array.reshape(shape, order=order)
        return array.astype(element.dtype.newbyteorder("="), copy=False)

    dispatch: ClassVar[dict[int, Any]] = {
        **{op[0]: pickle._Unpickler.dispatch[op[0]] for op in _PLAIN_OPERATIONS},
        **dict.fromkeys((op[0] for op in _REFUSED_OPERATIONS), refuse),
        pickle.REDUCE[0]: load_reduce,
        pickle.NEWOBJ[0]: load_newobj,
        pickle.BUILD[0]: load_build,
    }
    """What each operation does; an operation that is not listed does not exist."""


def read_joblib(path: Path, what: str = SCORE_FILE, again: str = AGAIN) -> object:
    """Return what a joblib file holds: plain containers and arrays of numbers.

    Args:
        path: A file written by `joblib.dump`, compressed by zlib or not at all.
        what: What to call it in a message.
        again: How such a file is made, for a message.

    Raises:
        StoreError: If it cannot be read.
        StoreFormatError: If it is truncated, foreign, or decompresses to more than 2 GB.
        UnsafeStoreError: If it names anything outside the allow-list.
    """
    name = f"{what} '{path}'"
    reader = _Reader(_decompress(name, _bytes_of(path, name, again), again))
    return explained(path, reader.load, what, again)


def explained(
    path: Path, read: Callable[[], Value], what: str = SCORE_FILE, again: str = AGAIN
) -> Value:
    """Return what `read` does, and turn whatever it raises into one line about the file."""
    try:
        return read()
    except UnsafeStoreError as error:
        raise UnsafeStoreError(
            f"{what} '{path}' {error}. It was not written by tcs: do not open it with any "
            "other program either."
        ) from None
    except TcsError as error:
        # One line, whatever names a file brings along.
        said = " ".join(str(error).split()).rstrip(".")
        raise StoreFormatError(f"{what} '{path}': {said}. {again}") from None
    except Exception as error:
        # Bytes that are no pickle can break its reader in about any way, from KeyError (no such
        # operation) to OverflowError; none of them says more than this.
        raise StoreFormatError(
            f"{what} '{path}' is truncated or was not written by tcs "
            f"({type(error).__name__} while reading). {again}"
        ) from None


def _bytes_of(path: Path, name: str, again: str) -> bytes:
    """Return the bytes of a regular file of bearable size."""
    try:
        status = os.stat(path)
        if not stat.S_ISREG(status.st_mode):
            raise StoreError(f"{name} is no regular file. Name one that is.")
        if status.st_size > MAX_BYTES:
            raise StoreFormatError(
                f"{name} has {status.st_size} bytes; at most {MAX_BYTES} are read."
            )
        return path.read_bytes()
    except OSError as error:
        raise StoreError(
            f"{name} cannot be read: {error.strerror}. Check the path. {again}"
        ) from None


def _decompress(name: str, data: bytes, again: str) -> bytes:
    """Return the decompressed bytes, at most MAX_BYTES of them."""
    if data[:1] == pickle.PROTO:
        return data
    # The low half of the first byte names the method; 8 is the only one in use.
    if not data or data[0] & 0x0F != 8:
        raise StoreFormatError(
            f"{name} is {'empty' if not data else 'no joblib file of tcs'}. {again}"
        )
    decompressor = zlib.decompressobj()
    try:
        content = decompressor.decompress(data, MAX_BYTES + 1)
    except (zlib.error, MemoryError) as error:
        raise StoreFormatError(f"{name} is damaged ({error}). {again}") from None
    if len(content) > MAX_BYTES:
        raise StoreFormatError(
            f"{name} decompresses to more than {MAX_BYTES} bytes. It is damaged or made to "
            f"fill the memory. {again}"
        )
    if not decompressor.eof or decompressor.unused_data:
        what = "goes on after its end" if decompressor.eof else "is truncated"
        raise StoreFormatError(f"{name} {what}. {again}")
    return content


def _shown(value: object) -> str:
    """Return a value from the file for a message: short, on one line, nothing unprintable."""
    if isinstance(value, _Known):
        value = ".".join(value.value)
    shown = repr(value) if isinstance(value, str | int) else type(value).__name__
    return shown if len(shown) <= 100 else shown[:100] + "...'"

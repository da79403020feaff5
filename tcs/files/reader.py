"""A reader of joblib files that executes nothing from the file.

A joblib file is a pickle, and a pickle is a program: it may name any function of any module and
call it. This reader supports the part of the pickle language that plain containers need, and an
allow-list of three names. The names become inert tokens, not classes, so no content of a file is
ever called:

    joblib.numpy_pickle.NumpyArrayWrapper   an array follows
    numpy.ndarray, numpy.dtype              its class and its element type

Arrays are views of the bytes of the file: joblib's own reader would pass arrays of Python objects
to pickle again.
"""

from __future__ import annotations

import io
import math
import pickle
import zlib
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreError, StoreFormatError, TcsError, UnsafeStoreError
from tcs.files.compression import FREE_BYTES
from tcs.files.reading import read_bytes

MAX_BYTES = 2 * 1024**3
"""Greatest size after decompression [bytes]: several times that of the largest score file, and less
than the memory of a common machine."""

WRAPPED_RATIO = 20
"""Most bytes that a byte of a compressed file may decompress to on average, beyond FREE_BYTES: the
arrays in it are compressed already."""

FREE_OPERATIONS = 1_000_000
"""Operations of the pickle language that any file may have: the files of `tcs` have some thousand.
Each makes an object of about a hundred bytes."""
BYTES_PER_OPERATION = 50
"""Bytes of a decompressed file for each further operation, so that its objects take at most twice
the memory of its bytes."""

ELEMENT_TYPES = ("u1", "u2", "u4", "u8", "i4", "i8", "f4", "f8")
"""Element types of arrays: plain numbers. Arrays of objects ("O") contain further pickles."""

MAX_DIMENSIONS = 4
"""Greatest number of dimensions of an array; those written by `tcs` have one or two."""

AGAIN = "Make it again with `tcs score`."
"""Default advice in messages."""

SCORE_FILE = "Score file"
"""Default name of a file in messages."""

_PLAIN_OPERATIONS = (
    *(pickle.PROTO, pickle.FRAME, pickle.STOP, pickle.MARK),
    *(pickle.NONE, pickle.NEWTRUE, pickle.NEWFALSE, pickle.BINFLOAT),
    *(pickle.BININT, pickle.BININT1, pickle.BININT2, pickle.LONG1),
    *(pickle.SHORT_BINUNICODE, pickle.BINUNICODE),
    *(pickle.EMPTY_TUPLE, pickle.TUPLE1, pickle.TUPLE2, pickle.TUPLE3, pickle.TUPLE),
    *(pickle.EMPTY_LIST, pickle.APPEND, pickle.APPENDS),
    *(pickle.EMPTY_DICT,),
    *(pickle.MEMOIZE, pickle.BINPUT, pickle.LONG_BINPUT, pickle.BINGET, pickle.LONG_BINGET),
    # These refer to a global by name and call `find_class` below.
    *(pickle.GLOBAL, pickle.STACK_GLOBAL, pickle.INST),
)
_REFUSED_OPERATIONS = (
    *(pickle.EXT1, pickle.EXT2, pickle.EXT4, pickle.PERSID, pickle.BINPERSID),
    *(pickle.OBJ, pickle.NEWOBJ_EX),
)

Value = TypeVar("Value")


class _Known(Enum):
    """The names that a file may refer to, as tokens without behaviour."""

    ARRAY_FOLLOWS = ("joblib.numpy_pickle", "NumpyArrayWrapper")
    ARRAY = ("numpy", "ndarray")
    ELEMENT_TYPE = ("numpy", "dtype")


class _ElementType:
    """An element type under construction: `np.dtype` receives only a code of `ELEMENT_TYPES`."""

    def __init__(self, code: object) -> None:
        if code not in ELEMENT_TYPES:
            raise UnsafeStoreError(
                f"has an array of type {_shown(code)}; only plain numbers are allowed "
                f"({', '.join(ELEMENT_TYPES)})"
            )
        self.dtype = np.dtype(str(code))

    def set_byte_order(self, state: object) -> None:
        """Set the byte order from the state that numpy pickles: (version, order, ...)."""
        order = state[1] if isinstance(state, tuple) and len(state) > 1 else None
        if order not in ("<", ">", "|"):
            raise StoreFormatError("has an array of unknown byte order")
        self.dtype = self.dtype.newbyteorder(order)


class _ArrayToCome:
    """Placeholder on the stack between the name of the array wrapper and its state."""


def _counted(operation: Callable[[Any], None]) -> Callable[[Any], None]:
    """Return an operation of the reader that is counted first."""

    def counted(self: _Reader) -> None:
        self.counted()
        operation(self)

    return counted


def _check_keys(keys: list[Any]) -> None:
    """Refuse keys of a dict that are not text.

    Raises:
        StoreFormatError: If there is one.
    """
    for key in keys:
        if type(key) is not str:
            raise StoreFormatError(f"has the key {_shown(key)}; keys must be text")


class _Reader(pickle._Unpickler):
    """The restricted reader of one file's bytes."""

    def __init__(self, data: bytes) -> None:
        self._file = io.BytesIO(data)
        self._data = data
        self._left = FREE_OPERATIONS + len(data) // BYTES_PER_OPERATION
        self.stack: list[Any] = []
        super().__init__(self._file)

    def load(self) -> object:
        """Return the value in the file."""
        value = super().load()
        if self._file.tell() != len(self._data):
            raise StoreFormatError("has data after its end")
        return value

    def find_class(self, module: str, name: str) -> _Known:
        """Return the token of a known name.

        Raises:
            UnsafeStoreError: If the name is not on the allow-list.
        """
        try:
            return _Known((module, name))
        except ValueError:
            raise UnsafeStoreError(
                f"refers to {_shown(f'{module}.{name}')}, which is not on the allow-list "
                "(numpy arrays and plain containers)"
            ) from None

    def counted(self) -> None:
        """Count an operation, before it makes anything.

        Raises:
            StoreFormatError: If the file has too many.
        """
        self._left -= 1
        if self._left < 0:
            raise StoreFormatError(
                "has far more values than a file of tcs; it may be meant to fill the memory"
            )

    def load_setitem(self) -> None:
        """Add an entry to a dict; its key must be text, as keys of other types may collide."""
        _check_keys([self.stack[-2]])
        self._plain(pickle.SETITEM)

    def load_setitems(self) -> None:
        """Add entries to a dict; as `load_setitem`."""
        # The entries are on the stack of their own that began with a mark.
        _check_keys(self.stack[::2])
        self._plain(pickle.SETITEMS)

    def _plain(self, operation: bytes) -> None:
        plain: Any = pickle._Unpickler.dispatch[operation[0]]
        plain(self)

    def load_reduce(self) -> None:
        """Build an element type, where pickle would call any function."""
        arguments = self.stack.pop()
        called = self.stack.pop()
        if called is not _Known.ELEMENT_TYPE or not isinstance(arguments, tuple) or not arguments:
            raise UnsafeStoreError(f"calls {_shown(called)}, but a file must not call anything")
        self.stack.append(_ElementType(arguments[0]))

    def load_newobj(self) -> None:
        """Create the placeholder of an array, where pickle would create an object of any class."""
        arguments = self.stack.pop()
        made = self.stack.pop()
        if made is not _Known.ARRAY_FOLLOWS or arguments != ():
            raise UnsafeStoreError(f"creates an object of {_shown(made)}; only arrays are allowed")
        self.stack.append(_ArrayToCome())

    def load_build(self) -> None:
        """Complete an element type or an array, where pickle would set any attribute."""
        state = self.stack.pop()
        built = self.stack[-1]
        if isinstance(built, _ElementType):
            built.set_byte_order(state)
        elif isinstance(built, _ArrayToCome):
            self.stack[-1] = self._array(state)
        else:
            raise UnsafeStoreError(
                f"sets attributes of {_shown(built)}, which is allowed for arrays only"
            )

    def refuse(self) -> None:
        """Raise an error for an operation that refers to an object outside the file."""
        raise UnsafeStoreError("refers to objects outside the file (a pickle extension)")

    def _array(self, state: object) -> NDArray[Any]:
        """Return the array whose bytes follow its description `state`."""
        if not isinstance(state, dict):
            raise StoreFormatError("has an array without a description")
        element, shape, order = state.get("dtype"), state.get("shape"), state.get("order")
        if state.get("subclass") is not _Known.ARRAY or not isinstance(element, _ElementType):
            raise StoreFormatError("has an array of unknown type")
        if (
            not isinstance(shape, tuple)
            or len(shape) > MAX_DIMENSIONS
            or not all(type(n) is int and 0 <= n <= MAX_BYTES for n in shape)
            or order not in ("C", "F")
        ):
            raise StoreFormatError(f"has an array of invalid shape {_shown(shape)}")
        if state.get("numpy_array_alignment_bytes") is not None:
            padding = self._file.read(1)
            self._file.seek(padding[0] if padding else 0, io.SEEK_CUR)
        begin, count = self._file.tell(), math.prod(shape)
        end = begin + count * element.dtype.itemsize
        if end > len(self._data):
            raise StoreFormatError(f"ends before the end of an array of shape {shape}")
        self._file.seek(end)
        if not count:
            return np.zeros(shape, dtype=element.dtype.newbyteorder("="))
        array: NDArray[Any] = np.frombuffer(
            self._data, dtype=element.dtype, count=count, offset=begin
        )
        array = array.reshape(shape, order=order)
        return array.astype(element.dtype.newbyteorder("="), copy=False)

    dispatch: ClassVar[dict[int, Any]] = {
        **{op[0]: _counted(pickle._Unpickler.dispatch[op[0]]) for op in _PLAIN_OPERATIONS},
        pickle.SETITEM[0]: _counted(load_setitem),
        pickle.SETITEMS[0]: _counted(load_setitems),
        **dict.fromkeys((op[0] for op in _REFUSED_OPERATIONS), refuse),
        pickle.REDUCE[0]: _counted(load_reduce),
        pickle.NEWOBJ[0]: _counted(load_newobj),
        pickle.BUILD[0]: _counted(load_build),
    }
    """Methods by operation; an operation that is not listed raises an error."""


def read_joblib(path: Path, what: str = SCORE_FILE, again: str = AGAIN) -> object:
    """Return the content of a joblib file: plain containers and arrays of numbers.

    Args:
        path: A file written by `joblib.dump`, uncompressed or compressed by zlib.
        what: Name of the file in messages.
        again: Advice in messages on how to make such a file.

    Raises:
        StoreError: If the file cannot be read.
        StoreFormatError: If it is truncated, of another program, or decompresses to more than 2 GB.
        UnsafeStoreError: If it refers to a name that is not on the allow-list.
    """
    name = f"{what} '{path}'"
    reader = _Reader(_decompress(name, _bytes_of(path, name, again), again))
    return explained(path, reader.load, what, again)


def explained(
    path: Path, read: Callable[[], Value], what: str = SCORE_FILE, again: str = AGAIN
) -> Value:
    """Return the result of `read`; raise its errors with one line that names the file.

    Args:
        path: The file.
        read: Function that decodes the content of the file.
        what: Name of the file in messages.
        again: Advice in messages on how to make such a file.

    Raises:
        StoreFormatError: If `read` raises any other error than the one below.
        UnsafeStoreError: If `read` raises one.
    """
    try:
        return read()
    except UnsafeStoreError as error:
        raise UnsafeStoreError(
            f"{what} '{path}' {error}. tcs did not write it: do not open it with any other program."
        ) from None
    except TcsError as error:
        # One line, even if the file contains names with line breaks.
        text = " ".join(str(error).split()).rstrip(".")
        raise StoreFormatError(f"{what} '{path}': {text}. {again}") from None
    except Exception as error:
        # Bytes that are not a pickle raise errors of many classes, from KeyError (no such
        # operation) to OverflowError; their messages do not help the user.
        raise StoreFormatError(
            f"{what} '{path}' is truncated or was not written by tcs "
            f"({type(error).__name__} while reading). {again}"
        ) from None


def _bytes_of(path: Path, name: str, again: str) -> bytes:
    """Return the bytes of a regular file of at most MAX_BYTES."""
    return read_bytes(path, name, StoreError, limit=MAX_BYTES, advice=f"Check the path. {again}")


def _decompress(name: str, data: bytes, again: str) -> bytes:
    """Return the decompressed bytes, at most MAX_BYTES of them."""
    if data[:1] == pickle.PROTO:
        return data
    # The low half of the first byte of a zlib stream is its method; 8 is the only one in use.
    if not data or data[0] & 0x0F != 8:
        raise StoreFormatError(
            f"{name} is {'empty' if not data else 'not a joblib file of tcs'}. {again}"
        )
    # tcs wraps its files without compressing them; joblib's own compression stays far below this.
    most = min(MAX_BYTES, FREE_BYTES + WRAPPED_RATIO * len(data))
    decompressor = zlib.decompressobj()
    try:
        content = decompressor.decompress(data, most + 1)
    except (zlib.error, MemoryError) as error:
        raise StoreFormatError(f"{name} is damaged ({error}). {again}") from None
    if len(content) > most:
        raise StoreFormatError(
            f"{name} decompresses to more than {most} bytes. It is damaged or meant to "
            f"fill the memory. {again}"
        )
    if not decompressor.eof or decompressor.unused_data:
        what = "has data after its end" if decompressor.eof else "is truncated"
        raise StoreFormatError(f"{name} {what}. {again}")
    return content


def _shown(value: object) -> str:
    """Return a value from the file for a message: short, printable, on one line."""
    if isinstance(value, _Known):
        value = ".".join(value.value)
    shown = repr(value) if isinstance(value, str | int) else type(value).__name__
    return shown if len(shown) <= 100 else shown[:100] + "...'"

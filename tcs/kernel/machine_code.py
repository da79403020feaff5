"""Machine code on disk that is checked before it is loaded.

Numba keeps what it has compiled as pickles of object code. Loading a damaged one gives false
results or ends the process, and loading another user's runs that user's code. So each file here
begins with a checksum of its content, and only the user may write to the file and its folder.
"""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import re
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    UserProvidedCacheLocator,
)
from numba.core.serialize import dumps

from tcs.errors import OutputError
from tcs.files.paths import CACHE_ADVICE
from tcs.files.writing import make_folder, whole_file
from tcs.kernel.sources import SOURCES, homes

_log = logging.getLogger(__name__)

_MAGIC = b"tcs machine code 1\n"
_OTHERS_MAY_WRITE = stat.S_IWGRP | stat.S_IWOTH


class DamagedCodeError(Exception):
    """A file of machine code whose content is not what was written, or not the user's own."""


def private_folder(folder: Path) -> Path:
    """Return a folder that only the user may write to; create it, closed to others, when missing.

    Raises:
        OutputError: If it cannot be created, belongs to another user, or others may write to it.
    """
    make_folder(folder.parent, "cache folder", advice=CACHE_ADVICE)
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.stat()
    except OSError as error:
        raise OutputError(
            f"cache folder '{folder}' cannot be created: {error.strerror}. {CACHE_ADVICE}"
        ) from error
    if status.st_uid != os.geteuid():
        raise OutputError(
            f"'{folder}' holds machine code and belongs to another user. {CACHE_ADVICE}"
        )
    if status.st_mode & _OTHERS_MAY_WRITE:
        raise OutputError(
            f"'{folder}' holds machine code, and other users may write to it. Delete it, or set "
            "TCS_CACHE_DIR to a folder of your own."
        )
    return folder


class CodeFiles(IndexDataCacheFile):
    """The files with the machine code of one function, one for each signature.

    A file holds a checksum of all that follows, and then the key (signature, processor, hashes of
    the byte code and of the sources) and the compiled function. It is written whole or not at all,
    so that processes may compile the same function at the same time.
    """

    def __init__(self, folder: Path, name: str) -> None:
        """Take the folder and the function's name with module and line."""
        super().__init__(str(folder), name, None)
        self._folder, self._name = folder, name

    def flush(self) -> None:
        """Remove the files of the function, for every signature."""
        for path in self._folder.glob(f"{self._name}.*.nbc"):
            path.unlink(missing_ok=True)

    def path(self, key: tuple[Any, ...]) -> Path:
        """Return the path of the file for a key."""
        hashed = hashlib.sha256(repr(key).encode()).hexdigest()
        return self._folder / f"{self._name}.{hashed[:16]}.nbc"

    def load(self, key: tuple[Any, ...]) -> object | None:
        """Return what was saved for a key, None if there is nothing that may be loaded."""
        if key[-1] is None:
            return None
        path = self.path(key)
        try:
            content = checked_content(path)
        except FileNotFoundError:
            return None
        except (OSError, DamagedCodeError) as error:
            warn_once("damaged", f"Machine code is compiled again: '{path}': {error}.")
            return None
        saved_key, data = pickle.loads(content)
        # Two keys may have one name.
        return data if saved_key == key else None

    def save(self, key: tuple[Any, ...], data: object) -> None:
        """Write what was compiled for a key; where that fails, later runs compile it again."""
        if key[-1] is None:
            return
        content = dumps((key, data))
        try:
            # Not flushed to the disk, which takes longer than some functions take to compile: what
            # a power failure damages has another checksum.
            with whole_file(
                self.path(key), "Machine code", advice=CACHE_ADVICE, flushed=False
            ) as stream:
                os.fchmod(stream.fileno(), 0o600)
                stream.write(_MAGIC + hashlib.sha256(content).digest())
                stream.write(content)
        except OutputError as error:
            warn_once("unwritten", f"The kernel compiles anew in every run: {error}")


def checked_content(path: Path) -> memoryview:
    """Return the content of a file of machine code, checked.

    The file is read once: the bytes that are returned are those that were checked.

    Raises:
        DamagedCodeError: If it does not belong to the user alone, or its checksum is false.
        OSError: If it cannot be read.
    """
    with path.open("rb") as stream:
        status = os.fstat(stream.fileno())
        if status.st_uid != os.geteuid() or status.st_mode & _OTHERS_MAY_WRITE:
            raise DamagedCodeError("it belongs to another user, or others may write to it")
        whole = stream.read()
    start = len(_MAGIC) + hashlib.sha256().digest_size
    content = memoryview(whole)[start:]
    if whole[:start] != _MAGIC + hashlib.sha256(content).digest():
        raise DamagedCodeError("its checksum is false")
    return content


_warned: set[str] = set()
"""What this process has warned of."""


def warn_once(matter: str, text: str) -> None:
    """Log a warning if it is the first of this process on a matter."""
    if matter not in _warned:
        _warned.add(matter)
        _log.warning(text)


class _Locator(UserProvidedCacheLocator):
    """Knows a function's source; its files are kept by `CodeFiles`, wherever this points to."""

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        self._py_file, self._lineno = py_file, py_func.__code__.co_firstlineno

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> _Locator:
        return cls(py_func, py_file)

    def get_cache_path(self) -> str:
        return ""

    def ensure_cache_path(self) -> None:
        pass


class CodeImplementation(CompileResultCacheImpl):
    """Tells numba's cache where sources are, and what to keep of a compiled function."""

    _locator_classes: list[type[object]] = [_Locator]  # noqa: RUF012  # numba's own type


class CodeCache(FunctionCache):
    """Numba's cache of one function, kept in checked files."""

    _impl_class: type[CodeImplementation] = CodeImplementation
    _suffix = ""
    """End of the names of the files, before the hash of the key."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        """Keep the machine code of a function in a folder of `private_folder`."""
        super().__init__(function)
        name = f"{function.__module__}.{function.__qualname__}-{function.__code__.co_firstlineno}"
        self._cache_path = str(folder)
        self._files = CodeFiles(folder, re.sub(r"[^\w.-]", "", name) + self._suffix)
        self._cache_file = self._files

    def path(self, signature: Any, target_context: Any) -> Path:
        """Return the path of the file for a signature, whether there is one or not."""
        return self._files.path(self._index_key(signature, target_context.codegen()))

    def _index_key(self, signature: Any, codegen: Any) -> tuple[Any, ...]:
        """Return numba's key and the digest of the sources; None in its place if it is unknown."""
        modules = {self._py_func.__module__, *homes(signature)}
        return *super()._index_key(signature, codegen), SOURCES.digest(modules)

"""Blocks of long runs: finished parts kept in a folder, so that a killed run continues."""

from __future__ import annotations

import contextlib
import fcntl
import json
import logging
import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from tcs.errors import OutputError, StoreFormatError, TcsError
from tcs.files.compression import decompress
from tcs.files.joblib_file import JoblibFormat
from tcs.files.reading import read_text
from tcs.files.writing import make_folder, remove_leftovers, whole_file

_log = logging.getLogger(__name__)

Value = TypeVar("Value")

FORMAT = JoblibFormat(
    what="Block",
    name="tcs block",
    version=1,
    again="It is computed again.",
)
MANIFEST = "manifest.json"
"""File that lists the blocks of a finished run, written last."""
_NAME = re.compile(r"[0-9a-z]{1,64}")
_MOST_BYTES = 64 * 1024**2
"""Greatest size of a manifest [bytes]: that of half a million blocks."""


@dataclass(frozen=True, slots=True)
class Blocks:
    """The finished blocks of one key in their folder, locked for this process."""

    folder: Path
    key: str
    """Hash of everything that all blocks follow from."""
    used: set[str] = field(default_factory=set)
    """Names of the blocks that the run took from the folder or added to it."""

    def load(self, name: str, decode: Callable[[dict[str, Any]], Value]) -> Value | None:
        """Return the value of a block; None if it has to be computed.

        A damaged block, or one of other inputs, is told in a warning.

        Args:
            name: Name of the block, unique for its key: a number, or a hash of further inputs.
            decode: Returns the value of a content, or raises `StoreFormatError`.
        """
        path = self._path(name)
        if not path.exists():
            return None

        def checked(content: dict[str, Any]) -> Value:
            if content.get("key") != self.key or content.get("block") != name:
                raise StoreFormatError("is of another run")
            return decode(content)

        try:
            found = FORMAT.load(path, checked)
        except TcsError as error:
            _log.warning("%s", error)
            return None
        self.used.add(name)
        return found

    def has(self, name: str) -> bool:
        """Return whether there is a file of a block."""
        return self._path(name).exists()

    def save(self, name: str, content: Mapping[str, Any]) -> None:
        """Write a block, completely or not at all.

        Args:
            name: As for `load`.
            content: Plain containers; arrays should be compressed.

        Raises:
            OutputError: If it cannot be written.
        """
        FORMAT.save(self._path(name), {"key": self.key, "block": name, **content})
        self.used.add(name)

    def finish(self) -> None:
        """Write the manifest, which says that the run is finished and which blocks it is of.

        Raises:
            OutputError: If it cannot be written.
        """
        sizes = {name: self._path(name).stat().st_size for name in sorted(self.used)}
        with whole_file(self.folder / MANIFEST, "Folder of blocks") as stream:
            stream.write(json.dumps({"key": self.key, "blocks": sizes}).encode())

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.block"


@dataclass(frozen=True, slots=True)
class BlockFolder:
    """Folder of finished blocks; runs with other inputs have folders of their own inside it."""

    path: Path
    restart: bool = False
    """Whether to discard the finished blocks of the same inputs."""

    @contextlib.contextmanager
    def opened(self, key: str) -> Iterator[Blocks]:
        """Yield the blocks of the inputs with a key, locked for this process.

        If the work ends without an error, their manifest is written.

        Args:
            key: Hash of everything that the blocks follow from.

        Raises:
            OutputError: If the folder cannot be made or written, or another process is at work on
                the same inputs in it.
        """
        folder = self.path / key[:16]
        make_folder(folder, "Folder of blocks")
        with _locked(folder / "lock"):
            remove_leftovers(folder)
            if self.restart:
                for block in (folder / MANIFEST, *folder.glob("*.block")):
                    block.unlink(missing_ok=True)
            blocks = Blocks(folder, key)
            yield blocks
            blocks.finish()


@contextlib.contextmanager
def opened_if(blocks: BlockFolder | None, key: Callable[[], str]) -> Iterator[Blocks | None]:
    """Yield the blocks of a folder as `BlockFolder.opened`; None without a folder.

    Args:
        blocks: The folder.
        key: Returns the key; called if there is a folder.
    """
    if blocks is None:
        yield None
        return
    with blocks.opened(key()) as opened:
        yield opened


@dataclass(frozen=True, slots=True)
class StoredBlock:
    """A block that was read for its own sake."""

    key: str
    name: str


def load_block(path: Path) -> StoredBlock:
    """Read every part of a block.

    Raises:
        StoreError: If the file cannot be read.
        StoreFormatError: If it is damaged, or no block.
    """

    def decode(content: dict[str, Any]) -> StoredBlock:
        key, name = content.get("key"), content.get("block")
        if not isinstance(key, str) or not isinstance(name, str):
            raise StoreFormatError("has no key or name")
        _read_arrays(content)
        return StoredBlock(key, name)

    return FORMAT.load(path, decode)


def _read_arrays(content: dict[str, Any]) -> None:
    """Decompress every array of a block, in containers within it too.

    Raises:
        StoreFormatError: If one is damaged.
    """
    waiting = [content]
    # A container may hold another one many times over, or itself; it is read once.
    seen: set[int] = set()
    while waiting:
        container = waiting.pop()
        if id(container) in seen:
            continue
        seen.add(id(container))
        for part, value in container.items():
            if not isinstance(value, dict):
                continue
            if "bytes" not in value:
                waiting.append(value)
                continue
            shape = value.get("shape")
            lengths = len(shape) if isinstance(shape, list) else 0
            decompress(container, part, str(value.get("type")), (None,) * lengths)


@dataclass(frozen=True, slots=True)
class FinishedRun:
    """A run all of whose blocks could be read."""

    key: str
    blocks: tuple[str, ...]
    """Names of the blocks."""


def load_manifest(path: Path) -> FinishedRun:
    """Read the manifest of a finished run and every block that it lists.

    Raises:
        StoreError: If a file cannot be read.
        StoreFormatError: If the manifest is damaged, or a block is missing, damaged or of
            another run.
    """
    where = f"Manifest '{path}'"
    again = "Run the command again with the same --blocks: it is computed again."
    try:
        plain = json.loads(read_text(path, where, StoreFormatError, limit=_MOST_BYTES))
        key, sizes = plain["key"], dict(plain["blocks"])
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise StoreFormatError(f"{where} is damaged ({error}). {again}") from error
    for name, size in sizes.items():
        if not _NAME.fullmatch(name):
            raise StoreFormatError(f"{where}: {name!r} is no name of a block. {again}")
        block = path.with_name(f"{name}.block")
        if not block.is_file() or block.stat().st_size != size:
            raise StoreFormatError(f"{where}: block '{name}' is missing or cut. {again}")
        found = load_block(block)
        if (found.key, found.name) != (key, name):
            raise StoreFormatError(f"{where}: block '{name}' is of another run. {again}")
    return FinishedRun(str(key), tuple(sizes))


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Lock a file for this process, and write the process's number into it.

    Raises:
        OutputError: If another process has locked it, or it cannot be written.
    """

    def unwritable(error: OSError) -> OutputError:
        return OutputError(
            f"Folder of blocks '{path.parent}' cannot be written: {error.strerror}. "
            "Name another folder."
        )

    try:
        # Without a buffer, which a full disk would keep from being closed.
        stream = path.open("a+b", buffering=0)
    except OSError as error:
        raise unwritable(error) from error
    with stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            stream.seek(0)
            process = stream.read(20).decode(errors="replace").strip() or "unknown"
            raise OutputError(
                f"Folder of blocks '{path.parent}' is in use by process {process}, which computes "
                "the same. Wait for it, or name another folder."
            ) from None
        try:
            stream.truncate(0)
            stream.write(str(os.getpid()).encode())
        except OSError as error:
            raise unwritable(error) from error
        yield

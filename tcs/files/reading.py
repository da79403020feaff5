"""Read the bytes of a regular file, and nothing else: no pipe that hangs, no endless device."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from tcs.errors import TcsError

_SMALL = 65_536
"""Bytes that are read of a file that claims fewer, as those of `/proc` do."""


def read_bytes(
    path: Path, where: str, error: type[TcsError], *, limit: int, advice: str = ""
) -> bytes:
    """Return the bytes of a regular file.

    The file is opened without waiting, so that a named pipe without a writer does not hang, and its
    type and size are those of the opened file, whatever its path names a moment later.

    Args:
        path: The file.
        where: Name of the file in messages, e.g. "task file 'shaving.yaml'".
        error: Class of the error to raise.
        limit: Greatest number of bytes.
        advice: What to do next, at the end of messages.

    Raises:
        TcsError: As `error`, if there is no regular file of that path, it cannot be read, or it is
            larger than `limit`.
    """
    what_next = f" {advice}" if advice else ""
    try:
        opened = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY)
    except (OSError, ValueError) as reason:
        raise error(f"{where} cannot be read: {path_fault(reason)}.{what_next}") from None
    try:
        status = os.fstat(opened)
        if not stat.S_ISREG(status.st_mode):
            raise error(
                f"{where} cannot be read: it is {_type_of(status.st_mode)}, not a regular file."
                f"{what_next}"
            )
        if status.st_size > limit:
            raise error(f"{where} has {status.st_size:,} bytes; at most {limit:,} are read.")
        # Python reserves what it is asked for, so no more than the file has is asked for, and one
        # byte: the file may grow between the two calls.
        expected = min(limit, max(status.st_size, _SMALL))
        with open(opened, "rb", closefd=False) as stream:
            content = stream.read(expected + 1)
    except OSError as reason:
        raise error(f"{where} cannot be read: {path_fault(reason)}.{what_next}") from None
    finally:
        os.close(opened)
    if len(content) > expected:
        raise error(f"{where} has more than the expected {expected:,} bytes. Is it being written?")
    return content


def read_text(path: Path, where: str, error: type[TcsError], *, limit: int) -> str:
    """Return the text of a regular file in UTF-8; as `read_bytes`, and refuse other encodings."""
    content = read_bytes(path, where, error, limit=limit)
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise error(f"{where} is not a text file in UTF-8.") from None


def path_fault(error: OSError | ValueError) -> str:
    """Return why the operating system refuses a path, in a few words."""
    if isinstance(error, OSError):
        return error.strerror or str(error)
    # Python's only ValueError for a path: the system would read it up to the NUL byte.
    return "the path contains a NUL byte"


def special_file(path: Path) -> str | None:
    """Return what exists at a path if it is neither a regular file nor missing, e.g. "a device"."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return None
    return None if stat.S_ISREG(mode) else _type_of(mode)


def _type_of(mode: int) -> str:
    names = {
        stat.S_IFDIR: "a folder",
        stat.S_IFIFO: "a named pipe",
        stat.S_IFSOCK: "a socket",
        stat.S_IFCHR: "a device",
        stat.S_IFBLK: "a device",
    }
    return names.get(stat.S_IFMT(mode), "a special file")

"""Write files, wholly or not at all, and the folders they go to."""

from __future__ import annotations

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from tcs.errors import OutputError


@contextlib.contextmanager
def whole_file(
    path: Path,
    what: str,
    *,
    advice: str = "Name a file in an existing, writable folder with room for it.",
) -> Iterator[BinaryIO]:
    """Open a file to write; an older one of that name stays until the new one is complete.

    It is written beside the target under another name, brought to the disk and then renamed.
    Whatever goes wrong, Ctrl-C included, the older file stays as it was, and no half one is left.

    Args:
        path: Where to write; its folder must exist.
        what: What to call it in a message, e.g. "Picture".
        advice: What to do when it cannot be written there.

    Raises:
        OutputError: If it cannot be written there.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.part")
    try:
        with beside.open("xb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        beside.replace(path)
    except BaseException as error:
        # Where no file could be made, there is none to remove; the first error is the one to tell.
        with contextlib.suppress(OSError):
            beside.unlink()
        if isinstance(error, OSError):
            raise OutputError(
                f"{what} '{path}' cannot be written: {error.strerror or error}. {advice}"
            ) from error
        raise


def make_folder(
    folder: Path, what: str = "folder", *, advice: str = "Name a folder that can be."
) -> None:
    """Make a folder, and those above it, where they are not there yet.

    Args:
        folder: The folder.
        what: What to call it in a message.
        advice: What to do when it cannot be made.

    Raises:
        OutputError: If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{what} '{folder}' cannot be made: {error.strerror}. {advice}"
        ) from error

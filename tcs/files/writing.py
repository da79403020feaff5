"""Write files whole or not at all, and create folders."""

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
    advice: str = "Name a file in an existing, writable folder with enough space.",
) -> Iterator[BinaryIO]:
    """Open a file to write that replaces an existing one only when it is complete.

    The content goes to a temporary file beside the target, which is flushed to the disk and then
    renamed. After any error, Ctrl-C included, the old file is unchanged and no partial one is left.

    Args:
        path: Path of the file; its folder must exist.
        what: Name of the file in messages, e.g. "Picture".
        advice: Advice to the user if the file cannot be written.

    Raises:
        OutputError: If the file cannot be written.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.part")
    try:
        with beside.open("xb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        beside.replace(path)
    except BaseException as error:
        # There may be no file to remove; the first error is the one to report.
        with contextlib.suppress(OSError):
            beside.unlink()
        if isinstance(error, OSError):
            raise OutputError(
                f"{what} '{path}' cannot be written: {error.strerror or error}. {advice}"
            ) from error
        raise


def make_folder(
    folder: Path, what: str = "folder", *, advice: str = "Name a folder that can be created."
) -> None:
    """Create a folder and its parents where they do not exist.

    Args:
        folder: The folder.
        what: Name of the folder in messages.
        advice: Advice to the user if the folder cannot be created.

    Raises:
        OutputError: If the folder cannot be created.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{what} '{folder}' cannot be created: {error.strerror}. {advice}"
        ) from error


def check_writable(path: Path) -> None:
    """Refuse a path that cannot be written, before the work whose result it is for.

    Raises:
        OutputError: If it is a folder, or its folder is missing or not writable.
    """
    if path.is_dir():
        raise OutputError(f"'{path}' is a folder. Name a file in it.")
    # Permissions say nothing of read-only disks and quotas; an attempt does.
    trial = path.with_name(f".{path.name}.{secrets.token_hex(4)}.trial")
    try:
        trial.touch(exist_ok=False)
        trial.unlink()
    except OSError as error:
        raise OutputError(
            f"'{path}' cannot be written: {error.strerror or error}. Name a file in an existing, "
            "writable folder."
        ) from error


def check_page(path: Path) -> None:
    """Refuse the path of a page that is not named `.html`, or that cannot be written.

    Raises:
        OutputError: If its name ends otherwise, or as `check_writable`.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise OutputError(f"Page '{path}': its name must end in .html.")
    check_writable(path)

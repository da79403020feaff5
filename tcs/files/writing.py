"""Write files completely or not at all, create folders, and remove files left by killed processes.

A temporary file is locked while it is written, and the lock ends with the process, however it ends.
A temporary file that is not locked is therefore left over, and the next process that writes into
its folder removes it.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import secrets
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import BinaryIO

from tcs.errors import OutputError
from tcs.files.reading import path_fault, special_file

_TOKEN = r"\d+-[0-9a-f]{8}"
"""Process and random number in the name of a temporary file or folder."""
_FILE = re.compile(rf"\..+\.{_TOKEN}\.part")
_FOLDER = re.compile(rf"tcs-{_TOKEN}")


@contextlib.contextmanager
def whole_file(
    path: Path,
    what: str,
    *,
    advice: str = "Name a file in an existing, writable folder with enough space.",
    flushed: bool = True,
) -> Iterator[BinaryIO]:
    """Open a file for writing that replaces an existing one only when it is complete.

    The content is written to a temporary file beside the target, which is flushed to the disk and
    then renamed. After any error, Ctrl-C included, the old file is unchanged and no partial file
    remains; that of a killed process is removed by the next process that writes into the folder.

    Args:
        path: Path of the file; its folder must exist.
        what: Name of the file in messages, e.g. "Picture".
        advice: Advice to the user if the file cannot be written.
        flushed: Whether the file must survive a power failure.

    Raises:
        OutputError: If the file cannot be written.
    """
    _check_target(path, what, advice)
    remove_leftovers(path.parent)
    try:
        with _temporary_file(path) as (beside, stream):
            yield stream
            stream.flush()
            if flushed:
                os.fsync(stream.fileno())
            # Renamed before it is closed: without its lock, another process would remove it.
            beside.replace(path)
    except OSError as error:
        raise OutputError(
            f"{what} '{path}' cannot be written: {error.strerror or error}. {advice}"
        ) from error


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """Create an empty folder for temporary files, and remove it with its content at the end.

    Raises:
        OutputError: If the folder cannot be created.
    """
    above = Path(tempfile.gettempdir())
    remove_leftovers(above)
    folder = above / f"tcs-{_token()}"
    try:
        make_private_folder(folder)
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            _lock(handle, fcntl.LOCK_EX)
            yield folder
        finally:
            os.close(handle)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def make_private_folder(folder: Path) -> None:
    """Create a folder for temporary files that no other user can look into, if there is none.

    Raises:
        OutputError: If it cannot be created.
    """
    make_folder(
        folder, "temporary folder", advice="Set TMPDIR to a folder you may write to.", mode=0o700
    )


@cache
def remove_leftovers(folder: Path) -> None:
    """Remove the temporary files and folders of killed processes from a folder.

    A file or folder is removed only if it has the name of a temporary file of `tcs`, belongs to
    this user, and is not locked by a process; on a disk without locks nothing is removed. A process
    searches each folder once.

    Args:
        folder: The folder; if it cannot be read, nothing is done.
    """
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            is_folder = _FOLDER.fullmatch(entry.name) is not None
            if not (is_folder or _FILE.fullmatch(entry.name)):
                continue
            with contextlib.suppress(OSError):
                _remove_unlocked(Path(entry.path), is_folder=is_folder)


def _remove_unlocked(path: Path, *, is_folder: bool) -> None:
    """Remove a temporary file or folder of this user that no process has locked."""
    # Some network disks only lock files that are open for writing.
    mode = os.O_RDONLY | os.O_DIRECTORY if is_folder else os.O_RDWR | os.O_NONBLOCK
    handle = os.open(path, mode | os.O_NOFOLLOW)
    try:
        if os.fstat(handle).st_uid != os.geteuid():
            return
        if not _lock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB):
            return
        if is_folder:
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()
    finally:
        os.close(handle)


def _lock(handle: int, mode: int) -> bool:
    """Lock an open file or folder for this process; return whether that succeeded."""
    try:
        fcntl.flock(handle, mode)
    except OSError:
        return False
    return True


@contextlib.contextmanager
def _temporary_file(path: Path) -> Iterator[tuple[Path, BinaryIO]]:
    """Create a temporary file beside a path, locked; remove it unless it was renamed."""
    while True:
        beside = path.with_name(f".{path.name}.{_token()}.part")
        try:
            with beside.open("xb") as stream:
                _lock(stream.fileno(), fcntl.LOCK_EX)
                # Another process may have removed it as left over before it was locked.
                if beside.exists():
                    yield beside, stream
                    return
        finally:
            # There may be no file to remove; the original error is the one to report.
            with contextlib.suppress(OSError):
                beside.unlink()


def _token() -> str:
    return f"{os.getpid()}-{secrets.token_hex(4)}"


def _check_target(path: Path, what: str, advice: str) -> None:
    """Refuse to replace what is not a file: renaming would put a file in place of a device."""
    special = special_file(path)
    if special is not None:
        raise OutputError(f"{what} '{path}' cannot be written: it is {special}. {advice}")
    if "\0" in str(path):
        raise OutputError(f"{what} {str(path)!r} cannot be written: it has a NUL byte. {advice}")


def make_folder(
    folder: Path,
    what: str = "folder",
    *,
    advice: str = "Name a folder that can be created.",
    mode: int = 0o777,
) -> None:
    """Create a folder and its parents where they do not exist.

    Args:
        folder: The folder.
        what: Name of the folder in messages.
        advice: Advice to the user if the folder cannot be created.
        mode: Permissions of the folder, less those of the umask.

    Raises:
        OutputError: If the folder cannot be created.
    """
    try:
        folder.mkdir(mode, parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise OutputError(
            f"{what} '{folder}' cannot be created: {path_fault(error)}. {advice}"
        ) from error


def check_writable(path: Path, inputs: Iterable[str | Path] = ()) -> None:
    """Check that a file can be written, before the computation of its content.

    Args:
        path: The file.
        inputs: Paths of files that the computation reads, which must not be replaced; what is no
            path of a file, such as the name of a task, is skipped.

    Raises:
        OutputError: If the path is a folder or one of the inputs, or its folder is missing or not
            writable.
    """
    if any(_is_same_file(path, given) for given in inputs):
        raise OutputError(f"'{path}' is also read, and would be replaced. Name another file.")
    if os.path.isdir(path):
        raise OutputError(f"'{path}' is a folder. Name a file in it.")
    special = special_file(path)
    if special is not None:
        raise OutputError(f"'{path}' is {special}, not a file. Name a file.")
    try:
        # Permissions do not reveal read-only disks and quotas; an attempt to write does.
        remove_leftovers(path.parent)
        with _temporary_file(path):
            pass
    except (OSError, ValueError) as error:
        raise OutputError(
            f"'{path}' cannot be written: {path_fault(error)}. Name a file in an existing, "
            "writable folder."
        ) from error


def _is_same_file(first: Path, second: str | Path) -> bool:
    try:
        return os.path.samefile(first, second)
    except (OSError, ValueError):
        # One of them does not exist.
        return False


def check_page(path: Path) -> None:
    """Check that the path of a page ends in `.html` or `.htm`, and that it can be written.

    Raises:
        OutputError: If its name ends otherwise, or as `check_writable`.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise OutputError(f"Page '{path}': its name must end in .html.")
    check_writable(path)

"""Save and load score files."""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path

import joblib

from tcs.errors import OutputError
from tcs.store.packing import pack, unpack
from tcs.store.reader import explained, read_joblib
from tcs.store.score_file import ScoreFile

COMPRESSION = ("zlib", 3)
"""Arm joints are as good as random: higher levels and lzma take much longer for a few percent,
and lzma also to load."""


def save_scores(path: str | os.PathLike[str], file: ScoreFile) -> None:
    """Write a score file, wholly or not at all.

    It is written beside the target under another name, brought to the disk and then renamed.
    Whatever goes wrong, Ctrl-C included, an older file of that name stays as it was.

    Args:
        path: Where to write; its folder must exist.
        file: What to write.

    Raises:
        OutputError: If it cannot be written there.
    """
    path = Path(path)
    content = pack(file)
    beside = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.part")
    try:
        with beside.open("xb") as stream:
            joblib.dump(content, stream, compress=COMPRESSION)
            stream.flush()
            os.fsync(stream.fileno())
        beside.replace(path)
    except BaseException as error:
        # Where no file could be made, there is none to remove; the first error is the one to tell.
        with contextlib.suppress(OSError):
            beside.unlink()
        if isinstance(error, OSError):
            raise OutputError(
                f"Score file '{path}' cannot be written: {error.strerror or error}. Name a file "
                "in an existing, writable folder with room for it."
            ) from error
        raise


def load_scores(path: str | os.PathLike[str]) -> ScoreFile:
    """Read a score file, trusting nothing in it.

    Args:
        path: A file written by `save_scores`.

    Raises:
        StoreError: If it cannot be read.
        StoreFormatError: If it is truncated, foreign, contradicts itself, or is of a version
            from the future.
        UnsafeStoreError: If it names anything outside the allow-list. Nothing is called.
    """
    path = Path(path)
    content = read_joblib(path)
    return explained(path, lambda: unpack(content))

"""Save and load score files."""

from __future__ import annotations

import os
from pathlib import Path

import joblib

from tcs.store.packing import pack, unpack
from tcs.store.reader import explained, read_joblib
from tcs.store.score_file import ScoreFile
from tcs.writing import whole_file

COMPRESSION = ("zlib", 3)
"""Arm joints are as good as random: higher levels and lzma take much longer for a few percent,
and lzma also to load."""


def save_scores(path: str | os.PathLike[str], file: ScoreFile) -> None:
    """Write a score file, wholly or not at all.

    Args:
        path: Where to write; its folder must exist.
        file: What to write.

    Raises:
        OutputError: If it cannot be written there.
    """
    path = Path(path)
    content = pack(file)
    with whole_file(path, "Score file") as stream:
        joblib.dump(content, stream, compress=COMPRESSION)


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

"""Save and load score files."""

from __future__ import annotations

import io
import os
import zlib
from collections.abc import Callable
from pathlib import Path

import joblib

from tcs.files.reader import explained, read_joblib
from tcs.files.writing import whole_file
from tcs.placement.store.encoding import decode, encode
from tcs.placement.store.score_file import ScoreFile
from tcs.placement.tables import ScoreTable


def save_scores(path: str | os.PathLike[str], file: ScoreFile) -> None:
    """Write a score file, wholly or not at all.

    Args:
        path: Where to write; its folder must exist.
        file: What to write.

    Raises:
        OutputError: If it cannot be written there.
    """
    path = Path(path)
    plain = io.BytesIO()
    joblib.dump(encode(file), plain)
    # Its large parts are folded already: level 0 adds a checksum over everything, and no more.
    checked = zlib.compress(plain.getbuffer(), 0)
    with whole_file(path, "Score file") as stream:
        stream.write(checked)


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

    def explain(read: Callable[[], ScoreTable]) -> ScoreTable:
        return explained(path, read)

    return explained(path, lambda: decode(content, explain))

"""Save and load score files."""

from __future__ import annotations

import os
from pathlib import Path

from tcs.files.joblib_file import write_joblib
from tcs.files.reader import SCORE_FILE, explained, read_joblib
from tcs.placement.store.encoding import decode, encode
from tcs.placement.store.score_file import ScoreFile


def save_scores(path: str | os.PathLike[str], file: ScoreFile) -> None:
    """Write a score file, wholly or not at all.

    Args:
        path: Where to write; its folder must exist.
        file: What to write.

    Raises:
        OutputError: If it cannot be written there.
    """
    write_joblib(Path(path), encode(file), SCORE_FILE)


def load_scores(path: str | os.PathLike[str], most: int | None = None) -> ScoreFile:
    """Read a score file without trusting it: nothing in it is called or imported.

    Reading it takes at most four times the memory of its decoded arrays.

    Args:
        path: A file written by `save_scores`.
        most: Most bytes that its arrays may take once they are decoded; None for any.

    Raises:
        StoreError: If it cannot be read.
        StoreFormatError: If it is truncated, foreign, inconsistent, of another format version, or
            takes more memory.
        UnsafeStoreError: If it names anything outside the allow-list.
    """
    path = Path(path)
    content = read_joblib(path)
    return explained(path, lambda: decode(content, path, most))

"""Motion files: which goals can be done from the configurations of a score file."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tcs.errors import StoreError, StoreFormatError, StoreMismatchError
from tcs.files.joblib_file import JoblibFormat, check_types
from tcs.files.plain import plain
from tcs.model.grid import Grid
from tcs.placement.store.codec import decode_columns, decode_names, encode_columns
from tcs.placement.store.score_file import ScoreFile
from tcs.placement.tables.motions import MotionTable

MOTION_FORMAT = JoblibFormat(
    what="Motion file",
    name="tcs motions",
    version=1,
    again="Make it again with `tcs motions`.",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionFile:
    """The goals that can be done from the configurations of a score file."""

    metadata: dict[str, Any]
    """How it was made: `scene_digest` of the score file, `program_version`, `created`, `seed`,
    `within`, `seconds`."""
    tables: tuple[MotionTable | None, ...]
    """One for each table of the score file; None where nothing was examined."""

    def check_belongs(self, file: ScoreFile) -> None:
        """Check that the motions were planned for a score file.

        Raises:
            StoreMismatchError: If they were not.
        """
        same = self.metadata["scene_digest"] == file.metadata["scene_digest"]
        same &= len(self.tables) == len(file.tables)
        size = Grid.from_dict(file.grid).size
        for motions, table in zip(self.tables, file.tables, strict=False):
            if motions is not None:
                same &= motions.outcome.shape[1] == table.sets.weights.size
                same &= bool(np.all(motions.configurations < size))
        if not same:
            raise StoreMismatchError(
                f"The motions of '{file.metadata['task']}' were planned for other scores. Plan "
                "them again: tcs motions FILE."
            )


def motion_path(scores: str | os.PathLike[str]) -> Path:
    """Return the path of the motion file beside a score file.

    >>> motion_path("shaving.tcs").name
    'shaving.tcs.motions'
    """
    path = Path(scores)
    return path.with_name(path.name + ".motions")


def save_motions(path: str | os.PathLike[str], motions: MotionFile) -> None:
    """Write a motion file, wholly or not at all.

    Args:
        path: File to write; its folder must exist.
        motions: The motions.

    Raises:
        OutputError: If the file cannot be written.
    """
    tables = [None if table is None else _encode(table) for table in motions.tables]
    MOTION_FORMAT.save(path, {"metadata": plain("metadata", motions.metadata), "tables": tables})


def load_motions(path: str | os.PathLike[str]) -> MotionFile:
    """Read a motion file; the content is validated and never executed.

    Raises:
        StoreError: If the file cannot be read.
        StoreFormatError: If it is truncated, of another format or version, or inconsistent.
        UnsafeStoreError: If it names an object outside the store's allow-list.
    """
    return MOTION_FORMAT.load(path, _decode_file)


def motions_of(file: ScoreFile, path: str | os.PathLike[str]) -> MotionFile:
    """Return the motions that were planned for a score file and saved beside it.

    Args:
        file: The loaded score file.
        path: Its path.

    Raises:
        StoreError: If there are none, or the file cannot be used.
        StoreMismatchError: If they were planned for other scores.
    """
    beside = motion_path(path)
    if not beside.exists():
        raise StoreError(f"There is no '{beside}' yet. Make it with: tcs motions {path}")
    motions = load_motions(beside)
    motions.check_belongs(file)
    return motions


def _decode_file(content: dict[str, Any]) -> MotionFile:
    check_types(content, {"metadata": dict, "tables": list})
    metadata = plain("metadata", content["metadata"])
    check_types(metadata, {"scene_digest": str, "seed": int})
    return MotionFile(metadata=metadata, tables=tuple(map(_decode, content["tables"])))


def _encode(table: MotionTable) -> dict[str, Any]:
    return {**encode_columns(table), "pair_names": [list(names) for names in table.pair_names]}


def _decode(encoded: object) -> MotionTable | None:
    if encoded is None:
        return None
    if not isinstance(encoded, dict):
        raise StoreFormatError("has invalid tables")
    return MotionTable(**decode_columns(MotionTable, encoded), pair_names=decode_names(encoded))

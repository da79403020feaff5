"""Any file that `tcs` wrote: what it is, and whether every part of it can be read."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tcs.capability.arplace.model_files import MAP as PROBABILITY_MAP
from tcs.capability.arplace.model_files import MODEL as ARPLACE_MODEL
from tcs.capability.arplace.model_files import load_arplace, load_probability_map
from tcs.capability.map_files import FORMAT as CAPABILITY_MAP
from tcs.capability.map_files import load_map
from tcs.errors import StoreFormatError
from tcs.files.blocks import FORMAT as BLOCK
from tcs.files.blocks import MANIFEST, load_block, load_manifest
from tcs.files.reader import read_joblib
from tcs.placement.store import FORMAT as SCORES
from tcs.placement.store import load_motions, load_scores
from tcs.placement.store.motion_file import MOTION_FORMAT

_WHAT = "File"
_AGAIN = (
    "Only files that tcs wrote can be checked: scores, motions, maps, models, plans, runs, blocks."
)


@dataclass(frozen=True, slots=True)
class StoredFile:
    """A file all of whose parts could be read."""

    path: str
    """The file."""
    kind: str
    """What it is, e.g. "score file"."""
    format_version: int | None
    """Version of its format; None for plans and runs, whose readers check it."""
    made: Mapping[str, Any]
    """What the file says of itself: `robot`, `environment`, `task`, `program_version`, `created`,
    as far as files of its kind do."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return asdict(self)


def check_file(path: str | os.PathLike[str]) -> StoredFile:
    """Read every part of a file that `tcs` wrote, and return what the file is.

    Checksums are compared, arrays decoded, and parts checked against each other. Nothing in the
    file is executed. That the answers are right is not checked: `tcs verify` does.

    Args:
        path: A score file, motion file, capability map, ARPlace model, probability map, block of
            `--blocks`, or `manifest.json` beside blocks (which are then all read), plan (`.json`)
            or run of the teleoperated arm (`.csv`).

    Raises:
        StoreError: If the file cannot be read.
        StoreFormatError: If it is truncated, damaged, inconsistent, of another format version, or
            no file of tcs.
        DataFileError: If a run cannot be read, is truncated or invalid.
        UnsafeStoreError: If it names an object outside the store's allow-list.
    """
    path = Path(path)
    if path.name == MANIFEST:
        load_manifest(path)
        return StoredFile(str(path), "manifest of blocks", None, {})
    text = _TEXT_FILES.get(path.suffix)
    if text is not None:
        kind, load = text
        return StoredFile(str(path), kind, None, _said(load(path)))
    content = read_joblib(path, _WHAT, _AGAIN)
    if not isinstance(content, dict) or str(content.get("format")) not in _JOBLIB_FILES:
        raise StoreFormatError(f"{_WHAT} '{path}' is no file of tcs. {_AGAIN}")
    kind, load = _JOBLIB_FILES[content["format"]]
    loaded = load(path)
    return StoredFile(str(path), kind, content["format_version"], _said(loaded))


def _said(loaded: object) -> dict[str, Any]:
    """Return what a file says of how it was made."""
    metadata = getattr(loaded, "metadata", None) or getattr(loaded, "made_from", {})
    known = ("robot", "environment", "task", "program_version", "created")
    return {key: metadata[key] for key in known if isinstance(metadata.get(key), str)}


def _load_scores(path: Path) -> object:
    file = load_scores(path)
    for table in file.tables:
        # Decoded, and checked against the sets, when they are first asked for.
        _ = table.scores
    return file


def _load_plan(path: Path) -> object:
    # Plans are built of arrays of the kernel.
    from tcs.motion import load_plan

    return load_plan(path)


def _load_run(path: Path) -> object:
    # Reading a run loads pandas.
    from tcs.teleop.runs.run_files import load_run

    return load_run(path)


_Loader = tuple[str, Callable[[Path], object]]
_JOBLIB_FILES: Mapping[str, _Loader] = {
    SCORES: ("score file", _load_scores),
    MOTION_FORMAT.name: ("motion file", load_motions),
    CAPABILITY_MAP.name: ("capability map", load_map),
    ARPLACE_MODEL.name: ("ARPlace model", load_arplace),
    PROBABILITY_MAP.name: ("probability map", load_probability_map),
    BLOCK.name: ("block", load_block),
}
_TEXT_FILES: Mapping[str, _Loader] = {
    ".json": ("plan", _load_plan),
    ".csv": ("run of a teleoperated arm", _load_run),
}

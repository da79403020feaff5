"""Score files: joblib files of plain containers and arrays, read through an allow-list."""

from __future__ import annotations

from tcs.placement.store.files import load_scores, save_scores
from tcs.placement.store.packing import FORMAT, FORMAT_VERSION
from tcs.placement.store.score_file import (
    REQUIRED_METADATA,
    Scored,
    ScoreFile,
    check_scene,
    shown_state,
)

__all__ = [
    "FORMAT",
    "FORMAT_VERSION",
    "REQUIRED_METADATA",
    "ScoreFile",
    "Scored",
    "check_scene",
    "load_scores",
    "save_scores",
    "shown_state",
]

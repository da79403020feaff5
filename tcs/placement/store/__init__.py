"""Score files and motion files: joblib files of plain containers and arrays.

They are read through an allow-list.
"""

from __future__ import annotations

from tcs.placement.store.encoding import FORMAT, FORMAT_VERSION, load_scores, save_scores
from tcs.placement.store.motion_file import (
    MotionFile,
    load_motions,
    motion_path,
    motions_of,
    save_motions,
)
from tcs.placement.store.score_file import (
    APPROACH,
    ARMS,
    HANDS,
    OF_HAND,
    PAPER,
    PERSON,
    REQUIRED_METADATA,
    WITHOUT_APPROACH,
    ScoreFile,
    StateTables,
    state_to_json,
)

__all__ = [
    "APPROACH",
    "ARMS",
    "FORMAT",
    "FORMAT_VERSION",
    "HANDS",
    "OF_HAND",
    "PAPER",
    "PERSON",
    "REQUIRED_METADATA",
    "WITHOUT_APPROACH",
    "MotionFile",
    "ScoreFile",
    "StateTables",
    "load_motions",
    "load_scores",
    "motion_path",
    "motions_of",
    "save_motions",
    "save_scores",
    "state_to_json",
]

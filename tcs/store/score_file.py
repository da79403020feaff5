"""What a score file holds: one task, scored and ready to choose from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.errors import StoreError, StoreMismatchError
from tcs.space import Grid
from tcs.store.plain import plain
from tcs.tables import ScoreTable, SetTable
from tcs.tables.sets import DISTANCE_TOLERANCE, candidates_of

REQUIRED_METADATA: dict[str, type] = {
    "program_version": str,
    "created": str,
    "task": str,
    "robot": str,
    "environment": str,
    "scene_digest": str,
    "measure": str,
    "hashes": dict,
    "timings": dict,
}
"""Keys that the metadata must have, and the type of each; others may join."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ScoreFile:
    """Scores and sets of one task, with everything needed to know what they are scores of."""

    metadata: dict[str, Any]
    """What made the file: see `REQUIRED_METADATA`."""
    task: dict[str, Any]
    """The task as plain containers."""
    robot: dict[str, Any]
    """The robot as plain containers."""
    environment: dict[str, Any]
    """The environment as plain containers."""
    grid: dict[str, Any]
    """The grid as plain containers; `Grid.from_dict` reads it."""
    scores: ScoreTable
    """Scores of every configuration at every goal."""
    sets: SetTable
    """The sets to choose from."""

    def __post_init__(self) -> None:
        """Check the parts against each other.

        Raises:
            StoreError: If a part is not plain, a key of the metadata is missing, or grid, scores
                and sets do not belong together.
            GridError: If the grid is none.
        """
        for name in ("metadata", "task", "robot", "environment", "grid"):
            copy = plain(name, getattr(self, name))
            if not isinstance(copy, dict):
                raise StoreError(f"{name} is {type(copy).__name__}; must be a dict.")
            object.__setattr__(self, name, copy)
        for key, kind in REQUIRED_METADATA.items():
            if not isinstance(self.metadata.get(key), kind):
                raise StoreError(f"metadata needs '{key}', of type {kind.__name__}.")
        self._check_tables()

    def _check_tables(self) -> None:
        """Refuse sets that are not those of the scores, or scores of another grid."""
        grid, scores, sets = Grid.from_dict(self.grid), self.scores, self.sets
        if scores.configurations != grid.size:
            raise StoreError(
                f"scores of {scores.configurations} configurations do not belong to a grid of "
                f"{grid.size}."
            )
        candidates = candidates_of(scores.reached)
        if not (
            np.array_equal(sets.weights, scores.weights)
            and np.array_equal(sets.candidates, candidates)
            and np.array_equal(sets.reached, scores.reached[candidates])
            and np.array_equal(sets.isotropy, scores.isotropy[candidates])
        ):
            raise StoreError("sets do not belong to the scores.")
        places = grid.values(candidates)
        for column, name in enumerate(("base_x", "base_y")):
            gap = np.abs(sets.cell_xy[sets.cell, column] - places[name])
            if np.any(gap > DISTANCE_TOLERANCE):
                raise StoreError(f"sets have base cells that are not those of the grid ({name}).")


def check_scene(file: ScoreFile, digest: str) -> None:
    """Refuse a file whose scores were computed from other models than today's.

    Args:
        file: A loaded score file.
        digest: Digest of the scene as it is lowered now.

    Raises:
        StoreMismatchError: If the digests differ.
    """
    stored = file.metadata["scene_digest"]
    if stored != digest:
        raise StoreMismatchError(
            f"Scores of '{file.metadata['task']}' were made by tcs "
            f"{file.metadata['program_version']} from other models (scene {stored[:12]}) than "
            f"those installed now (scene {digest[:12]}). Score the task again; choosing from the "
            "file still works."
        )

"""Pictures of the best set of a score file: the map from above and the robot in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from joblib import Parallel, delayed

from tcs.output.draw import as_png
from tcs.output.report.score.pictures import map_figure, scene_figure
from tcs.output.report.score.shown_set import ShownSet
from tcs.placement.store import load_scores


@dataclass(frozen=True, slots=True)
class RowPictures:
    """Two pictures of the best set of a row."""

    map: bytes
    """From above, PNG."""
    scene: bytes
    """The robot at each base pose, PNG."""


def draw_row(path: Path) -> RowPictures:
    """Return the pictures of the best set of a score file.

    Args:
        path: Path of the score file.

    Raises:
        StoreError: If the file cannot be used, or was made from other models.
    """
    file = load_scores(path)
    shown = ShownSet.best_of(file)
    return RowPictures(as_png(map_figure(file, shown)), as_png(scene_figure(file, shown)))


def draw_rows(paths: Sequence[Path], *, jobs: int = 2) -> tuple[RowPictures, ...]:
    """Return the pictures of several score files, in their order.

    Args:
        paths: Paths of the score files.
        jobs: Number of processes; the result does not depend on it.

    Raises:
        StoreError: As `draw_row`.
    """
    return tuple(Parallel(n_jobs=min(jobs, len(paths)))(delayed(draw_row)(path) for path in paths))

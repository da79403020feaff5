"""A small score file with all parts."""

from __future__ import annotations

import math

from tcs.placement.scoring.sets import build_sets
from tcs.placement.store import ScoreFile, StateTables
from tcs.placement.tables import WindowTable
from tests.placement.tables.small import random_scores, small_grid

METADATA = {
    "program_version": "0.1.0",
    "created": "2024-05-17T12:00:00+00:00",
    "task": "shaving",
    "robot": "pr2",
    "environment": "wheelchair",
    "scene_digest": "5f" * 32,
    "measure": "isotropy",
    "timings": {"scoring_seconds": 0.5},
}


SHIFT = {"name": "person_y", "unit": "m", "start": -0.05, "step": 0.05, "count": 3}
"""An observed axis."""


def score_file(*, grid=None, share=0.4, tables=1, options=None, **changes):
    """Return a file with several tables of different scores; `options` are those of the sets."""
    grid = grid or small_grid(nx=6, ny=4, bed=2)
    scored = [random_scores(grid, 5, seed=1 + i, share=share) for i in range(tables)]
    parts = {
        "metadata": METADATA,
        "task": {"name": "shaving", "goals": [{"body_frame": "head", "position": (0.1, 0.0, 0.2)}]},
        "robot": {"name": "pr2"},
        "environment": {"name": "wheelchair", "wall": None, "obstacles": []},
        "grid": grid.to_dict(),
        "observed": [],
        "body_frames": {"head": [0.1] * (3 * tables * math.prod(grid.environment_shape))},
        "tables": tuple(
            StateTables.of(scores, build_sets(scores, grid, **(options or {}))) for scores in scored
        ),
    }
    return ScoreFile(**(parts | changes))


def known_everywhere(file, table, stop, least, on_compile=None):
    """Find the same window around every stop."""
    found = WindowTable.empty(stop.values.size, stop.goals.size)
    return found.added(stop.values, stop.goals, (0.08, 0.062, math.radians(5.0)), held=True)

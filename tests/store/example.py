"""A small score file with everything in it."""

from __future__ import annotations

from tcs.scoring.sets import build_sets
from tcs.store import ScoreFile
from tests.tables.small import random_scores, small_grid

METADATA = {
    "program_version": "0.1.0",
    "created": "2024-05-17T12:00:00+00:00",
    "task": "shaving",
    "robot": "pr2",
    "environment": "wheelchair",
    "scene_digest": "5f" * 32,
    "measure": "isotropy",
    "hashes": {"kernel": "ab"},
    "timings": {"scoring_seconds": 0.5},
}


def score_file(*, grid=None, share=0.4, **changes):
    grid = grid or small_grid(nx=6, ny=4, bed=2)
    scores = random_scores(grid, 5, seed=1, share=share)
    parts = {
        "metadata": METADATA,
        "task": {"name": "shaving", "goals": [{"body_frame": "head", "position": (0.1, 0.0, 0.2)}]},
        "robot": {"name": "pr2"},
        "environment": {"name": "wheelchair", "wall": None, "obstacles": []},
        "grid": grid.to_dict(),
        "scores": scores,
        "sets": build_sets(scores, grid),
    }
    return ScoreFile(**(parts | changes))

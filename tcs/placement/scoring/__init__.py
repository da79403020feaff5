"""Scoring: the offline job, its sets, and the re-check of what it stored."""

from __future__ import annotations

from tcs.placement.scoring.catalogue import task_environment_pairs
from tcs.placement.scoring.job import Job, load_job, reference, score, summary
from tcs.placement.scoring.live import LiveScorer, score_observed
from tcs.placement.scoring.rebuild import rebuild_scene
from tcs.placement.scoring.sets import SetOptions, build_sets
from tcs.placement.scoring.sweep import Sweep, sweep, warm_up
from tcs.placement.scoring.verify import Verification, verify

__all__ = [
    "Job",
    "LiveScorer",
    "SetOptions",
    "Sweep",
    "Verification",
    "build_sets",
    "load_job",
    "rebuild_scene",
    "reference",
    "score",
    "score_observed",
    "summary",
    "sweep",
    "task_environment_pairs",
    "verify",
    "warm_up",
]

"""Scoring: the offline job, its sets, and the re-check of what it stored."""

from __future__ import annotations

from tcs.placement.scoring.job import Job, load_job, reference, score, summary
from tcs.placement.scoring.live import LiveScorer, score_observed
from tcs.placement.scoring.reopen import reopen
from tcs.placement.scoring.rows import all_rows
from tcs.placement.scoring.sets import SetOptions, build_sets
from tcs.placement.scoring.sweep import Sweep, sweep, warm_up
from tcs.placement.scoring.verify import Verification, verify

__all__ = [
    "Job",
    "LiveScorer",
    "SetOptions",
    "Sweep",
    "Verification",
    "all_rows",
    "build_sets",
    "load_job",
    "reference",
    "reopen",
    "score",
    "score_observed",
    "summary",
    "sweep",
    "verify",
    "warm_up",
]

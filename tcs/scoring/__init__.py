"""Scoring: the offline job, its sets, and the re-check of what it stored."""

from __future__ import annotations

from tcs.scoring.job import Job, load_job, reference, score, summary
from tcs.scoring.live import LiveScorer, score_observed
from tcs.scoring.reopen import reopen
from tcs.scoring.rows import all_rows
from tcs.scoring.sets import SetOptions, build_sets
from tcs.scoring.sweep import Sweep, sweep, warm_up
from tcs.scoring.verify import Verification, verify

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

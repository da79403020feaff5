"""Scoring: offline, live, and the re-check of score files with Drake.

In: a task, an environment and a robot, by name, path or object; for live scoring an observation.
Out: a score file, and its verification.
"""

from __future__ import annotations

from tcs.files.blocks import BlockFolder
from tcs.placement.scoring.job import Job, load_job, whole_task
from tcs.placement.scoring.kernel_start import warm_up
from tcs.placement.scoring.live import LiveScorer, score_observed
from tcs.placement.scoring.offline import score
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.scoring.score_summary import summary
from tcs.placement.scoring.score_to_file import default_path, task_environment_pairs
from tcs.placement.scoring.sets import SetOptions, build_sets
from tcs.placement.scoring.sweep import Sweep, sweep
from tcs.placement.scoring.verify import Verification, verify

__all__ = [
    "BlockFolder",
    "Job",
    "LiveScorer",
    "SetOptions",
    "Sweep",
    "Verification",
    "build_sets",
    "default_path",
    "load_job",
    "rebuild_scenes",
    "score",
    "score_observed",
    "summary",
    "sweep",
    "task_environment_pairs",
    "verify",
    "warm_up",
    "whole_task",
]

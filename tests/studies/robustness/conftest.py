"""The small rows of real scenes on which success under error is tested."""

from __future__ import annotations

from tests.placement.robustness.conftest import (
    bed_file,
    bed_trials,
    chair_file,
    chair_trials,
    environments,
    trials,
)

__all__ = ["bed_file", "bed_trials", "chair_file", "chair_trials", "environments", "trials"]

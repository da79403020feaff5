"""Robustness: what is left of a set of configurations when the room is a little off."""

from __future__ import annotations

from tcs.robustness.error_model import ErrorFile, ErrorModel
from tcs.robustness.evaluation import SELECTIONS, Evaluation, evaluate
from tcs.robustness.statistics import Difference, Mean, mean_of, rank_sum, signed_rank
from tcs.robustness.trials import Trials

__all__ = [
    "SELECTIONS",
    "Difference",
    "ErrorFile",
    "ErrorModel",
    "Evaluation",
    "Mean",
    "Trials",
    "evaluate",
    "mean_of",
    "rank_sum",
    "signed_rank",
]

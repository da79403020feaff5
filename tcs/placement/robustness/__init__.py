"""Robustness: success of sets of configurations in perturbed environments, TCS sections IV and V.

In: a score file and an error model of the environment's joints. Out: Monte-Carlo evaluations of
sets, and estimates of success for selection.
"""

from __future__ import annotations

from tcs.placement.robustness.error_model import ErrorFile, ErrorModel
from tcs.placement.robustness.estimation import (
    robustify,
    success_of,
    success_summary,
    with_success,
)
from tcs.placement.robustness.evaluation import SELECTIONS, Evaluation, evaluate
from tcs.placement.robustness.perturbed_points import PerturbedPoints
from tcs.placement.robustness.statistics import Mean, mean_of
from tcs.placement.robustness.trials import Trials

__all__ = [
    "SELECTIONS",
    "ErrorFile",
    "ErrorModel",
    "Evaluation",
    "Mean",
    "PerturbedPoints",
    "Trials",
    "evaluate",
    "mean_of",
    "robustify",
    "success_of",
    "success_summary",
    "with_success",
]

"""Robustness: success of sets of configurations in perturbed environments, TCS sections IV and V.

In: a score file and an error model of the environment's joints. Out: Monte-Carlo evaluations of
sets, estimates of success for selection, and the study behind the robustness report.
"""

from __future__ import annotations

from tcs.placement.robustness.comparison import (
    METHODS,
    Contrast,
    MethodComparison,
    compare_methods,
    method_name,
)
from tcs.placement.robustness.error_model import ErrorFile, ErrorModel
from tcs.placement.robustness.estimation import (
    robustify,
    success_of,
    success_summary,
    with_success,
)
from tcs.placement.robustness.evaluation import SELECTIONS, Evaluation, evaluate
from tcs.placement.robustness.gains import Gain, Prediction, predictions, robust_gains
from tcs.placement.robustness.losses import Loss, Losses, losses
from tcs.placement.robustness.perturbed_points import PerturbedPoints
from tcs.placement.robustness.statistics import Difference, Mean, mean_of, rank_sum, signed_rank
from tcs.placement.robustness.study import RowStudy, StudyPlan, check_row, study_row, study_rows
from tcs.placement.robustness.trials import Trials

__all__ = [
    "METHODS",
    "SELECTIONS",
    "Contrast",
    "Difference",
    "ErrorFile",
    "ErrorModel",
    "Evaluation",
    "Gain",
    "Loss",
    "Losses",
    "Mean",
    "MethodComparison",
    "PerturbedPoints",
    "Prediction",
    "RowStudy",
    "StudyPlan",
    "Trials",
    "check_row",
    "compare_methods",
    "evaluate",
    "losses",
    "mean_of",
    "method_name",
    "predictions",
    "rank_sum",
    "robust_gains",
    "robustify",
    "signed_rank",
    "study_row",
    "study_rows",
    "success_of",
    "success_summary",
    "with_success",
]

"""Robustness: what is left of a set of configurations when the room is a little off."""

from __future__ import annotations

from tcs.robustness.comparison import CELLS, Contrast, MethodTable, cell_name, compare_methods
from tcs.robustness.error_model import ErrorFile, ErrorModel
from tcs.robustness.estimation import robustify, success_of, success_summary
from tcs.robustness.evaluation import SELECTIONS, Evaluation, evaluate
from tcs.robustness.gains import Gain, Prediction, predictions, robust_gains
from tcs.robustness.losses import Loss, Losses, losses
from tcs.robustness.statistics import Difference, Mean, mean_of, rank_sum, signed_rank
from tcs.robustness.trials import Trials

__all__ = [
    "CELLS",
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
    "MethodTable",
    "Prediction",
    "Trials",
    "cell_name",
    "compare_methods",
    "evaluate",
    "losses",
    "mean_of",
    "predictions",
    "rank_sum",
    "robust_gains",
    "robustify",
    "signed_rank",
    "success_of",
    "success_summary",
]

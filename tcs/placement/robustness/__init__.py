"""Robustness: what is left of a set of configurations when the room is a little off."""

from __future__ import annotations

from tcs.placement.robustness.comparison import (
    CELLS,
    Contrast,
    MethodTable,
    cell_name,
    compare_methods,
)
from tcs.placement.robustness.error_model import ErrorFile, ErrorModel
from tcs.placement.robustness.estimation import robustify, success_of, success_summary
from tcs.placement.robustness.evaluation import SELECTIONS, Evaluation, evaluate
from tcs.placement.robustness.gains import Gain, Prediction, predictions, robust_gains
from tcs.placement.robustness.losses import Loss, Losses, losses
from tcs.placement.robustness.statistics import Difference, Mean, mean_of, rank_sum, signed_rank
from tcs.placement.robustness.trials import Trials

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

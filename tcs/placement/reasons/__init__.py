"""Why a goal is not reached, and the least change that would reach it; from a score file alone."""

from __future__ import annotations

from tcs.placement.reasons.changes import Change
from tcs.placement.reasons.distribution import BlockingPair, Check, Distribution
from tcs.placement.reasons.explained import Standing
from tcs.placement.reasons.explanation import Explanation, explain
from tcs.placement.reasons.fix import Fix, fix_weights

__all__ = [
    "BlockingPair",
    "Change",
    "Check",
    "Distribution",
    "Explanation",
    "Fix",
    "Standing",
    "explain",
    "fix_weights",
]

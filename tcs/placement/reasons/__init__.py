"""Reasons: why a goal is not reached, and the cheapest change of the configuration that reaches it.

In: a loaded score file, a goal and a configuration; neither simulator nor compiler is needed. Out:
an explanation with the reason, the counts of all reasons over the grid, and the nearest
configuration that reaches the goal.
"""

from __future__ import annotations

from tcs.placement.reasons.distribution import BlockingPair, CheckCount, Distribution
from tcs.placement.reasons.explained import Change, ExplainedConfiguration, nearest_configuration
from tcs.placement.reasons.explanation import Explanation, explain
from tcs.placement.reasons.fix import Fix, fix_weights

__all__ = [
    "BlockingPair",
    "Change",
    "CheckCount",
    "Distribution",
    "ExplainedConfiguration",
    "Explanation",
    "Fix",
    "explain",
    "fix_weights",
    "nearest_configuration",
]

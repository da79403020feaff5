"""Selection of the set to use now, the online part of TCS.

In: a score file (or one of its tables) and the current state of robot and environment. Out: the
stored set with the greatest utility, in milliseconds, without Drake or a compiler.
"""

from __future__ import annotations

from tcs.placement.selection.admission import Executability, scores_at_limbs
from tcs.placement.selection.alternatives import Top
from tcs.placement.selection.best import same_set, select
from tcs.placement.selection.choice import Choice, SelectionTables
from tcs.placement.selection.observed import Match, nearest_table
from tcs.placement.selection.parked import ServedStop
from tcs.placement.selection.travel import TravelWeights, shortest_tour
from tcs.placement.selection.utility import PAPER_WEIGHTS, UtilityWeights, utility

__all__ = [
    "PAPER_WEIGHTS",
    "Choice",
    "Executability",
    "Match",
    "SelectionTables",
    "ServedStop",
    "Top",
    "TravelWeights",
    "UtilityWeights",
    "nearest_table",
    "same_set",
    "scores_at_limbs",
    "select",
    "shortest_tour",
    "utility",
]

"""Choosing the set to use now, from a score file and the current state."""

from __future__ import annotations

from tcs.placement.selection.choice import Choice, SelectionTables, select
from tcs.placement.selection.observed import Match, nearest_table
from tcs.placement.selection.travel import TravelWeights, shortest_tour
from tcs.placement.selection.utility import UtilityWeights, utility

__all__ = [
    "Choice",
    "Match",
    "SelectionTables",
    "TravelWeights",
    "UtilityWeights",
    "nearest_table",
    "select",
    "shortest_tour",
    "utility",
]

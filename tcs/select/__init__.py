"""Choosing the set to use now, from a score file and the current state."""

from __future__ import annotations

from tcs.select.choice import Choice, SelectionTables, select
from tcs.select.observed import Match, nearest_table
from tcs.select.travel import TravelWeights, shortest_tour
from tcs.select.utility import UtilityWeights, utility

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

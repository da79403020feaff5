"""Choosing the set to use now, from a score file and the current state."""

from __future__ import annotations

from tcs.select.choice import Choice, SelectionTables, select
from tcs.select.travel import TravelWeights, shortest_tour
from tcs.select.utility import UtilityWeights, utility

__all__ = [
    "Choice",
    "SelectionTables",
    "TravelWeights",
    "UtilityWeights",
    "select",
    "shortest_tour",
    "utility",
]

"""Plain data that the other rooms pass around: configurations, scores, sets (numpy only)."""

from __future__ import annotations

from tcs.tables.configuration import InitialConfiguration
from tcs.tables.equations import tc_manipulability, tc_reachability
from tcs.tables.floor import Floor
from tcs.tables.scores import Reason, ScoreTable
from tcs.tables.sets import SetTable
from tcs.tables.success import SuccessTable

__all__ = [
    "Floor",
    "InitialConfiguration",
    "Reason",
    "ScoreTable",
    "SetTable",
    "SuccessTable",
    "tc_manipulability",
    "tc_reachability",
]

"""Tables of placement: scores, sets, success under error, windows, motions, lattice, place maps.

In: arrays from scoring, estimation, refinement or a score file. Out: frozen tables with checked,
read-only arrays, and the equations over them; numpy only.
"""

from __future__ import annotations

from tcs.placement.tables.equations import (
    members_by_dexterity,
    tc_manipulability,
    tc_reachability,
)
from tcs.placement.tables.motions import MotionOutcome, MotionTable
from tcs.placement.tables.refined import RefinedSet, RefinedTable
from tcs.placement.tables.scores import Reason, ScoreTable
from tcs.placement.tables.sets import BaseLattice, SetTable
from tcs.placement.tables.success import Estimates, SuccessTable
from tcs.placement.tables.windows import Window, WindowTable, window_text

__all__ = [
    "BaseLattice",
    "Estimates",
    "MotionOutcome",
    "MotionTable",
    "Reason",
    "RefinedSet",
    "RefinedTable",
    "ScoreTable",
    "SetTable",
    "SuccessTable",
    "Window",
    "WindowTable",
    "members_by_dexterity",
    "tc_manipulability",
    "tc_reachability",
    "window_text",
]

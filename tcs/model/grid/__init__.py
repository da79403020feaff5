"""The grid of initial configurations: its axes, and the configurations they span.

In: axes from environment and task files. Out: configurations by flat index, and the index of each
along the axes.
"""

from __future__ import annotations

from tcs.model.grid.axis import Axis
from tcs.model.grid.condition import AxisCondition, restricted
from tcs.model.grid.configuration import ENVIRONMENT_UNITS, InitialConfiguration
from tcs.model.grid.grid import MAX_CONFIGURATIONS, ROBOT_AXES, Grid, thinned

__all__ = [
    "ENVIRONMENT_UNITS",
    "MAX_CONFIGURATIONS",
    "ROBOT_AXES",
    "Axis",
    "AxisCondition",
    "Grid",
    "InitialConfiguration",
    "restricted",
    "thinned",
]

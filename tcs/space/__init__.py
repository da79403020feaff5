"""The space of initial configurations: axes, and the grid they span."""

from __future__ import annotations

from tcs.space.axis import Axis
from tcs.space.grid import MAX_CONFIGURATIONS, ROBOT_AXES, Grid

__all__ = ["MAX_CONFIGURATIONS", "ROBOT_AXES", "Axis", "Grid"]

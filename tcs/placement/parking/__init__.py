"""Parking windows: how far the robot may be off its stop so that it still serves its goals there.

In: a score file and stops of it. Out: boxes of base poses around the stops, each checked by the
scorer of the grid. Importing this needs neither simulator nor compiler; finding windows does.
"""

from __future__ import annotations

from tcs.placement.parking.windows import find_windows, select, with_windows

__all__ = ["find_windows", "select", "with_windows"]

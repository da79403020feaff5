"""Scenes of posts and tables, as shapes without a simulator."""

from __future__ import annotations

import math

import numpy as np

from tcs.kernel.arrays import BOX, Shapes
from tcs.perception import TIAGO, Leg, PlanarPose, Scans, TableFile, load_table
from tcs.perception.simulation import simulate, true_ranges

THESIS = load_table("thesis")
HIGH = PlanarPose(0.65, 0.15, 0.0)
"""The table of the thesis seen from the base pose ITCM-high, its task 10 cm behind the edge."""


def posts(*boxes: tuple[float, float, float, float, float]) -> Shapes:
    """Return posts of x, y, yaw and sizes, from the floor to 0.4 m."""
    rows = np.array(boxes, dtype=float).reshape(-1, 5)
    n = len(rows)
    c, s = np.cos(rows[:, 2]), np.sin(rows[:, 2])
    R = np.tile(np.eye(3), (n, 1, 1))
    R[:, 0, 0], R[:, 0, 1], R[:, 1, 0], R[:, 1, 1] = c, -s, s, c
    return Shapes(
        type=np.full(n, BOX, np.int8),
        size=np.column_stack([0.5 * rows[:, 3:], np.full(n, 0.2)]),
        pad=np.zeros(n),
        body=np.arange(n, dtype=np.int16),
        frame=np.zeros(n, np.int8),
        R=R[None],
        p=np.column_stack([rows[:, :2], np.full(n, 0.2)])[None],
    )


def legs_of(table: TableFile, pose: PlanarPose) -> list[tuple[float, float, float, float, float]]:
    """Return the legs of a table as posts in B."""
    found = []
    for leg in table.legs:
        at = pose @ PlanarPose(*leg.xy, 0.0)
        found.append((at.x, at.y, at.yaw, *leg.size))
    return found


def scanned(*boxes, run: int = 0, scans: int = 10) -> Scans:
    """Return simulated scans of posts."""
    return simulate(posts(*boxes), PlanarPose(0, 0, 0), scans=scans, run=run)


def exact(*boxes) -> Scans:
    """Return scans without errors."""
    ranges = true_ranges(posts(*boxes), TIAGO, PlanarPose(0, 0, 0))
    return Scans(TIAGO, np.tile(ranges, (3, 1)))


def square_table(side: float = 0.7, leg: float = 0.04) -> TableFile:
    """Return a table that looks the same from four sides."""
    at = 0.5 * (side - leg)
    corners = [(0.5 * side + x, y) for x in (-at, at) for y in (-at, at)]
    return TableFile(
        name="square", title="A square table", source="made up", size=(side, side, 0.7),
        thickness=0.03,
        legs=tuple(Leg(name=f"leg {i}", xy=xy, size=(leg, leg)) for i, xy in enumerate(corners)),
    )  # fmt: skip


DEGREE = math.radians(1.0)

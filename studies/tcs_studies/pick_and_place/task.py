"""The pick-and-place task of the ITCM thesis: table, cup, place, and base poses."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.errors import TaskError, UnknownNameError
from tcs.files.quantities import ANGLE_DEG, POSITION
from tcs.kernel.arrays import FloatArray

TABLE_HEIGHT, TABLE_WIDTH = 0.37, 0.755
"""Height of the table and its extent along the edge [m] (thesis, III.B)."""
TABLE_DEPTH = 0.6
"""Extent of the table away from the edge [m]; not printed."""
EDGE = 0.10
"""Distance from the edge to the cup [m]; not printed."""
CUP_HEIGHT, CUP_RADIUS = 0.09, 0.03
"""Size of the cup [m]; its radius is not printed."""
GRASP_HEIGHT = TABLE_HEIGHT + 0.5 * CUP_HEIGHT
"""Height of the middle of the cup on the table [m] (thesis, III.B)."""
PLACE = (0.0, 0.15)
"""The place in the task frame F [m]: 15 cm along the edge. The direction is not printed; only to
the left is ITCM-low in our own map of the task, as it is in that of the thesis."""
CIRCLE_RADIUS = 0.055
"""Radius of the circle on the table that marks the place [m]; not printed."""
START = (0.65, 0.28, 0.50)
"""Position of the tool in the base at the start [m], level and pointing ahead. As Appendix F.2
describes it: for ITCM-high almost above the table and between the markers, for Expert some 10 cm
from the table and in front of the place. The height is not printed."""
BASE_RADIUS = 0.27
"""Radius of the mobile base of TIAGo [m]."""
FARTHEST = 0.30
"""Distance of the gripper from the place at which a repetition ends [m] (thesis, III.C.4)."""
TORSO_HEIGHT = 0.1725
"""Torso height [m] with the shoulder at 0.91 m, as in the thesis."""


def table_distance(x: float, y: float) -> float:
    """Return the distance of a point of F from the table [m]; negative or 0 above it."""
    middle = 0.5 * PLACE[1]
    dx = max(-EDGE - x, x - (TABLE_DEPTH - EDGE))
    dy = abs(y - middle) - 0.5 * TABLE_WIDTH
    if dx > 0.0 and dy > 0.0:
        return math.hypot(dx, dy)
    return max(dx, dy)


@dataclass(frozen=True, slots=True)
class Condition:
    """A base pose: the task frame F as seen from the base B, as in the thesis's Table 1.

    F is on the floor under the cup, x away from the edge of the table, y to the left along it.

    Attributes:
        name: Name of the condition.
        x: Distance of F ahead of the base [m].
        y: Distance of F to the left of the base [m].
        yaw_deg: Rotation of F in the base [deg].
    """

    name: str
    x: float
    y: float
    yaw_deg: float

    def __post_init__(self) -> None:
        """Check the pose.

        Raises:
            TaskError: If a number is out of its range, or the base would be in the table.
        """
        where = f"base pose '{self.name}'"
        POSITION.check((self.x, self.y), f"{where}: a coordinate of the task", TaskError)
        ANGLE_DEG.check((self.yaw_deg,), f"{where}: the rotation of the task", TaskError)
        off = table_distance(*self.in_task(0.0, 0.0))
        if off < BASE_RADIUS:
            raise TaskError(
                f"{where}: the centre of the base is {max(off, 0.0):.2f} m from the table; it must "
                f"be at least {BASE_RADIUS:g} m, its radius. Move the base away from the table."
            )

    @property
    def yaw(self) -> float:
        """Rotation of F in the base [rad]."""
        return math.radians(self.yaw_deg)

    def in_base(self, x: float, y: float) -> tuple[float, float]:
        """Return a point of F in the base [m]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + c * x - s * y, self.y + s * x + c * y

    def in_task(self, x: float, y: float) -> tuple[float, float]:
        """Return a point of the base frame in F [m]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        dx, dy = x - self.x, y - self.y
        return c * dx + s * dy, c * dy - s * dx

    @property
    def cup(self) -> FloatArray:
        """Position of the middle of the cup before the pick, in the base [m], shape (3,)."""
        return np.array([self.x, self.y, GRASP_HEIGHT])

    @property
    def place(self) -> FloatArray:
        """Position of the middle of the cup at the place, in the base [m], shape (3,)."""
        return np.array([*self.in_base(*PLACE), GRASP_HEIGHT])

    def over_table(self, x: float, y: float) -> bool:
        """Return whether a point of the base frame is above the table."""
        return table_distance(*self.in_task(x, y)) <= 0.0


EXPERT = Condition("Expert", 0.88, 0.20, 2.9)
ITCM_HIGH = Condition("ITCM-high", 0.75, 0.15, 0.0)
ITCM_LOW = Condition("ITCM-low", 0.55, -0.45, -90.0)
CONDITIONS = (EXPERT, ITCM_HIGH, ITCM_LOW)
"""The conditions of the thesis's Table 1."""
FAMILIARISATION = Condition("familiarisation", 0.815, 0.175, 1.45)
"""Between ITCM-high and Expert (thesis, III.C.3)."""


def conditions_named(names: tuple[str, ...]) -> tuple[Condition, ...]:
    """Return conditions of the thesis by name, all without names.

    Raises:
        UnknownNameError: If there is no such condition.
    """
    known = {condition.name: condition for condition in CONDITIONS}
    for name in names:
        if name not in known:
            raise UnknownNameError("base pose", name, known)
    return tuple(known[name] for name in dict.fromkeys(names)) or CONDITIONS

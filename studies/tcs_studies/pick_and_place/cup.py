"""The cup: rules by which a gripper pushes, topples, holds and drops it.

The rules are quasi-static and kinematic. A standing cup that overlaps a finger or the palm is moved
out of it by the shortest way. It topples where it is pushed above the height at which friction
would tip it instead of sliding it, or faster than its own energy barrier allows. Fingers that close
on it hold it rigidly; a cup held by the tips of the fingers slips out when it is lifted.
"""

from __future__ import annotations

import math
from enum import StrEnum

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs_studies.pick_and_place.task import (
    CUP_HEIGHT,
    CUP_RADIUS,
    GRASP_HEIGHT,
    TABLE_HEIGHT,
    Condition,
)

OPENING = 0.044
"""Distance of a finger from the middle of the open gripper [m]: robot file, soft limit."""
CLOSING_TIME = 1.0
"""Time in which the open gripper closes [s]."""
PALM, TIPS = -0.102, 0.019
"""Front of the palm and tips of the fingers along x of the tool frame [m]: robot file."""
FINGER_THICKNESS, FINGER_HALF_HEIGHT = 0.010, 0.028
"""Size of a finger [m]: robot file."""
PALM_HALF_WIDTH, PALM_LENGTH, PALM_HALF_HEIGHT = 0.052, 0.116, 0.039
"""Size of the palm [m]: robot file."""
FRICTION = 0.4
"""Coefficient of friction between cup and table: plastic on wood."""
MASS_HEIGHT = 0.03
"""Height of the centre of mass of the weighted cup above its base [m]; not printed."""
TIPPING_HEIGHT = CUP_RADIUS / FRICTION
"""Height above the table at which a push tips the cup instead of sliding it [m]."""
TIPPING_SPEED = math.sqrt(2.0 * 9.81 * (math.hypot(CUP_RADIUS, MASS_HEIGHT) - MASS_HEIGHT))
"""Speed of a push with the energy to tip the cup over its rim [m/s]."""
STABLE_TILT = 0.5 * math.atan2(CUP_RADIUS, MASS_HEIGHT)
"""Greatest tilt of a released cup that stays upright [rad]: half of the tilt at which the centre of
mass is above the rim, since it sways."""
SAFE_DROP = 0.04
"""Greatest height from which the cup lands upright [m]."""
LEAST_HOLD = 0.015
"""Least length of finger beyond the axis of a cup that does not slip out [m]."""
LEAST_OVERLAP = 0.02
"""Least height of cup between the fingers that holds it [m]."""
LIFTED = 0.02
"""Height above the table at which a badly held cup has slipped out [m]."""


class CupState(StrEnum):
    """State of the cup."""

    STANDING = "standing"
    HELD = "held"
    TOPPLED = "toppled"
    """Knocked over, or dropped from too high."""
    FALLEN = "fallen"
    """Beside the table."""


LOST = (CupState.TOPPLED, CupState.FALLEN)
"""States in which the repetition has failed."""


class Cup:
    """A cup on the table, and the fingers that move it."""

    def __init__(self, condition: Condition, period: float) -> None:
        """Put the cup at the pick position, with the gripper open.

        Args:
            condition: The base pose.
            period: Time between two steps [s].
        """
        self.state = CupState.STANDING
        self.p = condition.cup
        """Position of the middle of the cup in the base [m], shape (3,)."""
        self.opening = OPENING
        """Distance of a finger from the middle of the gripper [m]."""
        self._condition, self._period = condition, period
        self._in_tool = np.zeros(3)

    def advance(self, R: FloatArray, p: FloatArray, *, close: bool) -> None:
        """Move fingers and cup by one period.

        Args:
            R: Orientation of the tool in the base, shape (3, 3).
            p: Position of the tool in the base [m], shape (3,).
            close: Whether the gripper is commanded to close.
        """
        target = 0.0 if close else OPENING
        step = OPENING / CLOSING_TIME * self._period
        self.opening += min(max(target - self.opening, -step), step)
        if self.state is CupState.HELD:
            self.opening = max(self.opening, CUP_RADIUS)
            self._carry(R, p, released=not close and self.opening > CUP_RADIUS + step)
        elif self.state is CupState.STANDING:
            off = self.p - p
            # The cup is far from the gripper during most of a repetition.
            if abs(off[2]) < 0.15 and off[0] * off[0] + off[1] * off[1] < 0.04:
                self._touch(R, p, R.T @ off, close=close)

    @property
    def bottom_below_tool(self) -> float | None:
        """Height of the tool origin above the bottom of a held cup [m]; None if it is not held."""
        return None if self.state is not CupState.HELD else self._below

    def _touch(self, R: FloatArray, p: FloatArray, c: FloatArray, *, close: bool) -> None:
        """Hold the cup, or push it out of fingers and palm.

        Args:
            R: Orientation of the tool in the base.
            p: Position of the tool in the base [m].
            c: Middle of the cup in the tool frame [m].
            close: Whether the gripper closes.
        """
        tool_height = float(p[2]) - TABLE_HEIGHT
        low = max(0.0, tool_height - FINGER_HALF_HEIGHT)
        high = min(CUP_HEIGHT, tool_height + FINGER_HALF_HEIGHT)
        if high <= low:
            return
        between = abs(c[1]) < self.opening and PALM < c[0] < TIPS
        if close and between and self.opening <= CUP_RADIUS and high - low >= LEAST_OVERLAP:
            self.state = CupState.HELD
            self.opening = CUP_RADIUS
            self._in_tool = R.T @ (self.p - p)
            self._carry(R, p, released=False)
            return
        push = self._push(float(c[0]), float(c[1]))
        distance = math.hypot(*push)
        if not distance:
            return
        # Only level pushes: the table holds the cup from below.
        self.p[:2] += R[:2, 0] * push[0] + R[:2, 1] * push[1]
        if 0.5 * (low + high) > TIPPING_HEIGHT or distance > TIPPING_SPEED * self._period:
            self.state = CupState.TOPPLED
        elif not self._condition.over_table(float(self.p[0]), float(self.p[1])):
            self.state = CupState.FALLEN

    def _push(self, x: float, y: float) -> tuple[float, float]:
        """Return the displacement that frees the cup from fingers and palm, in the tool frame."""
        dx = dy = 0.0
        inner, outer = self.opening, self.opening + FINGER_THICKNESS
        for x0, x1, y0, y1 in (
            (PALM - PALM_LENGTH, PALM, -PALM_HALF_WIDTH, PALM_HALF_WIDTH),
            (PALM, TIPS, inner, outer),
            (PALM, TIPS, -outer, -inner),
        ):
            px, py = _out_of(x + dx, y + dy, x0, x1, y0, y1)
            dx, dy = dx + px, dy + py
        return dx, dy

    def _carry(self, R: FloatArray, p: FloatArray, *, released: bool) -> None:
        """Move a held cup with the tool, and let go of it where it is released or slips out."""
        self.p = p + R @ self._in_tool
        tilt = math.acos(min(1.0, abs(float(R[2, 2]))))
        # The rim of a tilted cup is lower than its middle.
        bottom = float(self.p[2]) - 0.5 * CUP_HEIGHT * math.cos(tilt) - CUP_RADIUS * math.sin(tilt)
        self._below = float(p[2]) - bottom
        height = bottom - TABLE_HEIGHT
        slips = TIPS - self._in_tool[0] < LEAST_HOLD and height > LIFTED
        if not (released or slips):
            return
        if not self._condition.over_table(float(self.p[0]), float(self.p[1])):
            self.state = CupState.FALLEN
        elif height > SAFE_DROP or tilt > STABLE_TILT:
            self.state = CupState.TOPPLED
        else:
            self.state = CupState.STANDING
            self.p[2] = GRASP_HEIGHT


def _out_of(x: float, y: float, x0: float, x1: float, y0: float, y1: float) -> tuple[float, float]:
    """Return the shortest displacement of a disc of the cup's radius out of a rectangle."""
    nx, ny = min(max(x, x0), x1), min(max(y, y0), y1)
    dx, dy = x - nx, y - ny
    distance = math.hypot(dx, dy)
    if distance >= CUP_RADIUS:
        return 0.0, 0.0
    if distance > 0.0:
        far = CUP_RADIUS / distance - 1.0
        return dx * far, dy * far
    # The axis of the cup is inside: out through the nearest side.
    ways = (
        (x1 - x + CUP_RADIUS, 0.0), (x0 - x - CUP_RADIUS, 0.0),
        (0.0, y1 - y + CUP_RADIUS), (0.0, y0 - y - CUP_RADIUS),
    )  # fmt: skip
    return min(ways, key=lambda way: math.hypot(*way))

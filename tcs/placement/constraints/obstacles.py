"""Obstacles seen just now: boxes that the scores do not contain."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, one_line
from tcs.files.quantities import ANGLE_DEG, POSITION, SIZE
from tcs.placement.constraints.regions import Region

CEILING = 40.0
"""Top of an obstacle whose height is not given [m]: above every robot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A box on or above the floor, in the environment frame W."""

    x: float
    """x of its centre [m]."""
    y: float
    """y of its centre [m]."""
    width: float
    """Full size along its own x [m]."""
    depth: float
    """Full size along its own y [m]."""
    yaw: float = 0.0
    """Rotation about z [rad]."""
    z_low: float = 0.0
    """Height of its lower side [m]."""
    z_high: float = CEILING
    """Height of its upper side [m]; by default above every robot."""

    def __post_init__(self) -> None:
        """Check the sizes.

        Raises:
            SelectionError: If a number is out of its range, or the upper side is not above the
                lower one.
        """
        POSITION.check((self.x, self.y, self.z_low, self.z_high), "Obstacle", SelectionError)
        SIZE.check((self.width, self.depth), "Obstacle", SelectionError)
        ANGLE_DEG.check(math.degrees(self.yaw), "Obstacle", SelectionError)
        if not self.z_low < self.z_high:
            raise SelectionError(
                f"Obstacle: z_high is {self.z_high:g} m; must be above z_low, {self.z_low:g} m."
            )

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the obstacle of a text [m, deg].

        A text "X Y WIDTH DEPTH [YAW_DEG] [Z_LOW Z_HIGH]" is a box. A text "X1 Y1, X2 Y2, X3 Y3,
        ... [; Z_LOW Z_HIGH]" is a polygon, see `around`.

        Raises:
            SelectionError: If the text is not of that form, or a number is out of its range.

        >>> Obstacle.parse("1 -0.5 0.4 0.6 90").yaw
        1.5707963267948966
        >>> Obstacle.parse("0 0, 2 0, 2 1; 0 0.9").name
        '1 0.5 2 1 0 0 0.9'
        """
        if ";" in text or len(text.split(",")) >= 3:
            corners, _, span = text.partition(";")
            region = Region.parse(corners)
            if not span.strip():
                return cls.around(region)
            return cls.around(region, *_two_numbers(span, text))
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            numbers = []
        if not 4 <= len(numbers) <= 7:
            raise SelectionError(
                f"Obstacle '{one_line(text)}' must be X Y WIDTH DEPTH [YAW_DEG] [Z_LOW Z_HIGH], "
                "four to seven numbers in metres and degrees, or a polygon X1 Y1, X2 Y2, X3 Y3, "
                "... [; Z_LOW Z_HIGH]."
            )
        heights = numbers[-2:] if len(numbers) >= 6 else [0.0, CEILING]
        x, y, width, depth = numbers[:4]
        yaw_deg = numbers[4] if len(numbers) in (5, 7) else 0.0
        return cls(
            x=x,
            y=y,
            width=width,
            depth=depth,
            yaw=math.radians(yaw_deg),
            z_low=heights[0],
            z_high=heights[1],
        )

    @classmethod
    def around(cls, region: Region, z_low: float = 0.0, z_high: float = CEILING) -> Self:
        """Return a box that encloses a polygon, parallel to one of its edges, with the least area.

        Args:
            region: The polygon.
            z_low: Height of the lower side [m].
            z_high: Height of the upper side [m].

        Raises:
            SelectionError: If the upper side is not above the lower one.
        """
        vertices = np.array(region.vertices)
        edges = np.roll(vertices, -1, axis=0) - vertices
        yaw = np.arctan2(edges[:, 1], edges[:, 0])
        # Axes of a box parallel to each edge, shape (edges, 2, 2); vertices along them.
        axes = np.stack([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
        along = np.einsum("aie,vi->eva", axes, vertices)
        low, high = along.min(axis=1), along.max(axis=1)
        best = int(np.argmin(np.prod(high - low, axis=1)))
        x, y = axes[:, :, best].T @ ((low[best] + high[best]) / 2.0)
        # A polygon without area still blocks what touches it.
        width, depth = np.maximum(high[best] - low[best], SIZE.low)
        return cls(
            x=float(x),
            y=float(y),
            width=float(width),
            depth=float(depth),
            yaw=float(yaw[best]),
            z_low=z_low,
            z_high=z_high,
        )

    @property
    def name(self) -> str:
        """The obstacle in the form that `parse` takes."""
        text = f"{self.x:g} {self.y:g} {self.width:g} {self.depth:g} {math.degrees(self.yaw):g}"
        if self.z_low == 0.0 and self.z_high == CEILING:
            return text.removesuffix(" 0")
        return f"{text} {self.z_low:g} {self.z_high:g}"

    @property
    def half(self) -> NDArray[np.float64]:
        """Half sizes along its axes [m], shape (3,)."""
        return np.array([self.width, self.depth, self.z_high - self.z_low]) / 2.0

    @property
    def centre(self) -> NDArray[np.float64]:
        """Centre in W [m], shape (3,)."""
        return np.array([self.x, self.y, (self.z_low + self.z_high) / 2.0])


def _two_numbers(heights: str, text: str) -> tuple[float, float]:
    """Return the heights of a polygon.

    Raises:
        SelectionError: If they are not two numbers.
    """
    try:
        low, high = (float(word) for word in heights.split())
    except ValueError:
        raise SelectionError(
            f"Obstacle '{one_line(text)}': after ';' there must be Z_LOW Z_HIGH, two numbers [m]."
        ) from None
    return low, high

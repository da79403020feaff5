"""Freedom of a goal: the tool poses that serve as well as the nominal one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TaskError
from tcs.kernel.freedom.forms import COLUMNS

Vector = tuple[float, float, float]

LEAST_AXIS = 1e-5
"""Least length of an axis that has a direction."""
MOST_FOLDS = 12
"""Greatest number of equivalent orientations about an axis; beyond, the rotation may be free."""
WIDEST_BOX = 0.5
"""Greatest tolerance of a position [m]; a larger number is not in metres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Freedom:
    """Poses X_GT of the tool T at a goal G that all serve, the identity among them.

    The orientation is a tilt of the axis, by at most `tilt` in any direction, after a rotation
    about the axis: R_GT = exp(t) Rot(axis, angle), with t perpendicular to the axis. The position
    is anywhere in a box along the axes of G.
    """

    axis: Vector = (1.0, 0.0, 0.0)
    """Unit vector in G, and in T."""
    rotates: bool = False
    """Whether the angle about the axis is free."""
    fold: int = 1
    """Number of equivalent angles about the axis: 2 for a gripper with two equal fingers."""
    tilt: float = 0.0
    """Greatest angle between the axis in T and in G [rad]; with `rotates`, pi frees them all."""
    box: Vector = (0.0, 0.0, 0.0)
    """Greatest displacement along each axis of G, in both directions [m]."""

    def __post_init__(self) -> None:
        """Check the values, and normalise the axis.

        Raises:
            TaskError: If a value is not finite or out of its range, or nothing is free.
        """
        length = math.hypot(*self.axis)
        if not math.isfinite(length) or length < LEAST_AXIS:
            raise TaskError(
                f"the axis is {list(self.axis)}, but must be [x, y, z] of finite numbers with a "
                "length. Name a direction in the tool frame, e.g. [1, 0, 0]."
            )
        if not 1 <= self.fold <= MOST_FOLDS:
            raise TaskError(
                f"field 'fold' is {self.fold}, but must be 1 to {MOST_FOLDS}. Use 'rotation_about' "
                "for a tool that looks alike from all sides."
            )
        if not 0.0 <= self.tilt <= math.pi or (self.tilt == math.pi and not self.rotates):
            raise TaskError(
                f"the half-angle is {math.degrees(self.tilt):g} degrees, but must be above 0 and "
                "below 180. Use 'orientation' for any orientation."
            )
        if not all(0.0 <= size <= WIDEST_BOX for size in self.box):
            raise TaskError(
                f"field 'position' is {list(self.box)}, but must be three tolerances from 0 to "
                f"{WIDEST_BOX:g} m, along x, y and z of the goal."
            )
        if not (self.rotates or self.fold > 1 or self.tilt or any(self.box)):
            raise TaskError("nothing is free. Leave 'free' out, or name what is free.")
        x, y, z = (float(a) / length for a in self.axis)
        object.__setattr__(self, "axis", (x, y, z))

    @classmethod
    def of_orientation(cls, box: Vector = (0.0, 0.0, 0.0)) -> Self:
        """Return the freedom of any orientation, with the position within a box [m]."""
        return cls(rotates=True, tilt=math.pi, box=box)

    @property
    def is_any_orientation(self) -> bool:
        """Whether every orientation serves."""
        return self.rotates and self.tilt == math.pi

    def row(self) -> NDArray[np.float64]:
        """Return the freedom as the kernel reads it, shape (COLUMNS,)."""
        row = np.zeros(COLUMNS)
        row[0:3], row[3], row[4], row[5] = self.axis, self.rotates, self.fold, self.tilt
        row[6:9] = self.box
        return row

    def errors(self, R_GT: NDArray[np.float64], p_GT: NDArray[np.float64]) -> tuple[float, float]:
        """Return how far a tool pose is from the nearest one that serves.

        Args:
            R_GT: Orientation of the tool in the goal frame, shape (3, 3).
            p_GT: Position of the tool in the goal frame [m], shape (3,).

        Returns:
            Distance [m] and angle [rad], 0 within the freedom.
        """
        beyond = np.maximum(np.abs(p_GT) - self.box, 0.0)
        distance = float(np.linalg.norm(beyond))
        if self.is_any_orientation:
            return distance, 0.0
        axis = np.array(self.axis)
        tilted = R_GT @ axis
        normal = np.cross(axis, tilted)
        tilt = math.atan2(float(np.linalg.norm(normal)), float(axis @ tilted))
        excess = max(0.0, tilt - self.tilt)
        if self.rotates:
            return distance, excess
        # The rotation about the axis that is left once the tilt is taken back: by the rotation
        # I + [n]x + [n]x^2 / (1 + cos) from the axis to the tilted one.
        cross = np.cross(np.eye(3), -normal)
        back = (np.eye(3) + cross + cross @ cross / (1.0 + float(axis @ tilted))).T @ R_GT
        sine = np.array([back[2, 1] - back[1, 2], back[0, 2] - back[2, 0], back[1, 0] - back[0, 1]])
        angle = math.atan2(0.5 * float(sine @ axis), 0.5 * (float(np.trace(back)) - 1.0))
        angle = math.remainder(angle, 2.0 * math.pi / self.fold)
        return distance, math.hypot(angle, excess)

    def __str__(self) -> str:
        """Return the freedom in words, e.g. "any rotation about x"."""
        parts = []
        axis = axis_name(self.axis)
        if self.is_any_orientation:
            parts.append("any orientation")
        else:
            if self.rotates:
                parts.append(f"any rotation about {axis}")
            elif self.fold > 1:
                parts.append(f"{self.fold}-fold symmetric about {axis}")
            if self.tilt:
                parts.append(f"{axis} within {math.degrees(self.tilt):g} deg")
        if any(self.box):
            sizes = " x ".join(f"{1e3 * size:g}" for size in self.box)
            parts.append(f"position within +-({sizes}) mm")
        return ", ".join(parts)


def axis_name(axis: Sequence[float]) -> str:
    """Return the name of an axis: x, y or z, or its components.

    >>> axis_name((1.0, 0.0, 0.0)), axis_name((0.0, 0.6, -0.8))
    ('x', '(0, 0.6, -0.8)')
    """
    for name, i in (("x", 0), ("y", 1), ("z", 2)):
        if abs(axis[i]) == 1.0:
            return name
    return f"({', '.join(f'{a:.4g}' for a in axis)})"

"""Tasks as tool poses: positions of the gripper, grasps at each, and pre-grasps.

Frames: F is the task frame, z up, its origin on the floor. The grid of the maps passes through its
origin, so positions are snapped to multiples of the step along x and y; heights are arbitrary where
the robot has a movable torso. Headings are those of E, the level frame at the tool, about the z
axis of F: the direction from which a side grasp approaches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.capability.grid import SIDE, TOP
from tcs.errors import TaskError, UnknownNameError
from tcs.files.quantities import ANGLE, POSITION
from tcs.kernel.arrays import FloatArray

FRONT_AND_SIDES = (0.0, math.pi / 2, -math.pi / 2)
"""From the front, the right and the left: headings of the thesis's pick-and-place task."""
ALL_SIDES = (0.0, math.pi / 2, math.pi, -math.pi / 2)
FARTHEST = 20.0
"""Greatest coordinate of a position [m]; a larger number is not in metres."""
_MOST_POSITIONS = 64
_APPROACHES = {SIDE: (0.0, 0.0), TOP: (math.pi / 2, 0.0)}
"""Pitch and roll of the tool in E [rad]."""


@dataclass(frozen=True, slots=True)
class Grasp:
    """A tool orientation at a position, and the pre-grasps before it."""

    heading: float
    """Heading of E in F [rad]."""
    approach: str | tuple[float, float] = SIDE
    """ "side", "top", or pitch and roll of the tool in E [rad]."""
    pre_grasps: tuple[float, ...] = ()
    """Distances back along the approach at which the tool pose must be reachable as well [m]."""

    @property
    def R_FT(self) -> FloatArray:
        """Orientation of the tool in F, shape (3, 3)."""
        pitch, roll = (
            _APPROACHES[self.approach] if isinstance(self.approach, str) else self.approach
        )
        (cy, cp, cr), (sy, sp, sr) = (f([self.heading, pitch, roll]) for f in (np.cos, np.sin))
        Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
        return np.asarray(Rz @ Ry @ Rx)


@dataclass(frozen=True, slots=True)
class GraspPosition:
    """A tool position and its alternative grasps."""

    x: float
    """x of the tool in F [m]."""
    y: float
    """y of the tool in F [m]."""
    height: float
    """Height of the tool above the floor [m]."""
    grasps: tuple[Grasp, ...]
    """Alternatives, of which one must be reachable."""


@dataclass(frozen=True, slots=True)
class GraspTask:
    """Positions that one base pose must reach."""

    name: str
    positions: tuple[GraspPosition, ...]

    def __post_init__(self) -> None:
        """Validate the positions.

        Raises:
            TaskError: If there is no position, one without a grasp, or a number is not finite.
            UnknownNameError: If there is no such approach.
        """
        if not 1 <= len(self.positions) <= _MOST_POSITIONS:
            raise TaskError(
                f"task '{self.name}' has {len(self.positions)} positions; must be 1 to "
                f"{_MOST_POSITIONS}."
            )
        for i, position in enumerate(self.positions):
            where = f"task '{self.name}', position {i}"
            if not position.grasps:
                raise TaskError(f"{where} has no grasp. Name at least one.")
            for grasp in position.grasps:
                named = isinstance(grasp.approach, str)
                if named and grasp.approach not in _APPROACHES:
                    raise UnknownNameError(
                        "approach", str(grasp.approach), _APPROACHES, where=where
                    )
                angles = () if isinstance(grasp.approach, str) else grasp.approach
                numbers = (position.x, position.y, position.height, grasp.heading, *angles)
                if not np.all(np.isfinite([*numbers, *grasp.pre_grasps])):
                    raise TaskError(f"{where} has a number that is not finite.")
                ANGLE.check((grasp.heading, *angles), f"{where}: an angle of a grasp", TaskError)
                POSITION.check(grasp.pre_grasps, f"{where}: a distance of a pre-grasp", TaskError)
            if max(abs(position.x), abs(position.y), abs(position.height)) > FARTHEST:
                raise TaskError(
                    f"{where} is more than {FARTHEST:g} m from the task's origin. Write metres."
                )

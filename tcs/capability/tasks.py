"""Tasks as tool poses: where the gripper has to be, from which sides, and what comes before.

Frames: F is the task frame, z up, its origin on the floor. The grid of the maps goes through it, so
positions are snapped to multiples of the step along x and y; heights are free where the robot has a
lift. Headings are those of E, the level frame at the tool, about F's z: the way a side grasp comes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tcs.capability.grid import SIDE, TOP
from tcs.errors import TaskError, UnknownNameError
from tcs.kernel.arrays import FloatArray

FRONT_AND_SIDES = (0.0, math.pi / 2, -math.pi / 2)
"""From the front, the right and the left: headings of the thesis's pick-and-place task."""
ALL_SIDES = (0.0, math.pi / 2, math.pi, -math.pi / 2)
FARTHEST = 20.0
"""Farthest that a position may be from the origin along an axis [m]: beyond, it is no metres."""
_MOST_POSITIONS = 64
_APPROACHES = {SIDE: (0.0, 0.0), TOP: (math.pi / 2, 0.0)}
"""Pitch and roll of the tool in E [rad]."""


@dataclass(frozen=True, slots=True)
class Grasp:
    """One way to hold the tool at a position."""

    heading: float
    """Of E in F [rad]."""
    approach: str | tuple[float, float] = SIDE
    """ "side", "top", or pitch and roll of the tool in E [rad]."""
    pre_grasps: tuple[float, ...] = ()
    """Places that must be reachable too, so far back along the approach [m]."""

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
    """A place the tool has to come to, and the grasps of which one has to do."""

    x: float
    y: float
    height: float
    """Above the floor [m]."""
    grasps: tuple[Grasp, ...]


@dataclass(frozen=True, slots=True)
class GraspTask:
    """Positions that are all to be reached from one base pose."""

    name: str
    positions: tuple[GraspPosition, ...]

    def __post_init__(self) -> None:
        """Refuse a task with nothing to do.

        Raises:
            TaskError: If there is no position, one without a grasp, or a number that is none.
            UnknownNameError: If an approach is unknown.
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
                    raise TaskError(f"{where} holds a number that is not finite.")
            if max(abs(position.x), abs(position.y), abs(position.height)) > FARTHEST:
                raise TaskError(
                    f"{where} is more than {FARTHEST:g} m from the task's origin. Write metres."
                )


def linear_task(
    length: float,
    samples: int,
    height: float,
    *,
    headings: Sequence[float] = FRONT_AND_SIDES,
    approach: str = SIDE,
    pre_grasps: Sequence[float] = (),
    direction: int = 1,
    step: float = 0.05,
    name: str = "linear",
) -> GraspTask:
    """Return positions along a straight line from the origin of F.

    Neighbours are a multiple of the step apart, so that there may be more or fewer positions than
    asked for: 3 samples on 0.15 m are 4 positions 0.05 m apart.

    Args:
        length: From the first to the last position [m].
        samples: How many positions are asked for.
        height: Of all of them [m].
        headings: Of the grasps at each [rad].
        approach: "side" or "top".
        pre_grasps: How far back pre-grasps are [m].
        direction: The way the line goes, in quarter turns from F's x axis.
        step: Of the map's grid [m].
        name: Of the task.

    Raises:
        TaskError: If the line is shorter than a step or longer than `FARTHEST`, or there are fewer
            than two samples.

    Source:
        ITCM thesis, Appendix A.1 and Figure 16.
    """
    if not (step <= length <= FARTHEST and samples >= 2):
        raise TaskError(
            f"task '{name}': a line of {length:g} m with {samples} samples; must be at least one "
            f"step of {step:g} m, at most {FARTHEST:g} m, and have 2 samples."
        )
    steps = round(length / step)
    spacing = max(1, steps // (samples - 1))
    dx, dy = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction % 4]
    grasps = tuple(Grasp(heading, approach, tuple(pre_grasps)) for heading in headings)
    places = [k * spacing * step for k in range(steps // spacing + 1)]
    return GraspTask(name, tuple(GraspPosition(s * dx, s * dy, height, grasps) for s in places))


def pick_and_place_task(
    distance: float,
    height: float,
    *,
    headings: Sequence[float] = FRONT_AND_SIDES,
    approach: str = SIDE,
    pre_grasps: Sequence[float] = (),
    direction: int = 1,
    step: float = 0.05,
) -> GraspTask:
    """Return a place to pick at, the origin of F, and one to put down at.

    Args:
        distance: Between the two [m], snapped to the grid.
        height: Of both [m].
        headings: Of the grasps at each [rad].
        approach: "side" or "top".
        pre_grasps: How far back pre-grasps are [m].
        direction: The way from the first to the second, in quarter turns from F's x axis.
        step: Of the map's grid [m].

    Raises:
        TaskError: If the two would be at one place.
    """
    return linear_task(
        distance, 2, height, headings=headings, approach=approach, pre_grasps=pre_grasps,
        direction=direction, step=step, name="pick and place",
    )  # fmt: skip


def curved_task(
    radius: float,
    start: float,
    end: float,
    samples: int,
    height: float,
    *,
    pre_grasps: Sequence[float] = (),
    step: float = 0.05,
    name: str = "curved",
) -> GraspTask:
    """Return positions along the path of a door's handle, the hinge at the origin of F.

    Of the places on the grid those nearest to the arc are taken. At each, the gripper comes from
    those of four sides that keep it off the door: from the side that the door opens to, or from
    beyond its free edge.

    Args:
        radius: From the hinge to the handle [m].
        start: Direction from the hinge to the handle of the closed door [rad].
        end: The same of the open door; the door opens from start to end [rad].
        samples: How many positions.
        height: Of all of them [m].
        pre_grasps: How far back pre-grasps are [m].
        step: Of the map's grid [m].
        name: Of the task.

    Raises:
        TaskError: If the arc is empty, or the grid has too few places near it.

    Source:
        ITCM thesis, Appendix A.1 and Figures 14 and 15.
    """
    if not (step <= radius <= 5.0 and samples >= 1 and 0.0 < abs(end - start) <= 2.0 * math.pi):
        raise TaskError(
            f"task '{name}': an arc of radius {radius:g} m from {math.degrees(start):g} to "
            f"{math.degrees(end):g} deg with {samples} samples; must have a radius of one step, "
            f"{step:g} m, to 5 m, go 360 deg at most, and have a sample."
        )
    reach = math.ceil(radius / step) + 1
    line = np.arange(-reach, reach + 1)
    i, j = (axis.ravel() for axis in np.meshgrid(line, line, indexing="ij"))
    opening = math.copysign(1.0, end - start)
    turned = np.mod(opening * (np.arctan2(j, i) - start) + _SAME, 2.0 * math.pi) - _SAME
    off = np.abs(np.hypot(i, j) * step - radius)
    near = np.flatnonzero((turned <= abs(end - start) + _SAME) & (off <= step))
    if len(near) < samples:
        raise TaskError(
            f"task '{name}': the grid has {len(near)} places within a step of the arc, fewer than "
            f"{samples} samples. Take fewer samples or a finer grid."
        )
    # Of equally near places the one that is come to first counts.
    chosen = near[np.lexsort((turned[near], np.round(off[near], 9)))[:samples]]
    positions = []
    for place in chosen[np.argsort(turned[chosen], kind="stable")]:
        angle = start + opening * float(turned[place])
        grasps = tuple(
            Grasp(heading, SIDE, tuple(pre_grasps))
            for heading in ALL_SIDES
            if _off_the_door(heading, angle, opening)
        )
        x, y = float(i[place] * step), float(j[place] * step)
        positions.append(GraspPosition(x, y, height, grasps))
    return GraspTask(name, tuple(positions))


_SAME = 1e-9
"""Angles this close are one [rad]."""


def _off_the_door(heading: float, angle: float, opening: float) -> bool:
    """Return whether a gripper of some heading stays off a door that stands at an angle."""
    hand = heading + math.pi
    before_face = math.cos(hand - angle - opening * math.pi / 2.0)
    beyond_edge = math.cos(hand - angle)
    # Sides 90 deg apart: whatever the angle, one is within 45 deg of the face's normal. Nearer
    # than 22.5 deg to the plane of the door, the hand must be beyond its edge.
    flat = math.sin(math.pi / 8.0)
    return before_face > flat or (beyond_edge > flat and before_face > -flat)

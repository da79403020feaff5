"""Shapes of tasks of the ITCM thesis: lines, pick and place, and the arc of a door handle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tcs.capability.grid import SIDE
from tcs.capability.tasks import (
    ALL_SIDES,
    FARTHEST,
    FRONT_AND_SIDES,
    Grasp,
    GraspPosition,
    GraspTask,
)
from tcs.errors import TaskError, UnknownNameError
from tcs.files.quantities import ANGLE

TASK_SHAPES = ("pick-and-place", "linear", "curved")
_SAME = 1e-9
"""Angles closer than this are equal [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskShape:
    """Parameters of a task of a named shape.

    Attributes:
        shape: "pick-and-place", "linear" or "curved".
        height: Height of all positions above the floor [m].
        length: Distance from the first to the last position, or radius of the arc [m].
        samples: Number of positions on a line or an arc.
        headings: Headings of the grasps [rad]; ignored for the arc, whose headings follow from it.
        approach: "side" or "top"; the arc has side grasps only.
        pre_grasps: Distances of pre-grasps [m].
        direction_deg: Direction of the line from the x axis of F [deg], a multiple of 90.
        start: Direction from the hinge to the handle of the closed door [rad].
        end: Direction from the hinge to the handle of the open door [rad].
    """

    shape: str
    height: float
    length: float = 0.15
    samples: int = 3
    headings: tuple[float, ...] = FRONT_AND_SIDES
    approach: str = SIDE
    pre_grasps: tuple[float, ...] = ()
    direction_deg: int = 90
    start: float = 0.0
    end: float = math.pi / 2

    def task(self, step: float) -> GraspTask:
        """Return the task on a grid.

        Args:
            step: Step of the grid [m].

        Raises:
            UnknownNameError: If there is no such shape or approach.
            TaskError: If the parameters do not define a task.
        """
        if self.shape not in TASK_SHAPES:
            raise UnknownNameError("task", self.shape, TASK_SHAPES)
        if self.direction_deg % 90:
            raise TaskError(
                f"task '{self.shape}': direction {self.direction_deg} deg; must be a multiple of "
                "90."
            )
        # Also of what this shape does not use: a meaningless number is a mistake.
        ANGLE.check((self.start, self.end), f"task '{self.shape}': start or end", TaskError)
        if self.samples < 1:
            raise TaskError(f"task '{self.shape}': {self.samples} samples; must be at least 1.")
        if self.shape == "curved":
            return curved_task(
                self.length, self.start, self.end, self.samples, self.height,
                pre_grasps=self.pre_grasps, step=step,
            )  # fmt: skip
        samples = self.samples if self.shape == "linear" else 2
        return linear_task(
            self.length, samples, self.height, headings=self.headings, approach=self.approach,
            pre_grasps=self.pre_grasps, direction=self.direction_deg // 90, step=step,
            name="linear" if self.shape == "linear" else "pick and place",
        )  # fmt: skip


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

    Neighbours are a multiple of the step apart, so there may be more or fewer positions than
    `samples`: 3 samples on 0.15 m are 4 positions 0.05 m apart.

    Args:
        length: Distance from the first to the last position [m].
        samples: Requested number of positions.
        height: Height of all positions [m].
        headings: Headings of the grasps at each position [rad].
        approach: "side" or "top".
        pre_grasps: Distances of pre-grasps back along the approach [m].
        direction: Direction of the line from the x axis of F, in multiples of 90 deg.
        step: Step of the grid of the map [m].
        name: Name of the task.

    Raises:
        TaskError: If the line is shorter than a step or longer than `FARTHEST`, or there are fewer
            than two samples.

    Source:
        ITCM thesis, Appendix A.1 and Figure 16.
    """
    if not (step <= length <= FARTHEST and samples >= 2):
        raise TaskError(
            f"task '{name}': a line of {length:g} m with {samples} samples; the length must be "
            f"{step:g} m (one step) to {FARTHEST:g} m, with at least 2 samples."
        )
    steps = round(length / step)
    spacing = max(1, steps // (samples - 1))
    dx, dy = ((1, 0), (0, 1), (-1, 0), (0, -1))[direction % 4]
    grasps = tuple(Grasp(heading, approach, tuple(pre_grasps)) for heading in headings)
    distances = [k * spacing * step for k in range(steps // spacing + 1)]
    return GraspTask(name, tuple(GraspPosition(s * dx, s * dy, height, grasps) for s in distances))


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
    """Return a pick position, the origin of F, and a place position.

    Args:
        distance: Distance between the two [m], snapped to the grid.
        height: Height of both [m].
        headings: Headings of the grasps at each position [rad].
        approach: "side" or "top".
        pre_grasps: Distances of pre-grasps back along the approach [m].
        direction: Direction from the first to the second, from the x axis of F in multiples of 90
            deg.
        step: Step of the grid of the map [m].

    Raises:
        TaskError: If the two positions coincide.
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
    """Return positions along the path of a door handle, the hinge at the origin of F.

    The positions are the points of the grid nearest to the arc. At each position the grasps are
    those of the four headings that keep the gripper clear of the door: from the side to which the
    door opens, or from beyond its free edge.

    Args:
        radius: Distance from the hinge to the handle [m].
        start: Direction from the hinge to the handle of the closed door [rad].
        end: Direction from the hinge to the handle of the open door [rad].
        samples: Number of positions.
        height: Height of all positions [m].
        pre_grasps: Distances of pre-grasps back along the approach [m].
        step: Step of the grid of the map [m].
        name: Name of the task.

    Raises:
        TaskError: If the arc is empty, or the grid has too few points near it.

    Source:
        ITCM thesis, Appendix A.1 and Figures 14 and 15.
    """
    if not (step <= radius <= 5.0 and samples >= 1 and 0.0 < abs(end - start) <= 2.0 * math.pi):
        raise TaskError(
            f"task '{name}': an arc of radius {radius:g} m from {math.degrees(start):g} to "
            f"{math.degrees(end):g} deg with {samples} samples; the radius must be one step, "
            f"{step:g} m, to 5 m, the arc at most 360 deg, with at least one sample."
        )
    reach = math.ceil(radius / step) + 1
    line = np.arange(-reach, reach + 1)
    i, j = (axis.ravel() for axis in np.meshgrid(line, line, indexing="ij"))
    opening = math.copysign(1.0, end - start)
    swept = np.mod(opening * (np.arctan2(j, i) - start) + _SAME, 2.0 * math.pi) - _SAME
    distance = np.abs(np.hypot(i, j) * step - radius)
    near = np.flatnonzero((swept <= abs(end - start) + _SAME) & (distance <= step))
    if len(near) < samples:
        raise TaskError(
            f"task '{name}': the grid has {len(near)} points within a step of the arc, fewer than "
            f"{samples} samples. Use fewer samples or a finer grid."
        )
    # Of points at equal distance, take the first along the path.
    chosen = near[np.lexsort((swept[near], np.round(distance[near], 9)))[:samples]]
    positions = []
    for point in chosen[np.argsort(swept[chosen], kind="stable")]:
        angle = start + opening * float(swept[point])
        grasps = tuple(
            Grasp(heading, SIDE, tuple(pre_grasps))
            for heading in ALL_SIDES
            if _clear_of_door(heading, angle, opening)
        )
        x, y = float(i[point] * step), float(j[point] * step)
        positions.append(GraspPosition(x, y, height, grasps))
    return GraspTask(name, tuple(positions))


def _clear_of_door(heading: float, angle: float, opening: float) -> bool:
    """Return whether a gripper with a heading is clear of a door at an angle."""
    hand = heading + math.pi
    before_face = math.cos(hand - angle - opening * math.pi / 2.0)
    beyond_edge = math.cos(hand - angle)
    # The sides are 90 deg apart, so one is within 45 deg of the normal of the face. Within
    # 22.5 deg of the plane of the door, the hand must be beyond its edge.
    flat = math.sin(math.pi / 8.0)
    return before_face > flat or (beyond_edge > flat and before_face > -flat)

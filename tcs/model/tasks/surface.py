"""Goals all over a surface: a part of the body to wash, stroke or scan, a table to wipe."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tcs.errors import TaskError
from tcs.model.tasks.freedom import LEAST_AXIS, Freedom, Vector
from tcs.model.tasks.tool_line import DEFAULT_APPROACH, DEFAULT_RETREAT, ToolLine

PARTS: dict[str, tuple[str, ...]] = {
    "torso": ("chest", "mid_body", "lower_body"),
    "arm_left": ("upper_arm_left", "forearm_left"),
    "arm_right": ("upper_arm_right", "forearm_right"),
    "leg_left": ("thigh_left", "calf_left"),
    "leg_right": ("thigh_right", "calf_right"),
}
"""Names of several body frames together."""
CLOSEST, WIDEST = 0.005, 0.5
"""Least and greatest spacing [m]."""
FARTHEST = 0.3
"""Greatest distance of the goals from the surface [m]."""
FACING = math.radians(60.0)
"""Greatest angle between the outward normal and `Surface.facing` [rad]."""
NORMALS = ("inward", "outward")


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """A surface that is covered with goals; the environment decides where they are."""

    body: str
    """A body frame, or one of `PARTS`."""
    spacing: float
    """Distance of neighbouring goals [m]."""
    normal: str = "inward"
    """Where x of the tool points: "inward", toward the surface, or "outward"."""
    distance: float = 0.04
    """Distance of the goals from the padded surface [m]."""
    facing: Vector | None = None
    """Direction in each body frame; where the outward normal is more than `FACING` away from it,
    there are no goals. None for goals on all sides."""
    weight: float = 1.0
    """Weight of all its goals together, relative to those of the task."""
    free: Freedom | None = None
    """What is free about each goal."""
    arm: str = ""
    """Name of the arm that reaches the goals, as for a goal."""
    tool: str = ""
    """Name of the tool that they need, as for a goal."""
    approach: ToolLine = DEFAULT_APPROACH
    """Straight motion that ends at each goal."""
    retreat: ToolLine = DEFAULT_RETREAT
    """Straight motion that begins at each goal."""

    def __post_init__(self) -> None:
        """Check the values, and normalise the direction.

        Raises:
            TaskError: If a value is out of its range.
        """
        if not self.body:
            raise TaskError("field 'body' is empty. Name a body frame, e.g. 'chest', or 'torso'.")
        if not CLOSEST <= self.spacing <= WIDEST:
            raise TaskError(
                f"field 'spacing' is {self.spacing:g} m, but must be {CLOSEST:g} to {WIDEST:g} m."
            )
        if self.normal not in NORMALS:
            raise TaskError(
                f"field 'normal' is {self.normal!r}, but must be {' or '.join(NORMALS)}."
            )
        if not 0.0 <= self.distance <= FARTHEST:
            raise TaskError(
                f"field 'distance' is {self.distance:g} m, but must be 0 to {FARTHEST:g} m."
            )
        if self.facing is not None:
            length = math.hypot(*self.facing)
            if not math.isfinite(length) or length < LEAST_AXIS:
                raise TaskError(
                    f"field 'facing' is {list(self.facing)}, but must be [x, y, z] with a length."
                )
            x, y, z = (float(a) / length for a in self.facing)
            object.__setattr__(self, "facing", (x, y, z))
        if not 0.0 < self.weight <= 1000.0:
            raise TaskError(f"field 'weight' is {self.weight:g}, but must be above 0, up to 1000.")

    @property
    def frames(self) -> tuple[str, ...]:
        """The body frames that it covers."""
        return PARTS.get(self.body, (self.body,))

"""Physical ranges: what a length, angle or count in a file or an option can be.

A file may hold any number, and a geometry engine accepts most of them: with a box of 1e15 m,
distances round to nothing and a collision is missed. Every reader therefore checks its numbers
against the ranges in this module, which is the only place that holds them; `docs/files.md` lists
them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import SupportsFloat

from tcs.errors import TcsError


@dataclass(frozen=True, slots=True)
class Quantity:
    """A physical quantity and the values it can have.

    >>> SIZE.fault(1e15)
    '1e+15 m, but a size must be 1e-06 to 100 m'
    >>> SIZE.fault(0.8) is None
    True
    """

    name: str
    """Name in messages, e.g. "size"."""
    unit: str
    """Unit, "" for a pure number."""
    low: float
    """Least value [unit]."""
    high: float
    """Greatest value [unit]."""
    covers: str
    """Where it occurs, for the documentation."""
    reason: str
    """Why the range ends there, for the documentation."""

    def admits(self, value: object) -> bool:
        """Return whether a value is a number in the range; NaN and booleans are not."""
        if type(value) is float:  # Files hold tens of thousands; the protocol is slow to ask.
            return self.low <= value <= self.high
        if isinstance(value, bool) or not isinstance(value, SupportsFloat):
            return False
        try:
            return self.low <= float(value) <= self.high
        except OverflowError:
            # An integer beyond every float.
            return False

    def fault(self, value: object) -> str | None:
        """Return what is wrong with a value as a predicate, None if nothing is."""
        if self.admits(value):
            return None
        shown = f"{value:.6g}" if isinstance(value, float) else str(value)[:40]
        unit = f" {self.unit}" if self.unit else ""
        article = "an" if self.name[0] in "aeiou" else "a"
        return f"{shown}{unit}, but {article} {self.name} must be {self.span}"

    def check(self, values: float | Iterable[float], where: str, error: type[TcsError]) -> None:
        """Raise `error`, a message that starts with `where`, if a value is out of the range."""
        for value in values if isinstance(values, Iterable) else (values,):
            fault = self.fault(value)
            if fault is not None:
                raise error(f"{where} is {fault}.")

    @property
    def span(self) -> str:
        """The range in words, e.g. "0 to 1 m"."""
        unit = f" {self.unit}" if self.unit else ""
        return f"{_number(self.low)} to {_number(self.high)}{unit}"


def _number(value: float) -> str:
    return f"{int(value):,}" if value == int(value) else f"{value:g}"


POSITION = Quantity(
    *("position", "m", -40.0, 40.0),
    "coordinates of bodies, obstacles, frames, base positions; positions of prismatic joints",
    "the floor is a square of 100 m about the origin, and a base with its arm must stay above it",
)
SIZE = Quantity(
    *("size", "m", 1e-6, 100.0),
    "sizes, radii and lengths of boxes, capsules, spheres and meshes",
    "from a micrometre, the last decimal of the files of primitives, to the width of the floor",
)
CLEARANCE = Quantity(
    *("clearance", "m", 0.0, 1.0),
    "`contact_margin`, `self_margin`, `padding`",
    "a metre of padding is farther than most arms reach",
)
DEVIATION = Quantity(
    *("deviation", "m", 0.0, 10.0),
    "`std`, `half_width` of the error of a prismatic joint",
    "a person who may be anywhere in a large room",
)
DEVIATION_DEG = Quantity(
    *("deviation", "deg", 0.0, 360.0),
    "`std_deg`, `half_width_deg` of the error of a revolute joint",
    "a full turn, after which a heading repeats",
)
ANGLE_DEG = Quantity(
    *("angle", "deg", -720.0, 720.0),
    "`rpy_deg`, knots, angular axes of a grid, headings",
    "two turns to either side",
)
ANGLE = Quantity(
    *("angle", "rad", -4.0 * math.pi, 4.0 * math.pi),
    "`rpy` of a URDF or an SDFormat file",
    "two turns to either side",
)
JOINT_POSITION = Quantity(
    *("joint position", "m or rad", -40.0, 40.0),
    "`joints`, `posture`, `rest`, `postures`, `grippers`",
    "a prismatic joint stays on the floor; a revolute one makes six turns",
)
JOINT_LIMIT = Quantity(
    *("joint limit", "m or rad", -1000.0, 1000.0),
    "limits of the joints of a URDF, multiplier and offset of mimic joints, recorded angles",
    "160 turns: a joint that turns on is `continuous`",
)
FIELD_OF_VIEW_DEG = Quantity(
    *("field of view", "deg", 0.1, 360.0),
    "`horizontal_fov_deg`, `vertical_fov_deg`",
    "a camera sees at most everything around it",
)
WEIGHT = Quantity(
    *("weight", "", 1e-6, 1e6),
    "`weight` of a goal",
    "relative to the other goals: beyond it the smaller weight is rounded away",
)
UTILITY_WEIGHT = Quantity(
    *("utility weight", "", 0.0, 1e9),
    "weights of the utility of a set and of the travel cost",
    "with a greater weight, rounding of its term would exceed every other term",
)
HEADING = Quantity(
    *("heading", "rad", -1000.0, 1000.0),
    "current heading of the base, current angles of the environment's axes",
    "160 turns: odometry counts full turns",
)
EXTENT = Quantity(
    *("extent", "m", 0.0, 100.0),
    "sizes, radii and lengths of the boxes, cylinders and spheres of a URDF; 0 marks a frame",
    "up to the width of the floor",
)
STEP = Quantity(
    *("step", "m or deg", 1e-6, 720.0),
    "`step` of an axis with more than one value",
    "a micrometre is below any positioning",
)
AXIS_VALUES = Quantity(
    *("number of values", "", 1, 100_000_000),
    "`count` of an axis",
    "as many configurations as a whole grid may have",
)
MAP_STEP = Quantity(
    *("step of a map", "m", 0.001, 1.0),
    "`--step` of capability maps, of positions and of torso heights",
    "from a millimetre, below any positioning, to about the length of an arm",
)
RADIUS = Quantity(
    *("radius", "m", 0.001, 20.0),
    "`--radius` of capability maps",
    "ten times the reach of the longest arm that ships",
)
VOLUME = Quantity(
    *("number of cells", "", 0, 200_000_000),
    "box around the cells of a tilt of a capability map, base poses of a task map",
    "1.6 GB of memory",
)
MASTER_SCALE = Quantity(
    *("scale", "", 0.01, 100.0),
    "`--scale` of a simulated recording",
    "a master of 16 cm then moves the tool by 2 mm to 16 m",
)
RECORDING = Quantity(
    *("length of a recording", "s", 0.02, 86_400.0),
    "`--seconds` of a simulated recording",
    "from one sample at 50 Hz to a day, which fits into memory",
)
DURATION = Quantity(
    *("duration", "s", 0.0, 604_800.0),
    "`--duration` of viewers and live pages",
    "a week; without the option they run until Ctrl-C",
)
LATENCY = Quantity(
    *("latency", "s", 0.0, 10.0),
    "`--latency` of teleoperation",
    "twenty times the way over a geostationary satellite and back",
)
JOBS = Quantity(
    *("number of jobs", "", 1, 1024), "`--jobs`", "more threads than any machine in use has cores"
)
QUERIES = Quantity(
    *("number of samples", "", 0, 10_000_000),
    "`--pairs`, `--dense`, `--queries`, `--samples` of checks",
    "more take hours and change no digit that is shown",
)
MESH_SCALE = Quantity(
    *("mesh scale", "", -1e4, 1e4),
    "`scale` of a mesh of a URDF or an SDFormat file",
    "mesh units from tenths of a millimetre to kilometres; negative ones mirror the mesh",
)
GOALS = Quantity(
    *("number of goals", "", 1, 1000), "goals of a task", "the tasks of the papers have 2 to 14"
)
ENTRIES = Quantity(
    *("number of entries", "", 0, 1000),
    "models, obstacles, joints, frames and pairs of one file",
    "a hundred times as many as the largest environment that ships",
)
PRIMITIVES = Quantity(
    *("number of primitives", "", 0, 10_000),
    "rows of a CSV file of primitives",
    "a hundred times as many as the robots that ship",
)

QUANTITIES = (
    POSITION, SIZE, CLEARANCE, DEVIATION, DEVIATION_DEG, ANGLE_DEG, ANGLE, JOINT_POSITION,
    JOINT_LIMIT, FIELD_OF_VIEW_DEG, STEP, MAP_STEP, RADIUS, EXTENT, MESH_SCALE, WEIGHT,
    UTILITY_WEIGHT, HEADING, MASTER_SCALE, RECORDING, DURATION, LATENCY, JOBS, QUERIES,
    AXIS_VALUES, VOLUME, GOALS, ENTRIES, PRIMITIVES,
)  # fmt: skip
"""All quantities, in the order of the documentation."""

UNIT_TOLERANCE = 1.1e-3
"""Tolerance of the length of a quaternion: three printed digits change it by up to 0.001."""

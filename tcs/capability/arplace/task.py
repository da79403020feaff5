"""The task: grasps of an object on a table, and the base positions that are tried."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from tcs.capability.grid import SIDE, TOP
from tcs.errors import GridError, TcsError, UnknownNameError
from tcs.files.quantities import ANGLE_DEG, CLEARANCE, POSITION, SIZE
from tcs.kernel.arrays import FloatArray
from tcs.model.grid import Axis

PARAMETERS = ("distance", "height", "angle")
"""Task parameters, in the order of the columns of every array of them."""
APPROACHES = (TOP, SIDE)
DISTANCES = Axis("distance", "m", 0.0, 0.05, 10)
HEIGHTS = Axis("height", "m", 0.415, 0.1, 4)
ANGLES = Axis("angle", "deg", 0.0, 0.0, 1)
BASE_X = Axis("base_x", "m", -1.2, 0.05, 25)
BASE_Y = Axis("base_y", "m", -1.2, 0.05, 49)
_UNITS = {"distance": "m", "height": "m", "angle": "deg", "base_x": "m", "base_y": "m"}
MAX_LABELS = 5_000_000
"""Greatest number of labels: more would take hours."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TableTask:
    """Grasps on a table whose parameters vary, and a grid of base positions before the table.

    F is the frame of the table: on the floor below its front edge, x into the table, y along the
    edge to the left, z up. The object stands at (distance, 0, height). The table extends along y
    beyond all base positions, so an object elsewhere along the edge shifts the base positions.

    Source:
        ITCM thesis, Appendix D. Printed there: the distances 0 to 0.45 m, 0.05 m apart; the grasp
        from above; one heading of the base; in section III.B the height of the table, 0.37 m, and
        of the middle of the cup, 0.415 m. The other defaults are ours.
    """

    distance: Axis = DISTANCES
    """Distances of the tool from the table's edge [m]."""
    height: Axis = HEIGHTS
    """Heights of the tool above the floor [m]."""
    angle: Axis = ANGLES
    """Grasp angles: headings of the tool about the vertical [deg]."""
    approach: str = TOP
    """ "top" or "side"."""
    base_x: Axis = BASE_X
    """Base positions along x of F [m]."""
    base_y: Axis = BASE_Y
    """Base positions along y, relative to the object [m]."""
    base_yaw_deg: float = 0.0
    """Heading of the base in F [deg]; 0 faces the table."""
    torso_height: float | None = None
    """Torso height [m]; None is the middle of the torso's range."""
    below_tool: float = 0.045
    """Distance from the tool down to the top of the table [m]; the table moves with the height."""
    thickness: float | None = None
    """Thickness of the table top [m]; None is a table that is solid down to the floor."""
    depth: float = 1.2
    """Depth of the table along x [m]."""

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            GridError: If an axis has another name or unit, fewer than 3 base positions lie along an
                axis, or there are more than `MAX_LABELS` labels.
            UnknownNameError: If there is no such approach.
        """
        for name, unit in _UNITS.items():
            axis = getattr(self, name)
            if (axis.name, axis.unit) != (name, unit):
                raise GridError(
                    f"axis '{axis.name}' in {axis.unit} in place of '{name}' in {unit}. Replace it."
                )
        for axis in (self.base_x, self.base_y):
            if axis.count < 3:
                raise GridError(f"axis '{axis.name}' has {axis.count} values; needs 3 or more.")
        if self.approach not in APPROACHES:
            raise UnknownNameError("approach", str(self.approach), APPROACHES)
        count = len(self) * self.base_x.count * self.base_y.count
        if count > MAX_LABELS:
            raise GridError(
                f"{count:,} labels ({len(self):,} grasps, {self.base_x.count} x "
                f"{self.base_y.count} base positions); at most {MAX_LABELS:,}. Use fewer values."
            )
        ANGLE_DEG.check(self.base_yaw_deg, "the heading of the base", GridError)
        CLEARANCE.check(self.below_tool, "the distance from tool to table", GridError)
        SIZE.check(self.depth, "the depth of the table", GridError)
        if self.thickness is not None:
            SIZE.check(self.thickness, "the thickness of the table", GridError)
        if self.torso_height is not None:
            POSITION.check(self.torso_height, "the torso height", GridError)
        if float(self.height.values[0]) - self.below_tool <= 0.0:
            raise GridError(
                f"the tool at {self.height.values[0]:g} m is {self.below_tool:g} m above a table "
                "that would be below the floor. Raise the heights."
            )

    def __len__(self) -> int:
        """Return the number of grasps."""
        return self.distance.count * self.height.count * self.angle.count

    @property
    def counts(self) -> tuple[int, int, int]:
        """Number of values of each of `PARAMETERS`."""
        return self.distance.count, self.height.count, self.angle.count

    @property
    def parameters(self) -> FloatArray:
        """Distance [m], height [m] and angle [rad] of each grasp, shape (grasps, 3).

        The angle changes fastest, then the height.
        """
        axes = (getattr(self, name).values for name in PARAMETERS)
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest value of each of `PARAMETERS` [m, m, rad], shape (3,) each."""
        values = [getattr(self, name).values for name in PARAMETERS]
        return np.array([v[0] for v in values]), np.array([v[-1] for v in values])

    @property
    def middle(self) -> FloatArray:
        """The middle of `limits` [m, m, rad], shape (3,)."""
        low, high = self.limits
        return np.asarray(0.5 * (low + high))

    def to_dict(self) -> dict[str, Any]:
        """Return the task as plain containers."""
        return asdict(self)

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Self:
        """Return the task that `to_dict` returned.

        Raises:
            TcsError: If a value is missing, of another type or invalid.
        """
        fields = cls.__dataclass_fields__
        if set(plain) != set(fields):
            raise TcsError("lacks a valid task")
        values = dict(plain)
        for name in _UNITS:
            if not isinstance(values[name], dict):
                raise TcsError(f"lacks a valid axis '{name}'")
            values[name] = Axis.from_dict(values[name])
        for name in ("base_yaw_deg", "below_tool", "depth"):
            if type(values[name]) is not float:
                raise TcsError(f"lacks a valid '{name}'")
        for name in ("torso_height", "thickness"):
            if values[name] is not None and type(values[name]) is not float:
                raise TcsError(f"lacks a valid '{name}'")
        return cls(**values)

"""Conditions on an axis of a grid, written as text: `head_rest >= 35 deg`."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import GridError, UnknownNameError, one_line
from tcs.model.grid.axis import Axis
from tcs.model.grid.grid import Grid

BoolArray = NDArray[np.bool_]

UNITS = {"m": ("m", 1.0), "cm": ("m", 0.01), "mm": ("m", 0.001), "deg": ("deg", 1.0)}
"""Units of a value: that of an axis in the same quantity, and the factor to it."""

TOLERANCE = 1e-9
"""Tolerance of comparisons [m or deg]: 3 steps of 0.1 m exceed 0.3 m by 6e-17 m."""

LISTED_VALUES = 8
"""Most values of an axis that a message lists."""

_NUMBER = r"[-+]?(?:\d+(?:\.(?!\.)\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_UNIT = r"[A-Za-z]*"
_CONDITION = re.compile(
    rf"\s*(?P<axis>[A-Za-z][\w -]*?)\s*(?P<comparison><=|>=|==|=|<|>)\s*"
    rf"(?P<low>{_NUMBER})\s*(?P<low_unit>{_UNIT})\s*"
    rf"(?:\.\.\s*(?P<high>{_NUMBER})\s*(?P<high_unit>{_UNIT})\s*)?"
)


@dataclass(frozen=True, slots=True)
class AxisCondition:
    """A comparison of the value of one axis with a number, or with both ends of a range.

    >>> grid = Grid.from_spec({
    ...     "head_rest": {"unit": "deg", "start": 0, "step": 35, "count": 3},
    ...     "base_x": {"unit": "m", "start": 0, "step": 0.1, "count": 5},
    ...     "base_y": {"unit": "m", "start": 0, "step": 0.1, "count": 1},
    ...     "base_yaw": {"unit": "deg", "start": 0, "step": 90, "count": 4},
    ...     "torso": {"unit": "m", "start": 0, "step": 0.15, "count": 3},
    ... })
    >>> AxisCondition.parse("headrest >= 35 deg").admitted(grid).tolist()
    [False, True, True]
    >>> AxisCondition.parse("base_x = 5..20 cm").admitted(grid).tolist()
    [False, True, True, False, False]
    """

    text: str
    """The condition as written, on one line."""
    name: str
    """The axis as written; case, spaces, hyphens and underscores do not matter."""
    comparison: str
    """One of <=, >=, <, >, =."""
    low: float
    """The number, or the lower end of the range [unit]."""
    high: float | None
    """The upper end of the range [unit]; None without a range."""
    unit: str | None
    """Unit as written, a key of `UNITS`; None if none is written."""

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the condition of a text such as "bed_height <= 20 cm" or "torso = 0..0.15 m".

        Raises:
            GridError: If the text is not of that form.
        """
        found = _CONDITION.fullmatch(text)
        shown = one_line(text)
        if found is None:
            raise GridError(
                f"Condition '{shown}' is not of the form AXIS COMPARISON VALUE [UNIT], e.g. "
                "head_rest >= 35 deg, bed_height = 20 cm or base_x = -1..0.5 m."
            )
        comparison = found["comparison"].replace("==", "=")
        low = float(found["low"])
        high = None if found["high"] is None else float(found["high"])
        if high is not None and comparison != "=":
            raise GridError(f"Condition '{shown}': a range follows '=', as in base_x = -1..0.5 m.")
        if not all(math.isfinite(value) for value in (low, high or 0.0)):
            raise GridError(f"Condition '{shown}': the value must be a finite number.")
        units = {found["low_unit"], found["high_unit"] or ""} - {""}
        if len(units) > 1:
            raise GridError(f"Condition '{shown}' has two units. Write one, after the range.")
        unit = units.pop() if units else None
        if unit is not None and unit not in UNITS:
            raise UnknownNameError("unit", unit, UNITS, where=f"condition '{shown}'")
        return cls(shown, found["axis"], comparison, low, high, unit)

    def axis_of(self, grid: Grid) -> Axis:
        """Return the axis of a grid that the condition is about.

        Raises:
            UnknownNameError: If the grid has no such axis.
        """
        return axis_named(grid, self.name, where=f"condition '{self.text}'")

    def admitted(self, grid: Grid) -> BoolArray:
        """Return which values of its axis satisfy the condition, shape (count,).

        Headings are compared modulo a full rotation, except by inequalities, which compare them as
        the grid has them (0 to 360 deg).

        Raises:
            UnknownNameError: If the grid has no such axis.
            GridError: If the unit is not that of the axis, the range is reversed, or no value
                satisfies the condition.
        """
        axis = self.axis_of(grid)
        admitted = self._satisfied(axis, axis.start + np.arange(axis.count) * axis.step)
        if not np.any(admitted):
            raise GridError(
                f"Condition '{self.text}' leaves nothing: the grid has {axis.name} "
                f"{values_text(axis)}."
            )
        return admitted

    def satisfied(self, axis: Axis, values: NDArray[np.float64]) -> BoolArray:
        """Return which values of an axis satisfy the condition, on the grid or not, shape (n,).

        Args:
            axis: The axis of the condition.
            values: Values [m or rad], shape (n,).

        Raises:
            GridError: If the unit is not that of the axis, or the range is reversed.
        """
        return self._satisfied(axis, np.rad2deg(values) if axis.unit == "deg" else values)

    def _satisfied(self, axis: Axis, values: NDArray[np.floating[Any]]) -> BoolArray:
        """Return which values, in the unit of their axis, satisfy the condition."""
        low, high = self._in_unit_of(axis)
        if axis.name == "base_yaw" and self.comparison == "=":
            span = 0.0 if self.high is None else high - low
            # A full rotation or more covers every heading.
            beyond = np.mod(values - low + TOLERANCE, 360.0)
            admitted = beyond <= min(span, 360.0) + 2.0 * TOLERANCE
        elif self.comparison == "=":
            admitted = (values >= low - TOLERANCE) & (values <= high + TOLERANCE)
        elif self.comparison in ("<=", "<"):
            admitted = values <= low + (TOLERANCE if self.comparison == "<=" else -TOLERANCE)
        else:
            admitted = values >= low + (-TOLERANCE if self.comparison == ">=" else TOLERANCE)
        return np.asarray(admitted)

    def _in_unit_of(self, axis: Axis) -> tuple[float, float]:
        """Return the number, or the ends of the range, in the unit of an axis."""
        if self.unit is None and axis.unit == "deg" and not self.name.lower().endswith("deg"):
            raise GridError(
                f"Condition '{self.text}' lacks a unit: {axis.name} is an angle. "
                f"Write {self.low:g} deg."
            )
        quantity, factor = UNITS[self.unit or axis.unit]
        if quantity != axis.unit:
            raise GridError(
                f"Condition '{self.text}': {axis.name} is in {axis.unit}, not in {self.unit}."
            )
        low = self.low * factor
        high = low if self.high is None else self.high * factor
        if high < low:
            raise GridError(
                f"Condition '{self.text}': the range is reversed. Write the lower end first."
            )
        return low, high


def restricted(grid: Grid, conditions: Iterable[str]) -> Grid:
    """Return a grid with only the values of its axes that satisfy all conditions.

    Args:
        grid: The grid.
        conditions: Texts of conditions, see `AxisCondition.parse`.

    Raises:
        UnknownNameError: If the grid has no such axis.
        GridError: If a condition is invalid, no value of an axis satisfies its conditions, or those
            that do are not consecutive (headings on both sides of 0).
    """
    parsed = [AxisCondition.parse(text) for text in conditions]
    axes = []
    for axis in grid.axes:
        of_axis = [condition for condition in parsed if condition.axis_of(grid) is axis]
        # An axis without a condition keeps all its values.
        admitted = [condition.admitted(grid) for condition in of_axis]
        kept = np.flatnonzero(np.all([np.ones(axis.count, dtype=np.bool_), *admitted], axis=0))
        written = " and ".join(f"'{condition.text}'" for condition in of_axis)
        if not kept.size:
            raise GridError(
                f"Conditions {written} leave nothing: the grid has {axis.name} {values_text(axis)}."
            )
        if kept[-1] - kept[0] + 1 > kept.size:
            raise GridError(
                f"{written}: the values that remain of {axis.name} are not consecutive. Score them "
                "as two grids."
            )
        if of_axis:
            # Without the rounding error of the step, e.g. 0.3 for 3 x 0.1.
            start = round(axis.start + int(kept[0]) * axis.step, 12)
            axis = replace(axis, start=start, count=kept.size)
        axes.append(axis)
    return Grid(tuple(axes))


def axis_named(grid: Grid, name: str, *, where: str) -> Axis:
    """Return the axis of a name in which case, spaces, hyphens and underscores do not matter.

    Args:
        grid: The grid.
        name: The name, e.g. "headrest" for "head_rest"; an angle's may end in "_deg".
        where: Location of the name, for the message.

    Raises:
        UnknownNameError: If the grid has no such axis.
    """
    by_name = {}
    for axis in grid.axes:
        by_name[_plain(axis.name)] = axis
        if axis.unit == "deg":
            by_name[_plain(f"{axis.name}_deg")] = axis
    found = by_name.get(_plain(name))
    if found is None:
        raise UnknownNameError("axis", name, (axis.name for axis in grid.axes), where=where)
    return found


def values_text(axis: Axis) -> str:
    """Return the values of an axis in words, e.g. "0, 35, 70 deg"."""
    values = axis.start + np.arange(axis.count) * axis.step
    if axis.count <= LISTED_VALUES:
        return f"{', '.join(f'{value:g}' for value in values)} {axis.unit}"
    return f"{values[0]:g} to {values[-1]:g} {axis.unit} in steps of {axis.step:g}"


def _plain(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())

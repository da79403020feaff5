"""One axis of a grid: equally spaced values of a degree of freedom."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import GridError, UnknownNameError
from tcs.files.quantities import ANGLE_DEG, AXIS_VALUES, POSITION, STEP

UNITS = ("m", "deg")
"""Units in which an axis may be written."""
_KEPT_AXES = 256
"""Most axes whose values are kept."""
_KEPT_VALUES = 4096
"""Most values of an axis that are kept; together with `_KEPT_AXES` they take 8 MB at most."""


@dataclass(frozen=True, slots=True)
class Axis:
    """Equally spaced values of one degree of freedom, identified by integer index.

    Values are never looked up as floats, because 3 * 0.1 is not equal to 0.3.
    """

    name: str
    """The degree of freedom, e.g. "base_x"."""
    unit: str
    """Unit of `start` and `step`: "m" or "deg"."""
    start: float
    """First value [unit]."""
    step: float
    """Distance between neighbours [unit]; positive, or 0 for a single value."""
    count: int
    """Number of values."""

    def __post_init__(self) -> None:
        """Check the fields.

        Raises:
            GridError: If the unit is unknown, a number is not finite or out of its physical range,
                the step is not positive, or the count is less than 1.
        """
        where = f"axis '{self.name}'"
        if self.unit not in UNITS:
            raise GridError(f"{where}: unit is {self.unit!r}, but must be one of {_listed(UNITS)}.")
        for key in ("start", "step"):
            number = getattr(self, key)
            if not _is_finite(number):
                raise GridError(f"{where}: {key} is {number!r}, but must be a finite number.")
        if not isinstance(self.count, int) or isinstance(self.count, bool):
            raise GridError(f"{where}: count is {self.count!r}, but must be a whole number.")
        if self.count < 1:
            raise GridError(
                f"{where}: count is {self.count}, so the grid would be empty. It must be 1 or more."
            )
        if self.step < 0 or (self.step == 0 and self.count > 1):
            raise GridError(
                f"{where}: step is {self.step:g} {self.unit}, but must be positive "
                "(0 only where count is 1)."
            )
        AXIS_VALUES.check(self.count, f"{where}: count", GridError)
        quantity = POSITION if self.unit == "m" else ANGLE_DEG
        quantity.check(float(self.start), f"{where}: start", GridError)
        if self.count > 1:
            STEP.check(float(self.step), f"{where}: step", GridError)
            last = float(self.start) + (self.count - 1) * float(self.step)
            quantity.check(last, f"{where}: the last value", GridError)
        object.__setattr__(self, "start", float(self.start))
        object.__setattr__(self, "step", float(self.step))

    @property
    def values(self) -> NDArray[np.float64]:
        """Every value, start + i * step [m or rad], shape (count,).

        >>> Axis("base_yaw", "deg", 0.0, 90.0, 3).values.round(4).tolist()
        [0.0, 1.5708, 3.1416]
        """
        # Compiled functions distinguish arrays that can be written: those kept are copied.
        return _kept_values(self).copy() if self.count <= _KEPT_VALUES else _values_of(self)

    def value(self, index: int) -> float:
        """Return the value of an index, as `values[index]` [m or rad].

        >>> Axis("torso", "m", 0.0, 0.15, 3).value(2)
        0.3
        """
        values = _kept_values(self) if self.count <= _KEPT_VALUES else _values_of(self)
        return float(values[index])

    @property
    def held_unit(self) -> str:
        """Unit of `values`: "m" or "rad"."""
        return "rad" if self.unit == "deg" else "m"

    def overridden(self, changes: Mapping[str, object], *, where: str = "") -> Self:
        """Return this axis with some of unit, start, step and count replaced.

        Args:
            changes: New values by key.
            where: The source of the changes, for the message.

        Raises:
            UnknownNameError: If an axis has no such key.
            GridError: If the result is invalid, or has another unit than this axis.
        """
        changed = self.from_dict(
            {**self.to_dict(), **_only_keys(changes, _SPEC_KEYS, self.name, where)}, where=where
        )
        if changed.unit != self.unit:
            raise GridError(
                f"{_prefix(where)}axis '{self.name}': unit is '{changed.unit}', "
                f"but this axis is written in '{self.unit}'."
            )
        return changed

    def to_dict(self) -> dict[str, object]:
        """Return the axis as plain numbers and strings."""
        return asdict(self)

    @classmethod
    def from_dict(cls, plain: Mapping[str, object], *, where: str = "") -> Self:
        """Return the axis given as a mapping, e.g. by `to_dict` or a file.

        Args:
            plain: Name, unit, start, step and count.
            where: The source of the mapping, for the message.

        Raises:
            UnknownNameError: If an axis has no such key.
            GridError: If a key is missing or a value is invalid.
        """
        name = plain.get("name")
        if not isinstance(name, str) or not name:
            raise GridError(f"{_prefix(where)}an axis has the name {name!r}, but must have a text.")
        known = _only_keys(plain, _KEYS, name, where)
        missing = [key for key in _KEYS if key not in known]
        if missing:
            raise GridError(
                f"{_prefix(where)}axis '{name}' needs {_listed(missing)}. "
                f"An axis has {_listed(_SPEC_KEYS)}."
            )
        try:
            return cls(**known)  # type: ignore[arg-type]  # __post_init__ checks each value
        except GridError as error:
            raise GridError(f"{_prefix(where)}{error}") from None


def _values_of(axis: Axis) -> NDArray[np.float64]:
    """Return every value of an axis [m or rad], shape (count,)."""
    # Converted to radians last, so that the multiples of a step are exact in degrees.
    values: NDArray[np.float64] = axis.start + np.arange(axis.count, dtype=np.float64) * axis.step
    return np.deg2rad(values) if axis.unit == "deg" else values


@lru_cache(maxsize=_KEPT_AXES)
def _kept_values(axis: Axis) -> NDArray[np.float64]:
    """Return the values of an axis, computed once; read-only."""
    values = _values_of(axis)
    values.flags.writeable = False
    return values


_KEYS = tuple(field.name for field in fields(Axis))
_SPEC_KEYS = _KEYS[1:]


def _is_finite(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating):
        return False
    # An integer may be larger than every float.
    return bool(-sys.float_info.max <= value <= sys.float_info.max)


def _only_keys(
    plain: Mapping[str, object], known: tuple[str, ...], name: str, where: str
) -> dict[str, object]:
    """Return `plain` as a dict; raise for unknown keys."""
    for key in plain:
        if key not in known:
            raise UnknownNameError("key", str(key), known, where=f"{_prefix(where)}axis '{name}'")
    return dict(plain)


def _prefix(where: str) -> str:
    return f"{where}: " if where else ""


def _listed(names: tuple[str, ...] | list[str]) -> str:
    return ", ".join(names)

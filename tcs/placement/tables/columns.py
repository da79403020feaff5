"""Columns of tables: the arrays that each holds, what they must be, and how they are stored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import Enum, auto
from typing import Any, ClassVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tcs.errors import TcsError


class Form(Enum):
    """How the numbers of a column are stored, each array compressed by itself."""

    PLAIN = auto()
    SMALLEST = auto()
    """Whole numbers >= 0 in the smallest type that can represent them."""
    PLUS_ONE = auto()
    """Likewise, of numbers >= -1, under its name and `_plus_one`."""
    STEPS = auto()
    """Likewise, the differences of ascending numbers."""
    FLAGS = auto()
    """Yes or no in a byte each."""
    APART = auto()
    """Not as a column: by the code of its table, or not at all."""


@dataclass(frozen=True, slots=True)
class Column:
    """What an array of a table must be."""

    dtype: DTypeLike | tuple[DTypeLike, ...]
    """Element type, or several that it may be."""
    shape: str
    """Length of each axis, separated by blanks: a number, or a name for what is the same length in
    all columns of a table."""
    form: Form = Form.PLAIN
    key: str = ""
    """Name in files, if that is not the name of the column."""
    finite: bool = False
    """Whether all numbers are finite."""
    least: float = -np.inf
    """Least of the numbers, which are finite then."""
    optional: bool = False
    """Whether it may be None."""

    def lengths(self, known: Mapping[str, Any]) -> tuple[Any, ...]:
        """Return the length of each axis, None where it may be any."""
        return tuple(int(n) if n.isdigit() else known.get(n) for n in self.shape.split())

    def named(self, shape: tuple[int, ...]) -> dict[str, int]:
        """Return the lengths of an array of this shape by name."""
        return {n: m for n, m in zip(self.shape.split(), shape, strict=True) if not n.isdigit()}


Columns = Mapping[str, Column]
"""Arrays of a table by name; the first with a length is the one that others are compared with."""


class ArrayTable:
    """Base of the tables: frozen dataclasses whose arrays are read-only, copies included."""

    WHAT: ClassVar[str]
    """Name of the table in an error message, e.g. "score table"."""
    COLUMNS: ClassVar[Columns]

    def _check_arrays(self) -> None:
        """Check the columns and replace them by read-only views.

        Raises:
            TcsError: If one is not an array of its type, shape and range.
        """
        known: dict[str, int] = {}
        for name, column in self.COLUMNS.items():
            array = getattr(self, name)
            if array is None and column.optional:
                continue
            what = f"{self.WHAT}: {name}"
            view = read_only(what, array, column.dtype, column.lengths(known))
            known |= column.named(view.shape)
            if column.finite or column.least > -np.inf:
                low = f" and >= {column.least:g}" if column.least > -np.inf else ""
                inside = bool(np.all(np.isfinite(view) & (view >= column.least)))
                require(inside, f"{what} must be finite{low}.")
            object.__setattr__(self, name, view)

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields alone, without cached properties."""
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the fields; numpy unpickles arrays as writeable."""
        for name, value in state.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)


def read_only(
    what: str,
    array: NDArray[Any],
    dtype: DTypeLike | tuple[DTypeLike, ...],
    shape: tuple[int | None, ...],
) -> NDArray[Any]:
    """Return the array as a C-contiguous, read-only view.

    Args:
        what: Name for the error message, e.g. "score table: dexterity".
        array: Array to check; copied only if it is not contiguous.
        dtype: Required element types, one of several; a silent cast would hide a wrong array.
        shape: Required shape, None where any length is allowed.

    Raises:
        TcsError: If it is not an array of that type and shape.
    """
    if not isinstance(array, np.ndarray):
        raise TcsError(f"{what} is {type(array).__name__}; must be a numpy array.")
    wanted = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
    allowed = [np.dtype(one) for one in (dtype if isinstance(dtype, tuple) else (dtype,))]
    if array.dtype not in allowed:
        wanted_types = " or ".join(map(str, allowed))
        raise TcsError(f"{what} has type {array.dtype}; must be {wanted_types}.")
    if array.ndim != len(shape) or any(
        n is not None and n != m for n, m in zip(shape, array.shape, strict=True)
    ):
        raise TcsError(f"{what} has shape {array.shape}; must be {wanted}.")
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def require(condition: bool | np.bool_, message: str) -> None:
    """Raise `TcsError(message)` unless the condition holds."""
    if not condition:
        raise TcsError(message)

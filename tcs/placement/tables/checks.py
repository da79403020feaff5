"""Checks that all tables share, and what keeps their arrays read-only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tcs.errors import TcsError

Shapes = Mapping[str, tuple[DTypeLike, tuple[int | None, ...]]]
"""Element type and shape of arrays, by name; None where any length is allowed."""


class ArrayTable:
    """Base of the tables: frozen dataclasses whose arrays are read-only, copies included."""

    def _check_arrays(self, what: str, shapes: Shapes) -> None:
        """Check the named arrays and replace them by read-only views.

        Args:
            what: Name of the table in an error message, e.g. "score table".
            shapes: Element type and shape of each array.

        Raises:
            TcsError: If one is not an array of that type and shape.
        """
        for name, (dtype, shape) in shapes.items():
            view = read_only(f"{what}: {name}", getattr(self, name), dtype, shape)
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


def length_of(array: object) -> int | None:
    """Return the length of an array, None for anything else."""
    return len(array) if isinstance(array, np.ndarray) and array.ndim else None


def read_only(
    what: str, array: NDArray[Any], dtype: DTypeLike, shape: tuple[int | None, ...]
) -> NDArray[Any]:
    """Return the array as a C-contiguous, read-only view.

    Args:
        what: Name for the error message, e.g. "score table: dexterity".
        array: Array to check; copied only if it is not contiguous.
        dtype: Required element type; a silent cast would hide a wrong array.
        shape: Required shape, None where any length is allowed.

    Raises:
        TcsError: If it is not an array of that type and shape.
    """
    if not isinstance(array, np.ndarray):
        raise TcsError(f"{what} is {type(array).__name__}; must be a numpy array.")
    wanted = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
    if array.dtype != np.dtype(dtype):
        raise TcsError(f"{what} has type {array.dtype}; must be {np.dtype(dtype)}.")
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

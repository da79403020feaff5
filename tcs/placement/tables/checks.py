"""What every table checks about the arrays it is given."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tcs.errors import TcsError


def read_only(
    what: str, array: NDArray[Any], dtype: DTypeLike, shape: tuple[int | None, ...]
) -> NDArray[Any]:
    """Return the array as a C-contiguous view that cannot be written through.

    Args:
        what: Name for the error message, e.g. "score table: dexterity".
        array: Array to check; not copied when it is already contiguous.
        dtype: Type it must have; a silent cast would hide a wrong array.
        shape: Shape it must have, None where any length will do.

    Returns:
        A read-only view.

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

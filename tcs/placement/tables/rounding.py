"""Rounding of upper bounds to single precision."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def float32_above(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the least float32 not below each value: a bound must not round down.

    >>> [float(v) for v in float32_above(np.array([0.5, 0.1]))]
    [0.5, 0.10000000149011612]
    """
    near = values.astype(np.float32)
    return np.where(near < values, np.nextafter(near, np.float32(np.inf)), near)

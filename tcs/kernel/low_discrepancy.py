"""Evenly spread points of the unit cube."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray


def spread(count: int, dimensions: int) -> FloatArray:
    """Return a low-discrepancy sequence in the unit cube, shape (count, dimensions).

    The sequence is deterministic: multiples, modulo 1, of powers of the root of x^(d+1) = x + 1,
    Roberts' generalised golden ratio.
    """
    root = 2.0
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1)
    return np.remainder(0.5 + np.arange(1, count + 1)[:, None] * steps, 1.0)

"""Configurations that need not be on a grid."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Points(NamedTuple):
    """Configurations by the values of the grid's axes."""

    values: NDArray[np.float64]
    """Values in the order of the axes [m or rad], shape (n, axes)."""
    arm: NDArray[np.int64]
    """Number of the arm that each uses, 0 in a file of one arm, shape (n,)."""

"""Boxes that together are the cells of a grid that contain a point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.model.robots.fitting.growth import grown, sums_before

FloatArray = NDArray[np.float64]

_SEEDS = 48
"""Cells from which boxes grow before the largest of them are taken."""
_LARGE = 0.5
"""Fraction of the cells of the largest box above which another one is taken with it."""
_MOST_CELLS = 200_000_000
"""Cells of the grid around all points, beyond which each occupied cell remains a box."""


def boxes_of_cells(points: FloatArray, cell: float) -> FloatArray:
    """Return boxes whose union is that of all cells with a point in it.

    Args:
        points: [m], shape (n, 3).
        cell: Edge of a cell [m]; a corner of the grid is at the origin.

    Returns:
        Least and greatest corner of each box [m], shape (m, 2, 3).
    """
    cells = np.unique(np.floor(points / cell).astype(np.int64), axis=0)
    first = cells.min(axis=0)
    size = cells.max(axis=0) - first + 1
    if float(np.prod(size.astype(np.float64))) > _MOST_CELLS:
        return np.asarray(np.stack([cells, cells + 1], axis=1) * cell, np.float64)
    occupied = np.zeros(size, np.bool_)
    occupied[tuple((cells - first).T)] = True
    blocked, bare, left = sums_before(~occupied), occupied.copy(), cells - first
    rng, found = np.random.default_rng(0), []
    while len(left):
        seeds = left if len(left) <= _SEEDS else rng.choice(left, _SEEDS, replace=False)
        boxes = grown(blocked, seeds, rng)
        counts = np.array([int(bare[_slices(box)].sum()) for box in boxes])
        order = np.argsort(-counts, kind="stable")
        for box, count in zip(boxes[order], counts[order], strict=True):
            if count < _LARGE * counts[order[0]]:
                break
            # Boxes that cover what one before them has covered wait.
            if bare[_slices(box)].sum() == count:
                bare[_slices(box)] = False
                found.append(box)
        left = left[bare[tuple(left.T)]]
    return np.asarray((np.array(found) + first + np.array([[0], [1]])) * cell, np.float64)


def _slices(box: NDArray[np.int64]) -> tuple[slice, ...]:
    return tuple(slice(low, high + 1) for low, high in zip(*box, strict=True))

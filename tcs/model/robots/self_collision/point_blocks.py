"""Points of a surface in blocks, so that few of them decide how far it is from another one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

FloatArray = NDArray[np.float64]

EDGE = 0.02
"""Edge of a block [m]."""
_FIRST, _GROWTH = 1, 8
"""Number of blocks that are looked at first, and how many times as many in each further round."""
_ROUNDING = 1e-9
"""Growth of the ball around a block [m], far above what its rounded radius may lack."""


@dataclass(frozen=True, slots=True)
class PointBlocks:
    """Points sorted by block, and a ball around each block.

    Attributes:
        points: Positions [m], shape (n, 3).
        first: First point of each block, then n, shape (m + 1,).
        centres: Centres of the balls [m], shape (m, 3).
        radii: Their radii [m], shape (m,).
    """

    points: FloatArray
    first: NDArray[np.int64]
    centres: FloatArray
    radii: FloatArray

    def of(self, blocks: NDArray[np.int64]) -> FloatArray:
        """Return the points of some blocks [m], shape (k, 3)."""
        ends = zip(self.first[blocks], self.first[blocks + 1], strict=True)
        return np.concatenate([self.points[first:last] for first, last in ends])


def blocks_of(points: FloatArray) -> PointBlocks:
    """Return points in blocks.

    Args:
        points: At least one point [m], shape (n, 3).
    """
    cells = np.floor((points - points.min(axis=0)) / EDGE).astype(np.int64)
    numbers = np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1))
    order = np.argsort(numbers, kind="stable")
    points, numbers = points[order], numbers[order]
    starts = np.flatnonzero(np.diff(numbers, prepend=-1))
    low, high = (f.reduceat(points, starts, axis=0) for f in (np.minimum, np.maximum))
    return PointBlocks(
        points=points,
        first=np.append(starts, len(points)),
        centres=(low + high) / 2,
        radii=np.linalg.norm(high - low, axis=1) / 2 + _ROUNDING,
    )


def least_distance(
    tree: cKDTree, blocks: PointBlocks, R: FloatArray, p: FloatArray, far: float
) -> float:
    """Return the least distance of points from those of a tree [m], at most `far`.

    A point is no nearer than the ball around its block, so the blocks are looked at in the order of
    these distances, until the next one is farther than what was found.

    Args:
        tree: Points in a frame A [m].
        blocks: Points in a frame B.
        R: R_AB, shape (3, 3).
        p: p_AoBo_A [m], shape (3,).
        far: Cap of the distance [m].
    """
    bound = far + float(blocks.radii.max())
    away, _ = tree.query(blocks.centres @ R.T + p, distance_upper_bound=bound)
    least = away - blocks.radii
    order = np.argsort(least)
    start, count = 0, _FIRST
    while start < len(order):
        next_ones = order[start : start + count]
        next_ones = next_ones[least[next_ones] < far]
        if not len(next_ones):
            break
        near, _ = tree.query(blocks.of(next_ones) @ R.T + p, distance_upper_bound=far)
        far = float(near.min(initial=far))
        start, count = start + count, count * _GROWTH
    return far

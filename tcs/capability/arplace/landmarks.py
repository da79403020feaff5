"""Landmarks: corresponding points on the boundaries of several regions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tcs.capability.arplace.polygons import spaced
from tcs.kernel.arrays import FloatArray

COUNT = 20
"""Number of landmarks: six key points and 14 others, or all equidistant."""
KEYS = ("lowest y", "lower lobe", "dent", "upper lobe", "highest y", "lowest x")
"""The key points in anticlockwise order."""
_DENT = 0.02
"""Least depth of a dent between two lobes [m]: shallower ones are ripples of the boundary."""


def landmarks_by_shape(boundaries: Sequence[FloatArray]) -> FloatArray:
    """Return six key points of each boundary, and 14 more at equal distances between them.

    The other 14 are divided between the segments in proportion to their mean lengths over all
    boundaries, so that landmarks correspond. The division is ours; the thesis does not print it.

    Args:
        boundaries: Anticlockwise polygons, one for each region.

    Returns:
        Shape (regions, COUNT, 2).

    Source:
        ITCM thesis, Appendix D.3.3 and Figure 40.
    """
    segments = [_segments(polygon) for polygon in boundaries]
    lengths = np.array([[_length(segment) for segment in of] for of in segments])
    shares = _divided(COUNT - len(KEYS), lengths.mean(axis=0))
    return np.array(
        [
            np.concatenate([spaced(s, 1 + n) for s, n in zip(of, shares, strict=True)])
            for of in segments
        ]
    )


def equidistant_landmarks(boundaries: Sequence[FloatArray]) -> FloatArray:
    """Return landmarks at equal distances along each boundary, from the point of lowest y on.

    Args:
        boundaries: Anticlockwise polygons, one for each region.

    Returns:
        Shape (regions, COUNT, 2).
    """
    paths = [np.roll(polygon, -int(np.argmin(polygon[:, 1])), axis=0) for polygon in boundaries]
    return np.array([spaced(np.concatenate([path, path[:1]]), COUNT) for path in paths])


def key_points(polygon: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return a polygon that starts at its lowest y, and the corners of it that are `KEYS`.

    A region before the table is shaped like a bean: towards the table it has two lobes with a dent
    between them. Without a dent, the third key point is the one opposite that of lowest x.

    Args:
        polygon: Anticlockwise corners, shape (n, 2).
    """
    path = np.roll(polygon, -int(np.argmin(polygon[:, 1])), axis=0)
    top = int(np.argmax(path[:, 1]))
    back = top + int(np.argmin(path[top:, 0])) if top + 1 < len(path) else top
    front = path[: top + 1, 0]
    depth = np.minimum(np.maximum.accumulate(front), np.maximum.accumulate(front[::-1])[::-1])
    depth = depth - front
    dent = int(np.argmax(depth))
    if depth[dent] < _DENT:
        dent = int(np.argmin(np.abs(path[: top + 1, 1] - path[back, 1])))
    dent = min(max(dent, 2), max(top - 2, 2))
    lower = _peak(front, 0, dent)
    upper = _peak(front, dent, top)
    return path, np.array([0, lower, dent, upper, top, back])


def _peak(front: FloatArray, start: int, stop: int) -> int:
    """Return the index of the greatest value between two others, the middle one if at an end."""
    best = start + int(np.argmax(front[start : stop + 1]))
    return best if start < best < stop else (start + stop) // 2


def _segments(polygon: FloatArray) -> list[FloatArray]:
    """Return the paths between consecutive key points."""
    path, keys = key_points(polygon)
    closed = np.concatenate([path, path[:1]])
    ends = [*keys[1:], len(path)]
    return [closed[start : stop + 1] for start, stop in zip(keys, ends, strict=True)]


def _length(path: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def _divided(count: int, lengths: FloatArray) -> list[int]:
    """Return whole numbers with a given sum, in proportion to lengths (largest remainders)."""
    exact = count * lengths / lengths.sum()
    shares = np.floor(exact).astype(int)
    rest = np.argsort(shares - exact, kind="stable")[: count - int(shares.sum())]
    shares[rest] += 1
    return [int(n) for n in shares]

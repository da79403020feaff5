"""Closest points of two straight lines, such as the axes of two joints."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray

PARALLEL_TOLERANCE = 1e-6
"""Sine of the angle between two lines below which they count as parallel: joint axes are built at
tens of degrees to each other, and figures in a URDF carry six digits or more."""


def closest_points(
    first: FloatArray, second: FloatArray, offset: FloatArray, sine_squared: float
) -> tuple[float, float]:
    """Return where two lines come closest, along each from its own point [m].

    Args:
        first: Unit direction of the first line, shape (3,).
        second: Unit direction of the second line, shape (3,).
        offset: From the point of the first line to that of the second [m], shape (3,).
        sine_squared: Of the angle between the lines, above 0. It comes from the caller, who may
            know it better than from the cosine, whose rounding small angles magnify.

    >>> x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    >>> closest_points(z, x, np.array([5.0, 0.0, 2.0]), 1.0)
    (2.0, -5.0)
    """
    cosine, along_first = float(first @ second), float(first @ offset)
    along_second = float(second @ offset)
    return (
        (along_first - cosine * along_second) / sine_squared,
        (cosine * along_first - along_second) / sine_squared,
    )


def axis_distance(R: FloatArray, p: FloatArray) -> tuple[float, float, float] | None:
    """Return how the z axis of a frame passes that of a frame at the pose (R, p) in it.

    Args:
        R: Orientation of the second frame in the first, shape (3, 3).
        p: Its origin [m], shape (3,).

    Returns:
        Their distance, and where they come closest, on each axis from its origin [m]; None if they
        are parallel.
    """
    square = float(R[0, 2] ** 2 + R[1, 2] ** 2)
    if square < PARALLEL_TOLERANCE**2:
        return None
    points = closest_points(np.array([0.0, 0.0, 1.0]), R[:, 2], p, square)
    return abs(float(R[0, 2] * p[1] - R[1, 2] * p[0])) / float(np.sqrt(square)), *points

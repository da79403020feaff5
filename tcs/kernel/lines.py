"""Closest points of two straight lines, such as the axes of two joints."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray

PARALLEL_TOLERANCE = 1e-6
"""Sine of the angle between two lines below which they are parallel: joint axes are either parallel
or tens of degrees apart, and numbers in a URDF have six digits or more."""


def closest_points(
    first: FloatArray, second: FloatArray, offset: FloatArray, sine_squared: float
) -> tuple[float, float]:
    """Return the closest points of two lines, each as a distance along its line [m].

    Args:
        first: Unit direction of the first line, shape (3,).
        second: Unit direction of the second line, shape (3,).
        offset: From the reference point of the first line to that of the second [m], shape (3,).
        sine_squared: Squared sine of the angle between the lines, above 0. It is an argument
            because callers may have it more accurately than from 1 - cosine^2, which loses digits
            at small angles.

    Returns:
        Signed distance of the closest point from the reference point, on each line [m].

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
    """Return the distance and the closest points of the z axes of two frames.

    Args:
        R: Orientation of the second frame in the first, shape (3, 3).
        p: Origin of the second frame in the first [m], shape (3,).

    Returns:
        Distance of the axes, and position of the closest point on the first and on the second axis
        from the origin of its frame [m]; None if the axes are parallel.
    """
    square = float(R[0, 2] ** 2 + R[1, 2] ** 2)
    if square < PARALLEL_TOLERANCE**2:
        return None
    points = closest_points(np.array([0.0, 0.0, 1.0]), R[:, 2], p, square)
    return abs(float(R[0, 2] * p[1] - R[1, 2] * p[0])) / float(np.sqrt(square)), *points

"""The surface that a body sweeps as it turns about an axis, from outside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Line = tuple[FloatArray, FloatArray]
"""A point of an axis [m] and its direction, shapes (3,)."""

SLICE = 0.0005
"""Height of the slices across the axis [m]."""
SIDES = 128
"""Sides of the polygon around the circle of a slice."""
_SAME = 0.00005
"""Slices whose radii differ by less [m] are one."""


def revolved(triangles: FloatArray, axis: Line) -> FloatArray:
    """Return a surface that contains all that triangles sweep as they turn about an axis.

    It is a stack of prisms, of one radius each, around the slices of what is swept: a ring of them
    is filled up to the axis.

    Args:
        triangles: Corners [m], shape (n, 3, 3).
        axis: The axis.

    Returns:
        Corners of triangles [m], shape (m, 3, 3).
    """
    low, radius = _profile(triangles, axis)
    return np.concatenate(
        [
            _prism(axis, low[k], low[k + 1], float(radius[k]))
            for k in range(len(radius))
            if radius[k] > 0.0
        ]
    )


def _profile(triangles: FloatArray, axis: Line) -> tuple[FloatArray, FloatArray]:
    """Return where slices along an axis begin, and the last ends, and the radii of all [m]."""
    along = (triangles - axis[0]) @ axis[1]
    count = max(1, int(np.ceil(np.ptp(along) / SLICE)))
    low = np.linspace(along.min(), along.max(), count + 1)
    radius = np.zeros(count)
    for k in range(count):
        touched = (along.min(axis=1) <= low[k + 1]) & (along.max(axis=1) >= low[k])
        points = _between(triangles[touched], along[touched], low[k], low[k + 1])
        off = points - axis[0]
        off = off - np.outer(off @ axis[1], axis[1])
        # The distance from the axis is convex: on a piece of a triangle, a corner is the farthest.
        radius[k] = np.linalg.norm(off, axis=1).max(initial=0.0)
    starts, merged = [low[0]], [radius[0]]
    for k in range(1, count):
        if abs(radius[k] - merged[-1]) < _SAME:
            merged[-1] = max(merged[-1], radius[k])
        else:
            starts.append(low[k])
            merged.append(radius[k])
    return np.array([*starts, low[-1]]), np.array(merged)


def _between(triangles: FloatArray, along: FloatArray, low: float, high: float) -> FloatArray:
    """Return the corners of the pieces of triangles between two planes across an axis, (n, 3)."""
    found = [triangles[(along >= low) & (along <= high)]]
    for i in range(3):
        j = (i + 1) % 3
        start, end = along[:, i], along[:, j]
        for plane in (low, high):
            crosses = (start - plane) * (end - plane) < 0.0
            at = (plane - start[crosses]) / (end[crosses] - start[crosses])
            corners = triangles[crosses]
            found.append(corners[:, i] + at[:, None] * (corners[:, j] - corners[:, i]))
    return np.concatenate(found)


def _prism(axis: Line, low: float, high: float, radius: float) -> FloatArray:
    """Return the triangles of a prism around a cylinder [m], shape (4 SIDES, 3, 3)."""
    origin, z = axis
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x = x / np.linalg.norm(x)
    angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
    rim = (
        radius
        / np.cos(np.pi / SIDES)
        * (np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * np.cross(z, x))
    )
    bottom, top = origin + low * z, origin + high * z
    here, there = bottom + rim, top + rim
    here_on, there_on = np.roll(here, -1, axis=0), np.roll(there, -1, axis=0)
    return np.concatenate(
        [
            np.stack([np.tile(bottom, (SIDES, 1)), here_on, here], axis=1),
            np.stack([here, here_on, there_on], axis=1),
            np.stack([here, there_on, there], axis=1),
            np.stack([np.tile(top, (SIDES, 1)), there, there_on], axis=1),
        ]
    )

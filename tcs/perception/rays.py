"""Ray casting: exact distances along rays to boxes, capsules and spheres."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray, Shapes


def cast(origin: FloatArray, directions: FloatArray, shapes: Shapes) -> FloatArray:
    """Return the distance along each ray to the nearest shape [m], infinite where none is met.

    Args:
        origin: Common origin of the rays [m], shape (3,).
        directions: Unit vectors, shape (n, 3).
        shapes: Shapes in one state, in the frame of the rays.

    Returns:
        Shape (n,); 0 for rays that begin inside a shape.
    """
    nearest = np.full(len(directions), np.inf)
    for code, size, R, p in zip(shapes.type, shapes.size, shapes.R[0], shapes.p[0], strict=True):
        start, along = (origin - p) @ R, directions @ R
        if code == BOX:
            found = box_distances(start, along, size)
        elif code == CAPSULE:
            found = _capsule_distances(start, along, float(size[0]), float(size[1]))
        else:
            found = _sphere_distances(start, along, float(size[0]))
        nearest = np.minimum(nearest, found)
    return nearest


def box_distances(start: FloatArray, along: FloatArray, half: FloatArray) -> FloatArray:
    """Return the distance along each ray to a box about the origin [m], infinite where it misses.

    Args:
        start: Origin of the rays in the frame of the box [m], shape (d,), d 2 or 3.
        along: Unit vectors in that frame, shape (n, d).
        half: Half sizes [m], shape (d,).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(-half - start) / along, (half - start) / along])
    # 0 / 0: a ray within a face meets that face everywhere.
    enter = np.where(np.isnan(ends).any(axis=0), -np.inf, ends.min(axis=0)).max(axis=-1)
    leave = np.where(np.isnan(ends).any(axis=0), np.inf, ends.max(axis=0)).min(axis=-1)
    met = (enter <= leave) & (leave >= 0.0)
    return np.asarray(np.where(met, np.maximum(enter, 0.0), np.inf))


def _sphere_distances(start: FloatArray, along: FloatArray, radius: float) -> FloatArray:
    middle = -along @ start
    square = middle**2 - start @ start + radius**2
    half = np.sqrt(np.maximum(square, 0.0))
    met = (square >= 0.0) & (middle + half >= 0.0)
    return np.where(met, np.maximum(middle - half, 0.0), np.inf)


def _capsule_distances(
    start: FloatArray, along: FloatArray, radius: float, half_length: float
) -> FloatArray:
    """Return the distances to a capsule along z: the nearest of its two caps and its side."""
    nearest = np.full(len(along), np.inf)
    for end in (-half_length, half_length):
        cap = np.array([0.0, 0.0, end])
        nearest = np.minimum(nearest, _sphere_distances(start - cap, along, radius))
    if start[:2] @ start[:2] <= radius**2 and abs(start[2]) <= half_length:
        return np.zeros(len(along))
    a = along[:, 0] ** 2 + along[:, 1] ** 2
    b = along[:, :2] @ start[:2]
    square = b**2 - a * (start[:2] @ start[:2] - radius**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        enter = (-b - np.sqrt(np.maximum(square, 0.0))) / a
        on_side = np.abs(start[2] + enter * along[:, 2]) <= half_length
    met = (square >= 0.0) & (enter >= 0.0) & on_side
    return np.asarray(np.minimum(nearest, np.where(met, enter, np.inf)))

"""Representations of a region as a vector: landmarks on its boundary, or signed distances.

Landmarks describe regions with a single boundary. Signed distances on the grid of base positions
describe any region: several parts, holes, and none at all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tcs.capability.arplace.boundary import Boundary, Region, boundary_of
from tcs.capability.arplace.landmarks import COUNT, equidistant_landmarks, landmarks_by_shape
from tcs.capability.arplace.polygons import counts_inside as polygons_around
from tcs.capability.arplace.polygons import winding_numbers
from tcs.errors import SelectionError, UnknownNameError
from tcs.kernel.arrays import BoolArray, FloatArray

BY_SHAPE, EQUIDISTANT, SIGNED_DISTANCE = "by-shape", "equidistant", "signed-distance"
REPRESENTATIONS = (BY_SHAPE, EQUIDISTANT, SIGNED_DISTANCE)
AUTOMATIC = "automatic"
"""`BY_SHAPE` if every region has a single boundary, otherwise `SIGNED_DISTANCE`."""


def chosen(representation: str, regions: Sequence[Region]) -> str:
    """Return the representation of a name, `AUTOMATIC` resolved for some regions.

    Raises:
        UnknownNameError: If there is no such representation.
    """
    if representation not in (AUTOMATIC, *REPRESENTATIONS):
        raise UnknownNameError("representation", representation, (AUTOMATIC, *REPRESENTATIONS))
    if representation != AUTOMATIC:
        return representation
    return BY_SHAPE if all(region.is_simple for region in regions) else SIGNED_DISTANCE


def shape_vectors(representation: str, regions: Sequence[Region]) -> tuple[FloatArray, BoolArray]:
    """Return the vectors of the regions that can be represented, and which these are.

    Args:
        representation: One of `REPRESENTATIONS`.
        regions: The regions; landmarks leave out those without a single boundary.

    Returns:
        Vectors, shape (used, size), and whether each region is used, shape (regions,).

    Raises:
        SelectionError: If fewer than two regions can be represented.
    """
    if representation == SIGNED_DISTANCE:
        # Base positions of one y are neighbours, so that shifts along y move whole rows.
        fields = np.array([region.signed_distance.T.ravel() for region in regions])
        return fields, np.ones(len(regions), np.bool_)
    used = np.array([region.is_simple for region in regions], dtype=np.bool_)
    if np.count_nonzero(used) < 2:
        raise SelectionError(
            f"landmarks need two or more regions with a single boundary; {np.count_nonzero(used)} "
            f"of {len(regions)} have one. Use the representation {SIGNED_DISTANCE}."
        )
    rule = landmarks_by_shape if representation == BY_SHAPE else equidistant_landmarks
    polygons = [region.boundary[0] for region, use in zip(regions, used, strict=True) if use]
    return rule(polygons).reshape(len(polygons), -1), used


def is_inside(
    representation: str,
    vectors: FloatArray,
    grid: tuple[FloatArray, FloatArray],
    shift: FloatArray,
    at: tuple[FloatArray, FloatArray] | None = None,
) -> BoolArray:
    """Return which base positions lie in regions that are shifted along y.

    Args:
        representation: One of `REPRESENTATIONS`.
        vectors: The regions, shape (n, size).
        grid: x and y of the grid of signed distances [m], shapes (nx,) and (ny,).
        shift: Shift of each region along y [m], shape (n,).
        at: x and y of the base positions, equally spaced; None are those of `grid`.

    Returns:
        Shape (n, x, y). Beyond the grid no base position is inside.
    """
    x, y = grid if at is None else at
    if representation == SIGNED_DISTANCE:
        return _signed_distances(vectors, grid, shift, (x, y)) > 0.0
    # Where a deformed boundary crosses itself, only points that it encloses anticlockwise count.
    return np.asarray(winding_numbers(_shifted(vectors, shift), x, y) > 0)


def counts_inside(
    representation: str,
    vectors: FloatArray,
    grid: tuple[FloatArray, FloatArray],
    shift: FloatArray,
    at: tuple[FloatArray, FloatArray],
) -> NDArray[np.int64]:
    """Return in how many regions base positions lie, shape (x, y).

    The arguments are those of `is_inside`, whose results this counts.
    """
    if representation == SIGNED_DISTANCE:
        inside = _signed_distances(vectors, grid, shift, at) > 0.0
        return np.asarray(inside.sum(axis=0, dtype=np.int64))
    return polygons_around(_shifted(vectors, shift), *at)


def _shifted(vectors: FloatArray, shift: FloatArray) -> FloatArray:
    """Return the landmarks of regions shifted along y, shape (n, landmarks, 2)."""
    landmarks = vectors.reshape(len(vectors), COUNT, 2).copy()
    landmarks[:, :, 1] += shift[:, None]
    return landmarks


def boundary_from(
    representation: str, vector: FloatArray, grid: tuple[FloatArray, FloatArray]
) -> Boundary:
    """Return the boundaries of the region of a vector.

    Args:
        representation: One of `REPRESENTATIONS`.
        vector: The region, shape (size,).
        grid: x and y of the grid of signed distances [m], shapes (nx,) and (ny,).
    """
    if representation == SIGNED_DISTANCE:
        x, y = grid
        return boundary_of(x, y, vector.reshape(len(y), len(x)).T)
    return (vector.reshape(COUNT, 2),)


def _signed_distances(
    vectors: FloatArray, grid: tuple[FloatArray, FloatArray], shift: FloatArray,
    at: tuple[FloatArray, FloatArray],
) -> FloatArray:  # fmt: skip
    """Return signed distances between grid points, linearly interpolated, shape (n, x, y)."""
    (x, y), (at_x, at_y) = grid, at
    fields = vectors.reshape(-1, len(y), len(x))
    if not np.array_equal(at_x, x):
        fields = fields @ _interpolation(x, at_x).astype(fields.dtype)
    along = (at_y - shift[:, None] - y[0]) / (y[1] - y[0])
    # Rounding must not move a base position between two rows of the grid.
    along = np.where(np.abs(along - np.rint(along)) < 1e-9, np.rint(along), along)
    beyond = (along < 0.0) | (along > len(y) - 1)
    lower = np.clip(np.floor(along), 0, len(y) - 2).astype(np.int64)
    fraction = (along - lower).astype(fields.dtype)[..., None]
    rows = np.arange(len(fields))[:, None]
    found = fields[rows, lower]
    found += fraction * (fields[rows, lower + 1] - found)
    found[beyond] = -1.0
    return np.asarray(found.transpose(0, 2, 1))


def _interpolation(values: FloatArray, at: FloatArray) -> FloatArray:
    """Return the matrix that interpolates between equally spaced values, shape (values, at).

    Points beyond the values take the nearest one.
    """
    along = np.clip((at - values[0]) / (values[1] - values[0]), 0.0, len(values) - 1)
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(np.arange(len(values))[:, None] - along)))

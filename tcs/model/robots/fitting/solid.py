"""The space that a body fills, on a grid: how far any point lies outside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tcs.kernel.enclosing.fields import FARTHEST, mark_surface, squared_distances

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

CLOSING = 0.015
"""Usual radius of the smallest ball that the space outside admits [m]: narrower hollows are filled,
and so is whatever is behind openings narrower than twice this."""
_BORDER = 3
"""Cells beyond the space that may be of interest."""


@dataclass(frozen=True, slots=True)
class Solid:
    """The space within the surface of a body, on a grid of points.

    Attributes:
        outside: Distance of each point from the solid [m], 0 inside, shape (nx, ny, nz). It is
            exact up to the reach for which the solid was made, and somewhat farther.
        depth: Distance of each point from the space outside [m], 0 there, shape (nx, ny, nz).
        origin: First point of the grid in the body's frame [m], shape (3,).
        pitch: Distance of neighbouring points [m].
    """

    outside: NDArray[np.float32]
    depth: NDArray[np.float32]
    origin: FloatArray
    pitch: float

    def points(self, chosen: BoolArray) -> FloatArray:
        """Return the positions of chosen points of the grid [m], shape (n, 3)."""
        return np.asarray(np.argwhere(chosen) * self.pitch + self.origin)

    def between(
        self, low: FloatArray, high: FloatArray
    ) -> tuple[tuple[slice, ...], NDArray[np.int64]]:
        """Return the part of the grid that covers a box, and its first cell, shape (3,).

        Args:
            low: Least corner of the box in the body's frame [m], shape (3,).
            high: Greatest corner [m], shape (3,).
        """
        ends = np.array(self.outside.shape) - 1
        first = np.floor((low - self.origin) / self.pitch).astype(np.int64).clip(0, ends)
        last = np.ceil((high - self.origin) / self.pitch).astype(np.int64).clip(0, ends)
        return tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True)), first


def solid_of(triangles: FloatArray, pitch: float, reach: float, closing: float = CLOSING) -> Solid:
    """Return the space within triangles, which need not form a closed surface.

    Whatever a ball can touch from far away without crossing the surface is outside.

    Args:
        triangles: Corners [m], shape (n, 3, 3).
        pitch: Distance of the points of the grid [m].
        reach: Distance from the surface that the grid must cover, and that is measured [m].
        closing: Radius of the ball [m].
    """
    ((empty, origin),) = spaces_outside(triangles, pitch, [(closing, reach)])
    return measured(empty, origin, pitch, reach)


def spaces_outside(
    triangles: FloatArray, pitch: float, balls: Sequence[tuple[float, float]]
) -> list[tuple[BoolArray, FloatArray]]:
    """Return what each of some balls can touch from far away without crossing a surface.

    Args:
        triangles: Corners [m], shape (n, 3, 3).
        pitch: Distance of the points of the grids [m].
        balls: Radius of each ball, and the distance from the surface that its grid must cover [m].

    Returns:
        For each ball, which points of its grid it touches, and the first of them [m], shape (3,).
    """
    low, high = (
        np.rint(f(triangles, axis=(0, 1)) / pitch).astype(np.int64) for f in (np.min, np.max)
    )
    borders = [int(np.ceil((radius + reach) / pitch)) + _BORDER for radius, reach in balls]
    first = low - max(borders)
    surface = np.zeros(high - first + max(borders) + 1, np.bool_)
    mark_surface(surface, triangles, pitch, pitch, first)
    away, spaces = distances(~surface, pitch, max(radius for radius, _ in balls)), []
    for (radius, _), border in zip(balls, borders, strict=True):
        parts, _ = ndimage.label(away > radius)
        reached = distances(parts != parts[0, 0, 0], pitch, radius) <= radius
        beyond = max(borders) - border
        own = tuple(slice(beyond, count - beyond) for count in surface.shape)
        spaces.append(
            ((reached & ~surface)[own].copy(), (first + beyond).astype(np.float64) * pitch)
        )
    return spaces


def solid_within(
    whole: Solid,
    triangles: FloatArray,
    low: FloatArray,
    high: FloatArray,
    pitch: float,
    reach: float,
) -> Solid:
    """Return the part of a solid between two corners, on a finer grid.

    Args:
        whole: The solid of all triangles.
        triangles: Corners [m], shape (n, 3, 3).
        low: Least coordinates of the part in the frame of the triangles [m], shape (3,).
        high: Greatest coordinates [m], shape (3,).
        pitch: Distance of the points of the grid [m].
        reach: Distance from the surface that is measured [m].
    """
    border = CLOSING + whole.pitch
    first = np.floor((low - border) / pitch)
    size = np.ceil((high + border) / pitch - first).astype(np.int64) + 1
    surface = np.zeros(size, np.bool_)
    near = _touching(triangles, low - border, high + border)
    mark_surface(surface, near, pitch, pitch, first.astype(np.int64))
    axes = [
        np.round(((first[k] + np.arange(size[k])) * pitch - whole.origin[k]) / whole.pitch)
        .astype(np.int64)
        .clip(0, whole.outside.shape[k] - 1)
        for k in range(3)
    ]
    is_outside = whole.outside[np.ix_(*axes)] > 0.0
    fits = is_outside & (distances(~surface, pitch, CLOSING) > CLOSING)
    reached = distances(~fits, pitch, CLOSING) <= CLOSING
    return measured(reached & ~surface, first * pitch, pitch, reach)


def _touching(triangles: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the triangles whose boxes touch the space between two corners."""
    near = (triangles.min(axis=1) <= high) & (triangles.max(axis=1) >= low)
    return np.asarray(triangles[near.all(axis=1)])


def measured(empty: BoolArray, origin: FloatArray, pitch: float, reach: float) -> Solid:
    """Return the solid around the points of a grid that are empty.

    Args:
        empty: The points outside, shape (nx, ny, nz).
        origin: Position of the first point of the grid [m], shape (3,).
        pitch: Distance of neighbouring points [m].
        reach: Distance from the solid that is measured [m].
    """
    return Solid(
        outside=distances(empty, pitch, reach).astype(np.float32),
        depth=distances(~empty, pitch, np.inf).astype(np.float32),
        origin=origin,
        pitch=pitch,
    )


def distances(cells: BoolArray, pitch: float, reach: float) -> FloatArray:
    """Return the distance of each cell that is set from the nearest that is not [m], 0 elsewhere.

    Args:
        cells: The cells, some of which are not set, shape (nx, ny, nz).
        pitch: Distance of neighbouring cells [m].
        reach: Distance that is of interest [m]: greater ones may be too small, but exceed it by
            more than the diagonal of a cell.
    """
    # A cell and its neighbours are no farther apart than two edges.
    most = FARTHEST if np.isinf(reach) else int(np.ceil(reach / pitch)) + 2
    squares = squared_distances(np.ascontiguousarray(cells), most)
    length = np.sqrt(np.arange(int(squares.max(initial=0)) + 1)) * pitch
    return np.asarray(length[squares])

"""The space that a body fills, on a grid: how far any point lies outside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tcs.model.robots.primitives import Primitive
from tcs_shapes.bounding import enclose, hull_corners
from tcs_shapes.cells import FARTHEST, counts_beyond, grow_boxes, mark_surface, squared_distances

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

CLOSING = 0.015
"""Usual radius of the smallest ball that the space outside admits [m]: narrower hollows are filled,
and so is whatever is behind openings narrower than twice this."""
_BORDER = 3
"""Cells beyond the space that may be of interest."""
IntArray = NDArray[np.int64]

_AROUND = 3
"""Cells around the space that a grid covers."""
_AXIS_SAMPLES = 24
"""Points of a capsule's axis at which its radius is measured."""
_DRAWN = 8
"""Capsules drawn for each one that is kept."""

CELLS = 15
"""Cells along a body by which its inside is found: covers leave openings, and those narrower than a
cell do not count."""

_SEEDS = 48
"""Cells from which boxes grow before the largest of them are taken."""
_LARGE = 0.5
"""Fraction of the cells of the largest box above which another one is taken with it."""
_MOST_CELLS = 200_000_000
"""Cells of the grid around all points, beyond which each occupied cell remains a box."""


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


def extremes(solid: Solid, protrusion: float) -> FloatArray:
    """Return the corners of the hull of the points of a grid no farther from a solid, (n, 3) [m].

    Args:
        solid: The solid.
        protrusion: Distance from it [m].
    """
    near = solid.outside <= protrusion
    # Of each row, the first and the last point.
    ends = near & ~(np.roll(near, 1, axis=2) & np.roll(near, -1, axis=2))
    return hull_corners(solid.points(ends))


def boxes_in(
    solid: Solid,
    protrusion: float,
    corners: FloatArray,
    R: FloatArray,
    seeds: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Return boxes along given axes that reach no farther out of a solid than allowed.

    Each grows from a seed, side after side in an order of its own, until no side can move.

    Args:
        solid: The solid.
        protrusion: Greatest distance of a point of a box from the solid [m].
        corners: As of `extremes`.
        R: Axes of the boxes as columns, shape (3, 3).
        seeds: Points to start from [m], shape (n, 3); those outside are left out.
        rng: Source of the orders.

    Returns:
        Least and greatest coordinates along the axes [m], shape (m, 2, 3).
    """
    seen, border = corners @ R, _AROUND * solid.pitch
    low, high = seen.min(axis=0) - border, seen.max(axis=0) + border
    count = np.ceil((high - low) / solid.pitch).astype(np.int64) + 1
    # Sampling point k of the new grid is low @ R.T + pitch * R @ k, in cells of the solid's grid.
    start = (R @ low - solid.origin) / solid.pitch
    blocked = counts_beyond(solid.outside, solid.pitch, protrusion, R, start, count)
    cells = np.clip(np.rint((seeds @ R - low) / solid.pitch).astype(np.int64), 0, count - 1)
    boxes = grown(blocked, cells[_are_free(blocked, cells)], rng)
    boxes = np.unique(boxes.reshape(-1, 6), axis=0).reshape(-1, 2, 3)
    return np.asarray(low + boxes * solid.pitch)


def sums_before(cells: BoolArray) -> NDArray[np.int32]:
    """Return how many cells are set before each corner of a grid, shape (nx + 1, ny + 1, nz + 1).

    Args:
        cells: The cells, shape (nx, ny, nz).
    """
    counts = np.pad(cells.astype(np.int32), ((1, 0),) * 3)
    for k in range(3):
        np.cumsum(counts, axis=k, out=counts)
    return counts


def grown(counts: NDArray[np.int32], seeds: IntArray, rng: np.random.Generator) -> IntArray:
    """Return the first and last cells of boxes without blocked cells, shape (n, 2, 3).

    Args:
        counts: Numbers of cells that a box must not contain, from `sums_before`.
        seeds: Cells from which the boxes grow, shape (n, 3).
        rng: Source of the order in which the sides of each box move.
    """
    boxes = np.stack([seeds, seeds], axis=1)
    grow_boxes(counts, boxes, np.argsort(rng.random((len(seeds), 6)), axis=1))
    return boxes


def _are_free(counts: NDArray[np.int32], cells: IntArray) -> BoolArray:
    """Return which cells are not blocked, from sums over all cells before each, shape (n,)."""
    i, j, k = cells.T
    last = counts[i + 1, j + 1, k + 1] - counts[i + 1, j + 1, k]
    last -= counts[i + 1, j, k + 1] - counts[i + 1, j, k]
    first = counts[i, j + 1, k + 1] - counts[i, j + 1, k]
    first -= counts[i, j, k + 1] - counts[i, j, k]
    return np.asarray(last == first)


def capsules_in(
    solid: Solid, protrusion: float, count: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return large capsules that reach no farther out of a solid than allowed.

    Args:
        solid: The solid.
        protrusion: Greatest distance of a point of a capsule from the solid [m].
        count: Number of capsules.
        rng: Source of the axes, which connect random points, mostly deep inside.

    Returns:
        Ends of the axes, shapes (n, 3), and radii, shape (n,) [m]; n is at most `count`.
    """
    depth = distances(solid.outside <= protrusion, solid.pitch, np.inf)
    cells = np.argwhere(depth > 2 * solid.pitch)
    if not len(cells):
        return np.empty((0, 3)), np.empty((0, 3)), np.empty(0)
    weight = depth[tuple(cells.T)] ** 3
    drawn = [rng.choice(len(cells), count * _DRAWN, p=weight / weight.sum()) for _ in range(2)]
    first, last = cells[drawn[0]], cells[drawn[1]]
    # Some have no length: spheres.
    last[: len(last) // 6] = first[: len(first) // 6]
    along = np.linspace(0.0, 1.0, _AXIS_SAMPLES)[None, :, None]
    axis = np.rint(first[:, None] * (1 - along) + last[:, None] * along).astype(np.int64)
    radius = depth[tuple(np.moveaxis(axis, 2, 0))].min(axis=1) - solid.pitch
    length = np.linalg.norm(last - first, axis=1) * solid.pitch
    volume = np.where(radius > 2 * solid.pitch, radius**2 * (length + 4 / 3 * radius), 0.0)
    kept = np.argsort(-volume, kind="stable")[:count]
    kept = kept[volume[kept] > 0.0]
    ends = (cell[kept] * solid.pitch + solid.origin for cell in (first, last))
    return *ends, radius[kept]


def fillers(
    body: str, primitives: tuple[Primitive, ...], triangles: FloatArray
) -> tuple[Primitive, ...]:
    """Return boxes of cells inside a surface that contain what primitives leave out there.

    Args:
        body: Name of the body.
        primitives: Primitives that enclose the surface.
        triangles: Corners of the surface [m], shape (n, 3, 3).
    """
    first, hollow, pitch = _cells(triangles)
    bare = hollow.copy()
    cells = np.argwhere(hollow)
    for shape in primitives:
        bare[tuple(cells[shape.contains(first + cells * pitch)].T)] = False
    rng, found = np.random.default_rng(0), []
    while bare.any():
        boxes = grown(sums_before(~hollow), np.argwhere(bare), rng)
        counts = [int(bare[_slices(box)].sum()) for box in boxes]
        box = boxes[int(np.argmax(counts))]
        bare[_slices(box)] = False
        ends = first + (box + np.array([[-0.5], [0.5]])) * pitch
        corners = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
        found.append(enclose(body, corners, "box", np.eye(3)))
    return tuple(found)


def _slices(box: NDArray[np.int64]) -> tuple[slice, ...]:
    return tuple(slice(low, high + 1) for low, high in zip(*box, strict=True))


def _cells(triangles: FloatArray) -> tuple[FloatArray, NDArray[np.bool_], float]:
    """Return the centre of the first cell, which cells are hollow, and their edge [m]."""
    corners = triangles.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    pitch = float((high - low).max()) / CELLS
    first, last = (np.rint(end / pitch).astype(np.int64) for end in (low, high))
    shell = np.zeros(last - first + 1, np.bool_)
    # Pieces of half a cell leave no cell of a surface out.
    mark_surface(shell, np.ascontiguousarray(triangles), pitch / 2, pitch, first)
    hollow = np.asarray(ndimage.binary_fill_holes(shell)) & ~shell
    return first * pitch, hollow, pitch


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

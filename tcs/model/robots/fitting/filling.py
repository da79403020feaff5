"""Boxes that fill what primitives leave hollow inside a closed surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tcs.kernel.enclosing.fields import mark_surface
from tcs.model.robots.fitting.bounding import enclose
from tcs.model.robots.fitting.growth import grown, sums_before
from tcs.model.robots.primitives import Primitive

FloatArray = NDArray[np.float64]

CELLS = 15
"""Cells along a body by which its inside is found: covers leave openings, and those narrower than a
cell do not count."""


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

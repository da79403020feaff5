"""Boxes that fill what primitives leave hollow inside a closed surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from tcs.model.robots.cutting import distinct
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
    import trimesh

    pitch = float(np.ptp(triangles.reshape(-1, 3), axis=0).max()) / CELLS
    corners, index = distinct(triangles.reshape(-1, 3))
    mesh = trimesh.Trimesh(corners, index.reshape(-1, 3), process=False)
    voxels = mesh.voxelized(pitch)
    shell = np.asarray(voxels.matrix)
    hollow = np.asarray(ndimage.binary_fill_holes(shell)) & ~shell
    return np.asarray(voxels.indices_to_points(np.zeros((1, 3)))[0]), hollow, pitch

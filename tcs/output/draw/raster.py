"""The nearest triangle in each pixel, and the walls that are left out because they hide too much.

The 3-D axes of matplotlib sort whole faces, but the shapes that enclose a robot's links intersect
each other. Depth is therefore compared pixel by pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.output.draw import camera as cameras
from tcs.output.draw.camera import FOCAL, Camera, IntArray
from tcs.output.draw.solids import Category, FloatArray, Solid

_WALL_TOP = 1.5
"""Least height of furniture that may be left out [m]: walls and cupboards, not beds and chairs."""
_HIDES = 0.05
"""Fraction of the visible robot, person and goals that such a solid may hide."""

_CLOSEST = 0.05
"""Least distance along the view at which surfaces are drawn [m]."""


class Raster(NamedTuple):
    """The nearest surface in every pixel."""

    depth: FloatArray
    """Reciprocal of the distance along the view [1/m], 0 where there is no surface."""
    triangle: IntArray
    """Number of the triangle, -1 where there is none."""


class Mesh(NamedTuple):
    """The surfaces of all solids."""

    triangles: FloatArray
    """Corners [m], shape (m, 3, 3)."""
    owner: IntArray
    """Number of the solid that each triangle belongs to, shape (m,)."""

    @classmethod
    def of(cls, solids: Sequence[Solid]) -> Mesh:
        """Return the surfaces of solids."""
        counts = [len(solid.triangles) for solid in solids]
        triangles = np.concatenate([solid.triangles for solid in solids])
        return cls(triangles, np.repeat(np.arange(len(solids)), counts))

    def is_subject(self, solids: Sequence[Solid]) -> NDArray[np.bool_]:
        """Return which triangles are of robot, person and goals, shape (m,)."""
        return np.array([solid.category is not Category.FURNITURE for solid in solids])[self.owner]


def rasterise_scene(
    solids: Sequence[Solid], mesh: Mesh, camera: Camera
) -> tuple[Raster, tuple[int, ...]]:
    """Return the nearest surfaces, and the numbers of the solids that are left out.

    Furniture as high as a wall is left out if it hides robot, person or goals, or extends behind
    the camera: the camera is often outside the walls of an environment.

    Args:
        solids: The solids.
        mesh: Their surfaces.
        camera: The camera.
    """
    is_subject = mesh.is_subject(solids)
    walls = [
        number
        for number, solid in enumerate(solids)
        if solid.category is Category.FURNITURE and float(solid.corners[:, 2].max()) >= _WALL_TOP
    ]
    raster = _rasterise(mesh, camera, ~np.isin(mesh.owner, walls))
    shows_subject = (raster.triangle >= 0) & is_subject[raster.triangle]
    left_out = []
    for number in walls:
        # A wall that extends from in front of the camera to behind it cannot be drawn completely.
        ahead = (camera.p - solids[number].corners) @ camera.R[2] > _CLOSEST
        wall = _rasterise(mesh, camera, mesh.owner == number)
        hidden = shows_subject & (wall.depth > raster.depth)
        if ahead.any() != ahead.all() or hidden.sum() > _HIDES * shows_subject.sum():
            left_out.append(number)
        else:
            nearer = wall.depth > raster.depth
            raster.depth[nearer] = wall.depth[nearer]
            raster.triangle[nearer] = wall.triangle[nearer]
            shows_subject &= ~nearer
    return raster, tuple(left_out)


def _rasterise(mesh: Mesh, camera: Camera, is_drawn: NDArray[np.bool_]) -> Raster:
    """Return the nearest of some triangles in each pixel.

    The reciprocal of the distance is linear across the picture of a plane, so its values at three
    corners give it everywhere in the triangle.
    """
    width, height = cameras.SIZE
    depth = np.zeros((height, width))
    nearest = np.full((height, width), -1, dtype=np.int64)
    view = (mesh.triangles - camera.p) @ camera.R.T
    away = -view[..., 2]
    is_ahead = away.min(axis=1) > _CLOSEST
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = FOCAL * (height / 2.0) * view[..., :2] / away[..., None]
    xy = pixels * [1.0, -1.0] + [width / 2.0, height / 2.0]
    # Corners behind the camera have no pixel: their triangles are not drawn.
    xy[~is_ahead] = 0.0
    edge1, edge2 = xy[:, 1] - xy[:, 0], xy[:, 2] - xy[:, 0]
    area = edge1[:, 0] * edge2[:, 1] - edge1[:, 1] * edge2[:, 0]
    low = np.maximum(np.floor(xy.min(axis=1)).astype(int), 0)
    high = np.minimum(np.ceil(xy.max(axis=1)).astype(int) + 1, [width, height])
    # Triangles are counter-clockwise from outside, hence clockwise in pixels, where y points down;
    # the others face away.
    front = is_drawn & (area < 0.0) & is_ahead & np.all(low < high, axis=1)
    for i in np.flatnonzero(front):
        (x0, y0), (x1, y1) = low[i], high[i]
        px = np.arange(x0, x1)[None, :] + 0.5 - xy[i, 0, 0]
        py = np.arange(y0, y1)[:, None] + 0.5 - xy[i, 0, 1]
        b = (px * edge2[i, 1] - py * edge2[i, 0]) / area[i]
        c = (py * edge1[i, 0] - px * edge1[i, 1]) / area[i]
        near = 1.0 / away[i]
        here = near[0] + b * (near[1] - near[0]) + c * (near[2] - near[0])
        window = (slice(y0, y1), slice(x0, x1))
        wins = (b >= 0.0) & (c >= 0.0) & (b + c <= 1.0) & (here > depth[window])
        depth[window][wins] = here[wins]
        nearest[window][wins] = i
    return Raster(depth, nearest)

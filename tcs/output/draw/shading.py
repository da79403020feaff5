"""Colours of the pixels of a picture in space: lit surfaces, outlines, and the floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from tcs.output.draw import camera as cameras
from tcs.output.draw.camera import FOCAL, Camera, IntArray, rays
from tcs.output.draw.raster import Mesh, Raster
from tcs.output.draw.solids import Category, FloatArray, Solid

_FLOOR = np.array([0.95, 0.95, 0.94])
_LINE = np.array([0.86, 0.86, 0.86])
_SKY = np.array([1.0, 1.0, 1.0])
_LIGHTS = ((np.array([0.35, 0.8, 0.5]), 0.50), (np.array([-0.8, 0.1, 0.6]), 0.25))
"""Directions towards the lights (right, up, towards the camera), and their strengths."""
_AMBIENT = 0.42
_SAME_PLANE = 0.004
"""Largest distance of a point from the plane of its neighbour [m] if both are of one surface."""
_SAME_NORMAL = 0.9
"""Least cosine of the angle between the normals of one surface: neighbouring facets of a round
shape with sixteen corners are 22.5 deg apart."""
_SIGNS = (Category.GOAL, Category.CURRENT_GOAL)


def shade(solids: Sequence[Solid], mesh: Mesh, camera: Camera, raster: Raster) -> FloatArray:
    """Return the colours of all pixels, shape (height, width, 3)."""
    hit = raster.triangle >= 0
    image = np.empty((*hit.shape, 3))
    image[~hit] = _floor(camera, np.argwhere(~hit))
    number = raster.triangle[hit]
    triangles, owner = mesh
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    in_view = normals @ camera.R.T
    light = np.full(len(triangles), _AMBIENT)
    for direction, strength in _LIGHTS:
        light += strength * np.maximum(in_view @ (direction / np.linalg.norm(direction)), 0.0)
    # Goals are symbols: they have the colours of the legend, without shading.
    is_sign = np.array([solid.category in _SIGNS for solid in solids])
    light[is_sign[owner]] = 1.0
    base = np.array([to_rgb(solid.category.colour) for solid in solids])
    image[hit] = np.clip(base[owner[number]] * light[number][:, None], 0.0, 1.0)
    image[_edges(owner, in_view, raster)] *= 0.45
    return image


def _edges(owner: IntArray, normals: FloatArray, raster: Raster) -> NDArray[np.bool_]:
    """Return the pixels at which another solid begins, shape (height, width).

    Where two solids share a surface, rounding decides pixel by pixel which of them is nearer; such
    pixels are not edges.
    """
    number = np.maximum(raster.triangle, 0)
    solid = np.where(raster.triangle >= 0, owner[number], -1)
    edge = np.zeros(solid.shape, dtype=np.bool_)
    for step in ((0, 1), (1, 0)):
        differs = solid[step[0] :, step[1] :] != solid[: -step[0] or None, : -step[1] or None]
        before = np.argwhere(differs)
        here = before + step
        normal, apart = [], np.zeros((len(here), 3))
        for pixels, sign in ((here, 1.0), (before, -1.0)):
            at = tuple(pixels.T)
            normal.append(normals[number[at]])
            # A pixel without a surface counts as far away.
            away = 1.0 / np.maximum(raster.depth[at], 1e-3)
            apart += sign * rays(pixels) * away[:, None]
        off_plane = np.einsum("ij,ij->i", normal[0], apart)
        cosine = np.einsum("ij,ij->i", normal[0], normal[1])
        is_one_surface = (np.abs(off_plane) < _SAME_PLANE) & (cosine > _SAME_NORMAL)
        edge[tuple(here[~is_one_surface].T)] = True
    return edge


def _floor(camera: Camera, pixels: IntArray) -> FloatArray:
    """Return the colours of the empty floor, with a line every half metre, shape (n, 3).

    Args:
        camera: The camera.
        pixels: Row and column of each pixel, shape (n, 2).
    """
    directions = rays(pixels) @ camera.R
    down = -directions[:, 2]
    reach = camera.p[2] / np.maximum(down, 1e-6)
    points = camera.p[:2] + reach[:, None] * directions[:, :2]
    # A line has the width of a pixel on the floor there, but at least 8 mm.
    half = np.maximum(0.004, 1.2 * reach / (FOCAL * cameras.SIZE[1] / 2.0))
    from_line = np.abs(np.mod(points + 0.25, 0.5) - 0.25).min(axis=1)
    colours = np.where((from_line < half)[:, None], _LINE, _FLOOR)
    fade = np.clip((reach - 5.0) / 3.0, 0.0, 1.0)[:, None]
    return np.asarray(np.where(down[:, None] > 0.0, colours * (1 - fade) + _SKY * fade, _SKY))

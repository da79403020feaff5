"""A picture in space: robot, furniture, person and goals from their collision shapes.

matplotlib's own 3-D axes sort whole faces, and shapes that enclose a robot's links
pass through one another; so depth is compared pixel by pixel here.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from tcs.output.draw.solids import FloatArray, Kind, Solid

IntArray = NDArray[np.int64]

_SIZE = (1500, 1300)
"""Width and height of a view in pixels, before two by two are made one."""
_FOCAL = 3.5
"""Focal length over half the picture's height: from some 5 m away, a person and a robot fill it."""
_LETTERS = 56
"""How many letters of the title fit above a view."""
_FILLED = 0.94
"""How much of the picture its subject may take up."""
_NEAREST = 0.5
"""How far the camera keeps from its subject at least [m]."""
_ELEVATION = np.radians(24.0)
_FLOOR = np.array([0.95, 0.95, 0.94])
_LINE = np.array([0.86, 0.86, 0.86])
_SKY = np.array([1.0, 1.0, 1.0])
_LIGHTS = ((np.array([0.35, 0.8, 0.5]), 0.50), (np.array([-0.8, 0.1, 0.6]), 0.25))
"""Directions towards the lights (right, up, towards the camera), and their strengths."""
_AMBIENT = 0.42
_UNHIDDEN = 0.6
"""How much of robot and person a view has to show, beside the view that shows most of them."""
_SAME_PLANE = 0.004
"""How far a point may be off the plane of its neighbour [m] if both are of one surface."""
_SAME_WAY = 0.9
"""Cosine of the angle up to which two surfaces look one way: neighbouring facets of a round shape
with sixteen corners are 22.5 deg apart."""
_GOALS = {Kind.GOAL: 1.0, Kind.CURRENT_GOAL: 5.0}
"""How much it counts that a goal is seen; the tool hides most of the one it is at."""


@dataclass(frozen=True, eq=False)
class View:
    """One panel of the picture."""

    solids: Sequence[Solid]
    """What there is."""
    subject: FloatArray
    """Points that have to be in the picture, which is as close as that allows [m], (n, 3)."""
    azimuths: tuple[float, ...]
    """Directions from which to look [rad]; the one that shows most of the goals is taken, above all
    of the goal that is shown, unless something hides who reaches for it."""
    caption: str


class _Camera(NamedTuple):
    """Where the camera is, and which way it looks: rows right, up, backward."""

    p: FloatArray
    R: FloatArray


class _Raster(NamedTuple):
    """What every pixel sees."""

    depth: FloatArray
    """Reciprocal of the distance along the view [1/m], 0 where nothing is."""
    triangle: IntArray
    """Number of the triangle, -1 where none."""


def draw_scene(views: Sequence[View], *, title: str) -> Figure:
    """Return a picture with one panel for each view.

    Args:
        views: What to show, left to right.
        title: First line, for a person; "" for none.
    """
    figure = Figure(figsize=(6.6 * len(views), 6.6), layout="constrained")
    panels = figure.subplots(1, len(views), squeeze=False)[0]
    for axes, view in zip(panels, views, strict=True):
        axes.imshow(_rendered(view), interpolation="antialiased")
        axes.set_axis_off()
        axes.set_title(view.caption, fontsize=11)
    if title:
        width = _LETTERS * len(views)
        lines = [line for part in title.splitlines() for line in textwrap.wrap(part, width)]
        figure.suptitle("\n".join(lines), fontsize=13)
    shown = {solid.kind for view in views for solid in view.solids}
    handles = [
        Patch(facecolor=kind.colour, edgecolor="#555555", lw=0.5, label=kind.label)
        for kind in Kind
        if kind in shown
    ]
    columns = min(3 * len(views), 6)
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False)
    return figure


def _rendered(view: View) -> FloatArray:
    """Return the picture from the direction that shows most of the goals, shape (h, w, 3)."""
    triangles = np.concatenate([solid.triangles for solid in view.solids])
    owner = np.repeat(np.arange(len(view.solids)), [len(solid.triangles) for solid in view.solids])
    weight = np.array([_GOALS.get(solid.kind, 0.0) for solid in view.solids])[owner]
    is_subject = np.array([solid.kind is not Kind.FURNITURE for solid in view.solids])[owner]
    taken = []
    for azimuth in view.azimuths:
        camera = _camera(view, azimuth)
        raster = _rasterised(triangles, camera)
        seen = raster.triangle[raster.triangle >= 0]
        taken.append((float(weight[seen].sum()), int(is_subject[seen].sum()), camera, raster))
    # From behind a wall a goal may be seen past its edge, and nothing of who reaches for it.
    clear = _UNHIDDEN * max(subject for _, subject, _, _ in taken)
    *_, camera, raster = max((one for one in taken if one[1] >= clear), key=lambda one: one[0])
    image = _shaded(view, triangles, owner, camera, raster)
    # Two by two pixels become one: smooth edges.
    return np.asarray(image.reshape(_SIZE[1] // 2, 2, _SIZE[0] // 2, 2, 3).mean(axis=(1, 3)))


def _camera(view: View, azimuth: float) -> _Camera:
    """Return the nearest camera from which no point of the subject is cut off."""
    R = _facing(azimuth)
    right, up, backward = (view.subject @ R.T).T
    # A point is in the picture where |sideways| <= half * (its distance along the view), and the
    # same upward: four bounds on where the camera is, each with one point that binds.
    half = np.array([_SIZE[0] / _SIZE[1], 1.0]) / _FOCAL * _FILLED
    place, distance = np.zeros(3), -np.inf
    for axis, along in enumerate((right, up)):
        most = float((along + half[axis] * backward).max())
        least = float((-along + half[axis] * backward).max())
        place[axis] = 0.5 * (most - least)
        distance = max(distance, 0.5 * (most + least) / float(half[axis]))
    place[2] = max(distance, float(backward.max()) + _NEAREST)
    return _Camera(place @ R, R)


def _facing(azimuth: float) -> FloatArray:
    """Return the camera's axes as rows: right, up, backward."""
    flat = np.cos(_ELEVATION)
    backward = np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(_ELEVATION)])
    right = np.cross([0.0, 0.0, 1.0], backward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(backward, right), backward])


def _rasterised(triangles: FloatArray, camera: _Camera) -> _Raster:
    """Return the nearest triangle in each pixel.

    The reciprocal of the distance is linear across the picture of a plane, so three
    corners give it everywhere in the triangle.
    """
    width, height = _SIZE
    depth = np.zeros((height, width))
    nearest = np.full((height, width), -1, dtype=np.int64)
    seen = (triangles - camera.p) @ camera.R.T
    away = -seen[..., 2]
    pixels = _FOCAL * (height / 2.0) * seen[..., :2] / away[..., None]
    xy = pixels * [1.0, -1.0] + [width / 2.0, height / 2.0]
    edge1, edge2 = xy[:, 1] - xy[:, 0], xy[:, 2] - xy[:, 0]
    area = edge1[:, 0] * edge2[:, 1] - edge1[:, 1] * edge2[:, 0]
    low = np.maximum(np.floor(xy.min(axis=1)).astype(int), 0)
    high = np.minimum(np.ceil(xy.max(axis=1)).astype(int) + 1, [width, height])
    # Counter-clockwise from outside is clockwise where y points down: the rest shows its back.
    front = (area < 0.0) & (away.min(axis=1) > 0.05) & np.all(low < high, axis=1)
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
    return _Raster(depth, nearest)


def _shaded(
    view: View, triangles: FloatArray, owner: IntArray, camera: _Camera, raster: _Raster
) -> FloatArray:
    """Return the colours of all pixels, shape (height, width, 3)."""
    hit = raster.triangle >= 0
    image = np.empty((*hit.shape, 3))
    image[~hit] = _floor(camera, np.argwhere(~hit))
    number = raster.triangle[hit]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    towards = normals @ camera.R.T
    light = np.full(len(triangles), _AMBIENT)
    for direction, strength in _LIGHTS:
        light += strength * np.maximum(towards @ (direction / np.linalg.norm(direction)), 0.0)
    # Goals are signs, not things: their colours are those of the legend, whatever way they face.
    is_sign = np.array([solid.kind in _GOALS for solid in view.solids])
    light[is_sign[owner]] = 1.0
    base = np.array([to_rgb(solid.kind.colour) for solid in view.solids])
    image[hit] = np.clip(base[owner[number]] * light[number][:, None], 0.0, 1.0)
    image[_edges(owner, towards, raster)] *= 0.45
    return image


def _edges(owner: IntArray, normals: FloatArray, raster: _Raster) -> NDArray[np.bool_]:
    """Return the pixels at which another solid begins, shape (height, width).

    Where two solids share a surface, rounding decides pixel by pixel which of them is seen; there
    is no edge to be seen there.
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
            # Where nothing is, something is far away.
            away = 1.0 / np.maximum(raster.depth[at], 1e-3)
            apart += sign * _rays(pixels) * away[:, None]
        off = np.einsum("ij,ij->i", normal[0], apart)
        bend = np.einsum("ij,ij->i", normal[0], normal[1])
        is_one_surface = (np.abs(off) < _SAME_PLANE) & (bend > _SAME_WAY)
        edge[tuple(here[~is_one_surface].T)] = True
    return edge


def _rays(pixels: IntArray) -> FloatArray:
    """Return what pixels look along, in the camera's axes, shape (n, 3).

    Args:
        pixels: Row and column of each, shape (n, 2).
    """
    middle = np.array([_SIZE[1], _SIZE[0]]) / 2.0
    up_right = (pixels + 0.5 - middle) * [-1.0, 1.0] / (_FOCAL * middle[0])
    return np.column_stack([up_right[:, 1], up_right[:, 0], np.full(len(pixels), -1.0)])


def _floor(camera: _Camera, pixels: IntArray) -> FloatArray:
    """Return the colours of the empty floor, with a line every half metre, shape (n, 3).

    Args:
        camera: The camera.
        pixels: Row and column of each pixel, shape (n, 2).
    """
    rays = _rays(pixels) @ camera.R
    down = -rays[:, 2]
    reach = camera.p[2] / np.maximum(down, 1e-6)
    spots = camera.p[:2] + reach[:, None] * rays[:, :2]
    # A line is as wide as a pixel is on the floor there, but never less than 8 mm.
    half = np.maximum(0.004, 1.2 * reach / (_FOCAL * _SIZE[1] / 2.0))
    off = np.abs(np.mod(spots + 0.25, 0.5) - 0.25).min(axis=1)
    colours = np.where((off < half)[:, None], _LINE, _FLOOR)
    fade = np.clip((reach - 5.0) / 3.0, 0.0, 1.0)[:, None]
    return np.asarray(np.where(down[:, None] > 0.0, colours * (1 - fade) + _SKY * fade, _SKY))

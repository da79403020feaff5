"""Cover a surface with boxes and capsules that protrude little.

Triangles are cut into pieces, and every piece lies wholly inside one of the shapes, so that the
triangles lie inside their union.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from tcs.model.robots.cutting import cut
from tcs.model.robots.fitting.bounding import (
    best_candidate,
    enclose,
    enclose_axis,
    hull_corners,
    hull_volume,
    tightest_orientation,
)
from tcs.model.robots.fitting.filling import fillers
from tcs.model.robots.fitting.growth import boxes_in, capsules_in
from tcs.model.robots.fitting.solid import Solid, solid_of
from tcs.model.robots.primitives import Primitive, union_volume

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_SEED = 0
_SEEDS = 300
"""Boxes that are grown along each set of axes."""
_CAPSULES = 600
"""Capsules that are tried."""
_PER_PROTRUSION = 2.5
"""Points of the grid per protrusion, at least; large bodies have fewer."""
_ACROSS = 160
"""Most points of the grid along a body."""
_PIECE = 0.006
"""Longest edge of a piece [m], if the grid is finer than half of it."""
_CHOOSING = 4_000
"""Most pieces by which the shapes are chosen; all are enclosed in the end."""
_COVERED = 0.99
"""Fraction of those pieces at which no further shape is added: the nearest one grows."""
_ROUNDS = 4
"""Rounds of shapes that grow from what those before leave bare."""
_DEEP = 0.012
"""Depth [m] from which on the inside has to be covered too, and least spacing of points there."""
_SPACINGS = 20
"""Most points inside along a body."""
_INSIDE_WEIGHT = 0.05
"""Weight of a point inside, that of a piece of the surface being 1."""
_SLACK = 0.25
"""Mean protrusion of a single shape, as a fraction of the greatest allowed, that needs no more."""


@dataclass(frozen=True, slots=True)
class Target:
    """Closeness of a fit.

    Attributes:
        protrusion: Distance by which shapes may protrude from the surface [m]. If `max_shapes` do
            not suffice, some protrude farther.
        max_shapes: Largest number of shapes on one body; a few more may fill its inside.
        patches: Largest number of shapes added where those leave the surface bare; only what is
            bare after that makes shapes grow.
    """

    protrusion: float
    max_shapes: int
    patches: int = 0


@dataclass(frozen=True, slots=True)
class Fit:
    """Primitives around one body, with their volume and that of its hull.

    Attributes:
        primitives: Shapes that together enclose every triangle.
        hull: Volume of the convex hull of the triangles [m^3].
        union: Volume of the primitives together [m^3].
    """

    primitives: tuple[Primitive, ...]
    hull: float
    union: float

    @property
    def excess(self) -> float:
        """Volume of the union over that of the hull."""
        return self.union / self.hull


def fit_triangles(body: str, triangles: FloatArray, target: Target) -> Fit:
    """Return primitives that enclose every triangle closely.

    Boxes and capsules grow inside the surface until they protrude as far as the target allows. Of
    thousands of them, the one that covers most of what is left of the surface is added until
    nothing is left or the number is reached. Each is then reduced to what it alone encloses.

    Args:
        body: Name of the body.
        triangles: Corners in its frame [m], shape (n, 3, 3).
        target: Closeness of the fit.
    """
    corners = np.unique(triangles.reshape(-1, 3), axis=0)
    points, hull = hull_corners(corners), hull_volume(triangles)
    single = best_candidate(points, np.eye(3)[None])
    shapes = [enclose(body, points, single.kind, single.R)]
    if _mean_protrusion(points, single.volume - hull) > _SLACK * target.protrusion:
        shapes = _covering(body, triangles, points, target)
    shapes += fillers(body, tuple(shapes), triangles)
    return Fit(primitives=tuple(shapes), hull=hull, union=union_volume(shapes))


def _mean_protrusion(points: FloatArray, excess: float) -> float:
    """Return an excess volume [m^3] over the area of a hull [m]; 0 for flat parts."""
    try:
        return excess / float(ConvexHull(points).area)
    except QhullError:
        return 0.0


def _covering(
    body: str, triangles: FloatArray, points: FloatArray, target: Target
) -> list[Primitive]:
    """Return shapes that cover a surface with the given corners of its hull."""
    rng = np.random.default_rng(_SEED)
    size = float(np.ptp(points, axis=0).max())
    pitch = max(target.protrusion / _PER_PROTRUSION, size / _ACROSS)
    solid = solid_of(triangles, pitch, target.protrusion)
    pieces = cut(triangles, max(_PIECE, 2 * pitch))
    inside = solid.points(solid.depth > max(_DEEP, 4 * pitch))
    inside = _thinned(inside, max(_DEEP, size / _SPACINGS))
    sample = _sample(pieces, max(_PIECE, 2 * pitch), rng)
    candidates = _Candidates(body, solid, target.protrusion, points, sample, inside, rng)
    shapes = candidates.chosen(target.max_shapes)
    if target.patches:
        shapes += _patches(body, solid, target, points, pieces, shapes, rng)
    return _reduced(body, shapes, pieces, inside)


def _patches(
    body: str,
    solid: Solid,
    target: Target,
    hull: FloatArray,
    pieces: FloatArray,
    shapes: list[Primitive],
    rng: np.random.Generator,
) -> list[Primitive]:
    """Return shapes that grow from pieces of the surface that others do not contain."""
    bare = pieces[~_contain(shapes, pieces)]
    found: list[Primitive] = []
    for _ in range(_ROUNDS):
        if not len(bare) or len(found) == target.patches:
            break
        some = bare if len(bare) <= _CHOOSING else rng.choice(bare, _CHOOSING, replace=False)
        grown = _Candidates(body, solid, target.protrusion, hull, some, np.empty((0, 3)), rng)
        new = grown.chosen(target.patches - len(found))
        bare, found = bare[~_contain(new, bare)], found + new
    return found


def _contain(shapes: list[Primitive], pieces: FloatArray) -> BoolArray:
    """Return which pieces lie wholly in one of the shapes, shape (n,)."""
    within = np.zeros(len(pieces), np.bool_)
    for shape in shapes:
        within |= shape.contains(pieces.reshape(-1, 3)).reshape(-1, 3).all(axis=1)
    return within


def _sample(pieces: FloatArray, length: float, rng: np.random.Generator) -> FloatArray:
    """Return at most a given number of pieces, evenly spread over the surface."""
    cells = np.floor(pieces.mean(axis=1) / (0.7 * length)).astype(np.int64)
    chosen = np.unique(cells, axis=0, return_index=True)[1]
    if len(chosen) > _CHOOSING:
        chosen = rng.choice(chosen, _CHOOSING, replace=False)
    return np.asarray(pieces[chosen])


def _thinned(points: FloatArray, spacing: float) -> FloatArray:
    """Return one point of each cell of a grid, shape (m, 3)."""
    cells = np.floor(points / spacing).astype(np.int64)
    return np.asarray(points[np.unique(cells, axis=0, return_index=True)[1]])


class _Candidates:
    """Shapes within a solid, and which pieces of the surface and points inside each contains."""

    def __init__(
        self,
        body: str,
        solid: Solid,
        protrusion: float,
        hull: FloatArray,
        pieces: FloatArray,
        inside: FloatArray,
        rng: np.random.Generator,
    ) -> None:
        self._body = body
        self._pieces = len(pieces)
        self._points = np.concatenate([pieces.reshape(-1, 3), inside])
        self._weights = np.repeat([1.0, _INSIDE_WEIGHT], [len(pieces), len(inside)])
        seeds = np.concatenate([pieces.mean(axis=1), inside])
        self._boxes: list[tuple[FloatArray, FloatArray]] = []
        covered = []
        for R in _orientations(hull):
            drawn = seeds[rng.choice(len(seeds), _SEEDS)]
            ends = boxes_in(solid, protrusion, R, drawn, rng)
            self._boxes += [(R, box) for box in ends]
            covered.append(self._in_boxes(R, ends))
        self._capsules = list(zip(*capsules_in(solid, protrusion, _CAPSULES, rng), strict=True))
        covered.append(self._in_capsules())
        self._covered = np.concatenate(covered)

    def chosen(self, most: int) -> list[Primitive]:
        """Return the shapes that cover most, each what those before it leave."""
        items, weights = self._covered.shape[1], self._weights.astype(np.float32)
        left = np.ones(items, np.bool_)
        gain = self._covered.astype(np.float32) @ weights
        # Rows of items: what a shape covers is subtracted from the others' gain.
        by_item = self._covered.T.copy()
        shapes: list[Primitive] = []
        while len(shapes) < most and left[: self._pieces].mean() > 1 - _COVERED:
            best = int(np.argmax(gain))
            new = self._covered[best] & left
            if not new.any():
                break
            shapes.append(self._shape(best))
            left &= ~new
            gain -= weights[new] @ by_item[new].astype(np.float32)
        return shapes

    def _shape(self, index: int) -> Primitive:
        if index < len(self._boxes):
            R, ends = self._boxes[index]
            corners = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
            return enclose(self._body, corners @ R.T, "box", R)
        first, last, radius = self._capsules[index - len(self._boxes)]
        return enclose_axis(self._body, first, last, float(radius))

    def _in_boxes(self, R: FloatArray, ends: FloatArray) -> BoolArray:
        """Return what boxes with given axes and ends contain, shape (boxes, items)."""
        seen, ends = (self._points @ R).astype(np.float32), ends.astype(np.float32)
        corners = 3 * self._pieces
        a, b, c = (seen[k:corners:3] for k in range(3))
        # By coordinate: NumPy is slow along an axis of three.
        low = np.concatenate([np.minimum(np.minimum(a, b), c), seen[corners:]]).T.copy()
        high = np.concatenate([np.maximum(np.maximum(a, b), c), seen[corners:]]).T.copy()
        found = np.ones((len(ends), len(self._weights)), np.bool_)
        for within, (least, greatest) in zip(found, ends, strict=True):
            for k in range(3):
                within &= low[k] >= least[k]
                within &= high[k] <= greatest[k]
        return found

    def _in_capsules(self) -> BoolArray:
        found = []
        for first, last, radius in self._capsules:
            along, out = last - first, self._points - first
            square = float(along @ along)
            t = np.clip(out @ along / square, 0.0, 1.0) if square else np.zeros(len(out))
            away = out - t[:, None] * along
            found.append(self._items(np.einsum("ni,ni->n", away, away) <= radius**2))
        return np.array(found, np.bool_).reshape(-1, len(self._weights))

    def _items(self, contained: BoolArray) -> BoolArray:
        """Return which pieces and points inside are contained, given their corners."""
        corners = 3 * self._pieces
        whole = contained[:corners].reshape(-1, 3).all(axis=1)
        return np.concatenate([whole, contained[corners:]])


def _orientations(points: FloatArray) -> FloatArray:
    """Return axes to try: those of the body, of its smallest box, and rotated ones."""
    found = []
    for R, angles in ((np.eye(3), range(0, 90, 15)), (tightest_orientation(points), (0, 30, 60))):
        for axis in "xyz":
            rotated = Rotation.from_euler(axis, np.array(angles)[:, None], degrees=True).as_matrix()
            found += list(R @ (rotated if axis == "x" else rotated[1:]))
    return np.stack(found)


def _reduced(
    body: str, shapes: list[Primitive], pieces: FloatArray, inside: FloatArray
) -> list[Primitive]:
    """Return shapes that together contain everything, each reduced to what no other one contains.

    A piece that no shape contains goes to the nearest one, which grows.
    """
    corners = pieces.reshape(-1, 3)

    def contained(shape: Primitive) -> BoolArray:
        whole = shape.contains(corners).reshape(-1, 3).all(axis=1)
        return np.concatenate([whole, shape.contains(inside)])

    within = np.stack([contained(shape) for shape in shapes])
    bare = np.flatnonzero(~within[:, : len(pieces)].any(axis=0))
    if len(bare):
        away = np.stack([shape.distance(pieces[bare]).max(axis=1) for shape in shapes])
        within[away.argmin(axis=0), bare] = True
    current: dict[int, Primitive] = dict(enumerate(shapes))
    # The smallest first, so that they are dropped rather than large ones reduced.
    for k in sorted(current, key=lambda k: shapes[k].volume):
        alone = within[k] & ~within[[j for j in current if j != k]].any(axis=0)
        points = np.concatenate(
            [pieces[alone[: len(pieces)]].reshape(-1, 3), inside[alone[len(pieces) :]]]
        )
        if not len(points):
            del current[k]
            continue
        current[k] = _around(body, shapes[k], points)
        within[k] = contained(current[k])
    return list(current.values())


def _around(body: str, shape: Primitive, points: FloatArray) -> Primitive:
    """Return a box reduced to points, or a capsule grown to contain them."""
    if shape.kind == "box":
        return enclose(body, hull_corners(np.unique(points, axis=0)), "box", shape.rotation)
    beyond = float(shape.distance(points).max())
    return shape.shrunk(-np.ceil(beyond * 1e6 + 1) * 1e-6) if beyond > 0 else shape

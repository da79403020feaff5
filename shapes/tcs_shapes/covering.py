"""Cover a surface with boxes and capsules that protrude little.

Triangles are cut into pieces, and every piece lies wholly inside one of the shapes, so that the
triangles lie inside their union.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from tcs.model.robots.primitives import Primitive, union_volume
from tcs.model.robots.triangles import cut, distinct
from tcs_shapes.bounding import (
    best_candidate,
    capsule_volume,
    enclose,
    enclose_axis,
    hull_corners,
    hull_volume,
    tightest_orientation,
)
from tcs_shapes.containment import (
    RoundedBox,
    chosen_covers,
    contains_pieces,
    contains_points,
    farthest_of_pieces,
    in_boxes,
    in_capsules,
)
from tcs_shapes.solids import (
    Solid,
    boxes_in,
    capsules_in,
    extremes,
    fillers,
    solid_of,
    solid_within,
)

FloatArray = NDArray[np.float64]

SEED = 0
PER_PROTRUSION = 2.5
"""Points of the grid per protrusion, at least; large bodies have fewer."""
ACROSS = 160
"""Most points of the grid along a body."""
PIECE = 0.006
"""Longest edge of a piece [m], if the grid is finer than half of it."""
DEEP = 0.012
"""Depth [m] from which on the inside has to be covered too, and least spacing of points there."""
SPACINGS = 20
"""Most points inside along a body."""
_DRAWS = 3
"""Choices of shapes, of which the one of the least volume is taken: it varies by some per cent."""
_SLACK = 0.25
"""Mean protrusion of a single shape, as a fraction of the greatest allowed, that needs no more."""
BoolArray = NDArray[np.bool_]

_TOUCH = 1e-6
"""Growth of the box around a shape [m] that tells which pieces are far from it."""

_SEEDS = 300
"""Boxes that are grown along each set of axes."""
_CAPSULES = 600
"""Capsules that are tried."""
_CHOOSING = 4_000
"""Most pieces by which the shapes are chosen; all are enclosed in the end."""
_COVERED = 0.99
"""Fraction of those pieces at which no further shape is added: the nearest one grows."""
_PART = 0.7
"""Fraction of the candidates from which a further draw chooses."""
_ROUNDS = 4
"""Rounds of shapes that grow from what those before leave bare."""
_PIECE_WEIGHT = 20
"""Weight of a piece of the surface, that of a point inside being 1."""

_ACROSS = 320
"""Most points of the grid along a part."""


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
    corners, _ = distinct(triangles.reshape(-1, 3))
    points, hull = hull_corners(corners), hull_volume(triangles)
    tight = tightest_orientation(points)
    single = best_candidate(points, np.stack([tight, np.eye(3)]))
    shapes = [enclose(body, points, single.kind, single.R)]
    if _mean_protrusion(points, single.volume - hull) > _SLACK * target.protrusion:
        # Without any, a long, thin part has nothing inside that is as wide as the voxels.
        shapes = _covering(body, triangles, points, tight, target) or shapes
    shapes += fillers(body, tuple(shapes), triangles)
    return Fit(primitives=tuple(shapes), hull=hull, union=union_volume(shapes))


def _mean_protrusion(points: FloatArray, excess: float) -> float:
    """Return an excess volume [m^3] over the area of a hull [m]; 0 for flat parts."""
    try:
        return excess / float(ConvexHull(points).area)
    except QhullError:
        return 0.0


def _covering(
    body: str, triangles: FloatArray, points: FloatArray, tight: FloatArray, target: Target
) -> list[Primitive]:
    """Return shapes that cover a surface, given its hull's corners and tightest box; maybe none."""
    rng = np.random.default_rng(SEED)
    size = float(np.ptp(points, axis=0).max())
    pitch = max(target.protrusion / PER_PROTRUSION, size / ACROSS)
    solid = solid_of(triangles, pitch, target.protrusion)
    pieces = cut(triangles, max(PIECE, 2 * pitch))
    inside = solid.points(solid.depth > max(DEEP, 4 * pitch))
    inside = thinned(inside, max(DEEP, size / SPACINGS))
    some, tried = sample(pieces, max(PIECE, 2 * pitch), rng), orientations(tight)
    candidates = Candidates(body, solid, target.protrusion, tried, some, inside, rng)
    found = []
    for draw in range(_DRAWS):
        shapes = candidates.chosen(target.max_shapes, draw)
        if target.patches:
            bare = pieces[~contain(shapes, pieces)]
            shapes += patches(body, solid, target.protrusion, target.patches, tried, bare, rng)
        if shapes:
            found.append(reduced(body, shapes, pieces, inside))
    return min(found, key=union_volume, default=[])


def rounded_box(shape: Primitive) -> RoundedBox:
    """Return a shape as the kernel reads it."""
    half, radius = np.array(shape.size) / 2, 0.0
    if shape.kind != "box":
        radius = shape.size[0]
        half = np.array([0.0, 0.0, shape.size[1] / 2 if shape.kind == "capsule" else 0.0])
    return RoundedBox(half=half, radius=radius, R=shape.rotation, p=np.array(shape.xyz))


def contain(shapes: list[Primitive], pieces: FloatArray) -> BoolArray:
    """Return which pieces, shape (n, 3, 3), lie wholly in one of the shapes, shape (n,)."""
    within = np.zeros(len(pieces), np.bool_)
    for shape in shapes:
        within |= contained(shape, pieces)
    return within


def contained(shape: Primitive, pieces: FloatArray) -> BoolArray:
    """Return which pieces lie wholly in a shape, shape (n,)."""
    return np.asarray(contains_pieces(rounded_box(shape), np.ascontiguousarray(pieces)))


class SortedPieces:
    """Pieces of a surface by their place along it: of most shapes, only a part of them is near."""

    def __init__(self, pieces: FloatArray) -> None:
        """Sort pieces.

        Args:
            pieces: Corners of the pieces [m], shape (n, 3, 3).
        """
        first = pieces[:, 0]
        self._axis = int(np.argmax(np.ptp(first, axis=0))) if len(first) else 0
        order = np.argsort(first[:, self._axis], kind="stable")
        self.corners: FloatArray = pieces[order]
        """Corners of the pieces in their order [m], shape (n, 3, 3)."""
        self._places = first[order, self._axis]

    def within(self, shape: Primitive) -> BoolArray:
        """Return which pieces lie wholly in a shape, shape (n,)."""
        ends = shape.bounds[:, self._axis] + np.array([-_TOUCH, _TOUCH])
        near = slice(*np.searchsorted(self._places, ends).tolist())
        found = np.zeros(len(self.corners), np.bool_)
        found[near] = contained(shape, self.corners[near])
        return found


def reduced(
    body: str,
    shapes: list[Primitive],
    pieces: FloatArray,
    inside: FloatArray,
    *,
    boxed: bool = False,
) -> list[Primitive]:
    """Return shapes that together contain everything, each reduced to what no other one contains.

    A piece that no shape contains goes to the nearest one, which grows.

    Args:
        body: Name of the body.
        shapes: The shapes.
        pieces: Corners of the pieces of its surface [m], shape (n, 3, 3).
        inside: Points inside to be contained [m], shape (m, 3).
        boxed: Whether a box may take the place of a capsule that contains little alone.
    """
    placed = SortedPieces(pieces)
    pieces = placed.corners

    def holds(shape: Primitive) -> BoolArray:
        return np.concatenate([placed.within(shape), contains_points(rounded_box(shape), inside)])

    within = np.stack([holds(shape) for shape in shapes])
    bare = np.flatnonzero(~within[:, : len(pieces)].any(axis=0))
    if len(bare):
        away = np.stack([farthest_of_pieces(rounded_box(s), pieces[bare]) for s in shapes])
        within[away.argmin(axis=0), bare] = True
    current: dict[int, Primitive] = dict(enumerate(shapes))
    count = within.sum(axis=0, dtype=np.int16)
    # The smallest first, so that they are dropped rather than large ones reduced.
    for k in sorted(current, key=lambda k: shapes[k].volume):
        alone = within[k] & (count == 1)
        count -= within[k]
        points = np.concatenate(
            [pieces[alone[: len(pieces)]].reshape(-1, 3), inside[alone[len(pieces) :]]]
        )
        if not len(points):
            del current[k]
            continue
        current[k] = _around(body, shapes[k], points)
        if boxed and shapes[k].kind == "capsule":
            box = enclose(body, points, "box", shapes[k].rotation)
            current[k] = min(current[k], box, key=lambda shape: shape.volume)
        within[k] = holds(current[k])
        count += within[k]
    return list(current.values())


def _around(body: str, shape: Primitive, points: FloatArray) -> Primitive:
    """Return a box reduced to points, or a capsule grown to contain them."""
    if shape.kind == "box":
        return enclose(body, points, "box", shape.rotation)
    beyond = float(shape.distance(points).max())
    return shape.shrunk(-np.ceil(beyond * 1e6 + 1) * 1e-6) if beyond > 0 else shape


class Candidates:
    """Shapes within a solid, and which pieces of the surface and points inside each contains."""

    def __init__(
        self,
        body: str,
        solid: Solid,
        protrusion: float,
        orientations: FloatArray,
        pieces: FloatArray,
        inside: FloatArray,
        rng: np.random.Generator,
        capsules: bool = True,
    ) -> None:
        """Grow boxes along each of some axes, and capsules, from pieces and points inside."""
        self._body = body
        self._pieces = len(pieces)
        self._points = np.concatenate([pieces.reshape(-1, 3), inside])
        self._weights = np.repeat([_PIECE_WEIGHT, 1], [len(pieces), len(inside)])
        seeds = np.concatenate([pieces.mean(axis=1), inside])
        self._boxes: list[tuple[FloatArray, FloatArray]] = []
        covered, volumes, corners = [], [], extremes(solid, protrusion)
        for R in orientations:
            drawn = seeds[rng.choice(len(seeds), _SEEDS)]
            ends = boxes_in(solid, protrusion, corners, R, drawn, rng)
            self._boxes += [(R, box) for box in ends]
            volumes.append((ends[:, 1] - ends[:, 0]).prod(axis=1))
            covered.append(self._in_boxes(R, ends))
        tried = _CAPSULES if capsules else 0
        self._capsules = list(zip(*capsules_in(solid, protrusion, tried, rng), strict=True))
        covered.append(self._in_capsules())
        self._covered = np.concatenate(covered)
        volumes += [
            np.array([capsule_volume(radius, float(np.linalg.norm(last - first)))])
            for first, last, radius in self._capsules
        ]
        self._order = np.argsort(np.concatenate(volumes), kind="stable")

    def chosen(self, most: int, draw: int = 0) -> list[Primitive]:
        """Return the shapes that cover most, each what those before it leave, or the smallest.

        Args:
            most: Largest number of shapes.
            draw: 0 for all candidates; others choose from a part of them, each from its own.
        """
        left_out, order = int((1 - _COVERED) * self._pieces), self._order
        if draw:
            order = order[np.random.default_rng(draw).random(len(order)) < _PART]
        best = chosen_covers(self._covered, order, self._weights, self._pieces, most, left_out)
        return [self._shape(index) for index in best.tolist()]

    def _shape(self, index: int) -> Primitive:
        if index < len(self._boxes):
            R, ends = self._boxes[index]
            corners = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
            return enclose(self._body, corners @ R.T, "box", R)
        first, last, radius = self._capsules[index - len(self._boxes)]
        return enclose_axis(self._body, first, last, float(radius))

    def _in_boxes(self, R: FloatArray, ends: FloatArray) -> BoolArray:
        """Return what boxes with given axes and ends contain, shape (boxes, items)."""
        seen = (self._points @ R).astype(np.float32)
        corners = 3 * self._pieces
        a, b, c = (seen[k:corners:3] for k in range(3))
        # By coordinate: NumPy is slow along an axis of three.
        low = np.concatenate([np.minimum(np.minimum(a, b), c), seen[corners:]])
        high = np.concatenate([np.maximum(np.maximum(a, b), c), seen[corners:]])
        return in_boxes(ends.astype(np.float32), low, high)

    def _in_capsules(self) -> BoolArray:
        """Return what capsules contain, shape (capsules, items)."""
        ends = np.array([capsule[:2] for capsule in self._capsules]).reshape(-1, 2, 3)
        radii = np.array([capsule[2] for capsule in self._capsules], np.float64)
        corners = 3 * self._pieces
        pieces = self._points[:corners].reshape(-1, 3, 3)
        return in_capsules(ends, radii, pieces, self._points[corners:])


def orientations(tight: FloatArray) -> FloatArray:
    """Return axes to try: those of the body, of its smallest box, and rotated ones.

    Args:
        tight: Those of its smallest box, shape (3, 3).
    """
    return np.concatenate([turned(np.eye(3), range(0, 90, 15)), turned(tight, (0, 30, 60))])


def turned(R: FloatArray, angles: Sequence[int], about: str = "xyz") -> FloatArray:
    """Return axes turned about each of them by angles [deg] of which the first is 0."""
    found = [R[None]]
    for axis in about:
        turns = Rotation.from_euler(axis, np.array(angles[1:])[:, None], degrees=True)
        found.append(R @ turns.as_matrix())
    return np.concatenate(found)


def patches(
    body: str,
    solid: Solid,
    protrusion: float,
    most: int,
    orientations: FloatArray,
    bare: FloatArray,
    rng: np.random.Generator,
    capsules: bool = True,
) -> list[Primitive]:
    """Return shapes that grow from pieces of the surface that others leave bare."""
    found: list[Primitive] = []
    for _ in range(_ROUNDS):
        if not len(bare) or len(found) == most:
            break
        some = bare if len(bare) <= _CHOOSING else rng.choice(bare, _CHOOSING, replace=False)
        grown = Candidates(
            body, solid, protrusion, orientations, some, np.empty((0, 3)), rng, capsules
        )
        new = grown.chosen(most - len(found))
        bare, found = bare[~contain(new, bare)], found + new
    return found


def sample(pieces: FloatArray, length: float, rng: np.random.Generator) -> FloatArray:
    """Return at most a given number of pieces, evenly spread over the surface."""
    cells = np.floor(pieces.mean(axis=1) / (0.7 * length)).astype(np.int64)
    chosen = _one_of_each(cells)
    if len(chosen) > _CHOOSING:
        chosen = rng.choice(chosen, _CHOOSING, replace=False)
    return np.asarray(pieces[chosen])


def thinned(points: FloatArray, spacing: float) -> FloatArray:
    """Return one point of each cell of a grid, shape (m, 3)."""
    cells = np.floor(points / spacing).astype(np.int64)
    return np.asarray(points[_one_of_each(cells)])


def _one_of_each(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the first row of each cell, in the order of the cells, which have shape (n, 3)."""
    if not len(cells):
        return np.empty(0, np.int64)
    cells = cells - cells.min(axis=0)
    numbers = np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1))
    return np.asarray(np.unique(numbers, return_index=True)[1])


@dataclass(frozen=True, slots=True)
class Part:
    """The surface of a body between two corners, which is fitted with shapes of its own.

    Attributes:
        low: Least coordinates in the frame of the body [m].
        high: Greatest coordinates [m].
        protrusion: Distance by which shapes may protrude from the surface [m], as in `Target`.
        max_shapes: Largest number of shapes.
        patches: Largest number of shapes added where those leave the part bare; only what is bare
            after that makes shapes grow.
        axes: Axes of the body about which boxes may be turned, such as "xyz".
        capsules: Whether shapes may be capsules. Their caps protrude from flat ends.
    """

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    protrusion: float
    max_shapes: int
    patches: int = 0
    axes: str = "xyz"
    capsules: bool = True


def refit_part(
    body: str, triangles: FloatArray, shapes: tuple[Primitive, ...], part: Part
) -> tuple[Primitive, ...]:
    """Return shapes that enclose every triangle, one part of the surface fitted again.

    The shapes that a body has are reduced to what those of the part leave.

    Args:
        body: Name of the body.
        triangles: Corners in its frame [m], shape (n, 3, 3).
        shapes: Shapes that enclose the triangles.
        part: The part, and how closely it is fitted.
    """
    rng = np.random.default_rng(SEED)
    low, high = np.array(part.low), np.array(part.high)
    size = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    whole = solid_of(triangles, max(part.protrusion / PER_PROTRUSION, size / ACROSS), 0.0)
    pieces = cut(triangles, PIECE)
    own = pieces[((pieces >= low) & (pieces <= high)).all(axis=(1, 2))]
    across = float(np.ptp(own.reshape(-1, 3), axis=0).max()) / _ACROSS
    pitch = max(part.protrusion / PER_PROTRUSION, across)
    solid = solid_within(whole, triangles, low, high, pitch, part.protrusion)
    axes, nothing = turned(np.eye(3), range(0, 90, 15), part.axes), np.empty((0, 3))
    some = sample(own, PIECE, rng)
    grown = Candidates(body, solid, part.protrusion, axes, some, nothing, rng, part.capsules)
    new = grown.chosen(part.max_shapes)
    bare, most = own[~contain(new, own)], part.max_shapes - len(new) + part.patches
    new += patches(body, solid, part.protrusion, most, axes, bare, rng, part.capsules)
    new = reduced(body, new, own, nothing)
    inside = whole.points(whole.depth > max(DEEP, 4 * whole.pitch))
    inside = thinned(inside, max(DEEP, size / SPACINGS))
    for shape in new:
        inside = inside[~shape.contains(inside)]
    rest = pieces[~contain(new, pieces)]
    new += reduced(body, list(shapes), rest, inside, boxed=True)
    return (*new, *fillers(body, tuple(new), triangles))

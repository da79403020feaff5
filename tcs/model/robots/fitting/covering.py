"""Cover a surface with boxes and capsules that protrude little.

Triangles are cut into pieces, and every piece lies wholly inside one of the shapes, so that the
triangles lie inside their union.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from tcs.model.robots.cutting import cut, distinct
from tcs.model.robots.fitting.bounding import (
    best_candidate,
    enclose,
    hull_corners,
    hull_volume,
    tightest_orientation,
)
from tcs.model.robots.fitting.candidates import (
    Candidates,
    orientations,
    patches,
    sample,
    thinned,
)
from tcs.model.robots.fitting.filling import fillers
from tcs.model.robots.fitting.reduction import contain, reduced
from tcs.model.robots.fitting.solid import solid_of
from tcs.model.robots.primitives import Primitive, union_volume

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

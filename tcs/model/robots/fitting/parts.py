"""Parts of a body that are fitted more closely than the rest of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.model.robots.cutting import cut
from tcs.model.robots.fitting.candidates import Candidates, patches, sample, thinned, turned
from tcs.model.robots.fitting.covering import ACROSS, DEEP, PER_PROTRUSION, PIECE, SEED, SPACINGS
from tcs.model.robots.fitting.filling import fillers
from tcs.model.robots.fitting.reduction import contain, reduced
from tcs.model.robots.fitting.solid import solid_of, solid_within
from tcs.model.robots.primitives import Primitive

FloatArray = NDArray[np.float64]

_ACROSS = 320
"""Most points of the grid along a part."""


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

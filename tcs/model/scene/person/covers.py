"""Shapes of a resized person: what encloses a link's shapes when the link is stretched.

A link of another person is that of the papers' man stretched along its axes, S = diag(scale). The
skin of the papers' man is within the padding P of a shape K: within K + ball(P), their Minkowski
sum. That of the other person is then within S K + S ball(P). `cover` returns boxes and capsules
that, with the padding of `padding_for`, enclose this body: proved below, not sampled.
"""

from __future__ import annotations

import math

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.model.people import Scale
from tcs.model.scene.person.shapes import LinkShape

WIDE = 0.03
"""Radius of a capsule from which it may be covered by two [m]."""
_THINNEST = 1e-4
"""Least length of a capsule between the centres of its caps [m]: it stays a capsule."""
_STRAIGHT = 1e-6
"""Greatest change of a unit vector along an axis that is rounding of the model file."""


def padding_for(padding: float, scale: Scale) -> float:
    """Return the padding of a stretched link [m], at most that of the papers' man.

    Args:
        padding: That of the papers' man [m].
        scale: How the link is stretched.
    """
    return padding * min(1.0, *scale)


def parts_of(shape: LinkShape, *, is_uneven: bool) -> int:
    """Return the number of shapes that cover a shape of a link, whoever the person is.

    Args:
        shape: The shape.
        is_uneven: Whether depth and breadth of the link are of different measures, so that a
            capsule on it becomes elliptic.
    """
    return 2 if is_uneven and not shape.is_box and shape.size[0] > WIDE else 1


def cover(shape: LinkShape, scale: Scale, padding: float, parts: int = 1) -> tuple[LinkShape, ...]:
    """Return shapes that with their padding enclose a shape and its skin, stretched.

    Args:
        shape: A shape K of the papers' man.
        scale: How its link is stretched along x, y and z.
        padding: How far the skin of the papers' man may stand out of it [m].
        parts: Number of shapes, 1 or for a capsule 2, side by side.

    Returns:
        The shapes, to be padded by `padding_for`. For the papers' man it is the shape itself,
        `parts` times.
    """
    if scale == (1.0, 1.0, 1.0):
        return (shape,) * parts
    if shape.is_box:
        return (_box(shape, np.array(scale), padding),)
    return _capsules(shape, np.array(scale), padding, parts)


def _box(shape: LinkShape, scale: FloatArray, padding: float) -> LinkShape:
    """Return the box with edges in the same directions around a stretched box.

    Let p be the new padding and N = P S - p I, which has no negative entry. The skin stands out of
    S K along a unit vector d by |P S d| <= p + |N d| <= p + sum_i |d_i| |N r_i|, with r_i the edges
    of the box and d_i = d . r_i: a box that is larger by |N r_i| to either side, padded by p,
    encloses it.
    """
    R = shape.R_LS
    stretched = np.abs(R.T @ (scale[:, None] * R)) @ shape.size
    N = padding * scale - padding_for(padding, tuple(scale))
    size = stretched + np.linalg.norm(N[:, None] * R, axis=0)
    return LinkShape(True, size, R, scale * shape.p_LoSo_L)


def _capsules(
    shape: LinkShape, scale: FloatArray, padding: float, parts: int
) -> tuple[LinkShape, ...]:
    """Return one or two capsules around a stretched capsule.

    K + ball(P) is a segment + ball(r + P); stretched, it is the mapped segment + an ellipsoid with
    half axes (r + P) S along the axes of the link. With i the axis nearest to the segment, L its
    half axis, and T1 >= T2 the others, each half of the ellipsoid on either side of T1 = 0 lies in
    a ball around a point c = (T1^2 - B^2) / (2 T1) along T1, of radius (T1^2 + B^2) / (2 T1), if
    T1 >= B >= T2, L: the distance from the point is a convex function of the cosine along T1, with
    its greatest value at the ends, where it is the radius. A longer half axis L is as one of B with
    the centres moved by up to e = L - B to either side along i: the segment is lengthened by
    e, and where it is inclined by a vector d to axis i, the radius grows by e |d|.
    """
    radius, half = shape.size
    axis = shape.R_LS[:, 2]
    mapped = scale * axis
    length = float(np.linalg.norm(mapped))
    direction = mapped / length
    i = int(np.argmax(np.abs(axis)))
    first, second = sorted((k for k in range(3) if k != i), key=lambda k: -scale[k])
    L, T1, T2 = (float(radius + padding) * float(scale[k]) for k in (i, first, second))
    along = math.copysign(1.0, direction[i]) * np.eye(3)[i]
    inclined = float(np.linalg.norm(direction - along))
    thick, apart, longer = min(
        _around(L, T1, T2, B, inclined, parts) for B in {T1, T2, min(T1, max(T2, L))}
    )
    thick -= padding_for(padding, tuple(scale))
    R = shape.R_LS
    if np.abs(direction - axis).max() > _STRAIGHT:
        R = np.asarray(_turn(axis, direction) @ R)
    size = np.array([thick, max(half * length + longer, _THINNEST / 2)])
    centre, aside = scale * shape.p_LoSo_L, apart * np.eye(3)[first]
    if parts == 1:
        return (LinkShape(False, size, R, centre),)
    return LinkShape(False, size, R, centre + aside), LinkShape(False, size, R, centre - aside)


def _around(
    L: float, T1: float, T2: float, B: float, inclined: float, parts: int
) -> tuple[float, float, float]:
    """Return radius, offset along T1 and lengthening of the capsules for a choice of B [m]."""
    if parts == 1:
        B = T1
    longer = max(0.0, L - B)
    return (T1**2 + B**2) / (2.0 * T1) + longer * inclined, (T1**2 - B**2) / (2.0 * T1), longer


def _turn(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the least rotation that takes one unit vector to another, not opposite, one.

    With v = before x after and its matrix V, it is I + V + V^2 / (1 + before . after).
    """
    (a, b, c), (d, e, f) = before.tolist(), after.tolist()
    x, y, z = b * f - c * e, c * d - a * f, a * e - b * d
    V = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + V + V @ V / (1.0 + a * d + b * e + c * f))

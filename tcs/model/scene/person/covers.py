"""Shapes of a resized person: what encloses a link's shapes when the link is stretched.

A link of another person is that of the papers' man stretched along its axes, S = diag(scale). The
skin of the papers' man is within the padding P of a shape K: within K + ball(P), their Minkowski
sum. That of the other person is then within S K + S ball(P). `cover` returns boxes and capsules
that, with the padding of `padding_for`, enclose this body: proved below, not sampled.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from tcs.kernel.arrays import FloatArray
from tcs.model.scene.person.shapes import LinkShape

WIDE = 0.03
"""Radius of a capsule from which it may be covered by two [m]."""
_THINNEST = 1e-4
"""Least length of a capsule between the centres of its caps [m]: it stays a capsule."""
_STRAIGHT = 1e-6
"""Greatest change of a unit vector along an axis that is rounding of the model file."""


def padding_for(padding: float, scale: ArrayLike) -> FloatArray:
    """Return the padding of a stretched link [m], at most that of the papers' man.

    Args:
        padding: That of the papers' man [m].
        scale: How the link is stretched, shape (..., 3): of one person or of many.

    Returns:
        Shape (...).
    """
    return np.asarray(padding * np.minimum(1.0, np.asarray(scale).min(axis=-1)))


def parts_of(shape: LinkShape, *, is_uneven: bool) -> int:
    """Return the number of shapes that cover a shape of a link, whoever the person is.

    Args:
        shape: The shape.
        is_uneven: Whether depth and breadth of the link are of different measures, so that a
            capsule on it becomes elliptic.
    """
    return 2 if is_uneven and not shape.is_box and shape.size[0] > WIDE else 1


def cover(
    shape: LinkShape, scale: ArrayLike, padding: float, parts: int = 1
) -> tuple[LinkShape, ...]:
    """Return shapes that with their padding enclose a shape and its skin, stretched.

    Args:
        shape: A shape K of the papers' man.
        scale: How its link is stretched along x, y and z, shape (..., 3): of one person or of many.
        padding: How far the skin of the papers' man may stand out of it [m].
        parts: Number of shapes, 1 or for a capsule 2, side by side.

    Returns:
        The shapes, to be padded by `padding_for`; size and position have the leading axes of the
        scale, and so has the orientation if it is not that of K. For the papers' man it is the
        shape itself, `parts` times.
    """
    scale = np.asarray(scale, dtype=float)
    is_same = np.all(scale == 1.0, axis=-1, keepdims=True)
    covers = (
        _box(shape, scale, padding) if shape.is_box else _capsules(shape, scale, padding, parts)
    )
    return tuple(
        LinkShape(
            shape.is_box,
            np.where(is_same, shape.size, one.size),
            one.R_LS,
            np.where(is_same, shape.p_LoSo_L, one.p_LoSo_L),
        )
        for one in covers
    )


def _box(shape: LinkShape, scale: FloatArray, padding: float) -> tuple[LinkShape]:
    """Return the box with edges in the same directions around a stretched box.

    Let p be the new padding and N = P S - p I, which has no negative entry. The skin stands out of
    S K along a unit vector d by |P S d| <= p + |N d| <= p + sum_i |d_i| |N r_i|, with r_i the edges
    of the box and d_i = d . r_i: a box that is larger by |N r_i| to either side, padded by p,
    encloses it.
    """
    R = shape.R_LS
    stretched = np.matvec(np.abs(R.T @ (scale[..., :, None] * R)), shape.size)
    N = padding * scale - padding_for(padding, scale)[..., None]
    size = stretched + np.linalg.norm(N[..., :, None] * R, axis=-2)
    return (LinkShape(True, size, R, scale * shape.p_LoSo_L),)


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
    length = np.linalg.norm(mapped, axis=-1)
    direction = mapped / length[..., None]
    i = int(np.argmax(np.abs(axis)))
    j, k = (other for other in range(3) if other != i)
    first = np.where(scale[..., j] >= scale[..., k], j, k)
    half_axes = (radius + padding) * scale
    L, T1 = half_axes[..., i], np.maximum(half_axes[..., j], half_axes[..., k])
    T2 = np.minimum(half_axes[..., j], half_axes[..., k])
    inclined = np.linalg.norm(direction - math.copysign(1.0, axis[i]) * np.eye(3)[i], axis=-1)
    choices = (T1, T2, np.minimum(T1, np.maximum(T2, L))) if parts == 2 else (T1,)
    B = np.array(choices)
    thickness = (T1**2 + B**2) / (2.0 * T1) + np.maximum(0.0, L - B) * inclined
    B = np.take_along_axis(B, np.argmin(thickness, axis=0)[None], axis=0)[0]
    thick = np.min(thickness, axis=0) - padding_for(padding, scale)
    long = np.maximum(half * length + np.maximum(0.0, L - B), _THINNEST / 2)
    is_turned = np.abs(direction - axis).max(axis=-1) > _STRAIGHT
    R = shape.R_LS
    if np.any(is_turned):
        R = np.where(is_turned[..., None, None], _turn(axis, direction) @ R, R)
    size, centre = np.stack([thick, long], axis=-1), scale * shape.p_LoSo_L
    if parts == 1:
        return (LinkShape(False, size, R, centre),)
    aside = ((T1**2 - B**2) / (2.0 * T1))[..., None] * np.eye(3)[first]
    return LinkShape(False, size, R, centre + aside), LinkShape(False, size, R, centre - aside)


def _turn(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return the least rotations that take a unit vector to others, not opposite, (..., 3, 3).

    With v = before x after and its matrix V, it is I + V + V^2 / (1 + before . after).
    """
    # v x e_m is column m of V.
    V = np.swapaxes(np.cross(np.cross(before, after)[..., None, :], np.eye(3)), -1, -2)
    cosine = np.vecdot(before, after)[..., None, None]
    return np.asarray(np.eye(3) + V + V @ V / (1.0 + cosine))

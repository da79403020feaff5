"""Contact of one box with spheres, capsules and boxes, for many shapes at once.

Every test is conservative: shapes closer than the clearance count as in contact, never the reverse.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.placement.store.robot_shapes import BOX, CAPSULE

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

SEPARATED = 1e-12
"""Least gap along a separating axis [m], above the rounding of the projections."""


def in_contact(
    half: FloatArray,
    type: NDArray[np.int64],
    size: FloatArray,
    R: FloatArray,
    p: FloatArray,
    clearance: FloatArray,
) -> BoolArray:
    """Return which shapes are closer to a box than a clearance, shape (n,).

    Args:
        half: Half sizes of the box, which is centred at the origin and parallel to the axes [m],
            shape (3,).
        type: Types of the shapes, shape (n,).
        size: Their sizes as in `Primitives` [m], shape (n, 3).
        R: Their orientations in the frame of the box, shape (n, 3, 3).
        p: Their centres in that frame [m], shape (n, 3).
        clearance: Least distance of each that is free [m], shape (n,).
    """
    contact = np.zeros(len(type), dtype=np.bool_)
    boxes, round_ = np.flatnonzero(type == BOX), np.flatnonzero(type != BOX)
    contact[boxes] = boxes_overlap(half, size[boxes], R[boxes], p[boxes], clearance[boxes])
    # A sphere is a capsule of length 0.
    reach = np.where(type[round_] == CAPSULE, size[round_, 1], 0.0)
    axis = R[round_, :, 2] * reach[:, None]
    distance = segment_distance(half, p[round_] - axis, p[round_] + axis)
    contact[round_] = distance <= size[round_, 0] + clearance[round_]
    return contact


def point_distance(half: FloatArray, p: FloatArray) -> FloatArray:
    """Return the distance of points (..., 3) from a box of half sizes `half` [m], shape (...)."""
    beyond = np.maximum(np.abs(p) - half, 0.0)
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", beyond, beyond)))


def segment_distance(half: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the distance of segments from a box about the origin [m], shape (n,).

    The squared distance along a segment is convex and quadratic between the parameters at which it
    crosses the planes of the box's faces, so its derivative is linear between these.

    Args:
        half: Half sizes of the box [m], shape (3,).
        a: First ends of the segments [m], shape (n, 3).
        b: Second ends [m], shape (n, 3).
    """
    d = b - a
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = np.concatenate([(half - a) / d, (-half - a) / d], axis=1)
    crossing = np.clip(np.nan_to_num(crossing, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    ends = np.broadcast_to([0.0, 1.0], (len(a), 2))
    t = np.sort(np.concatenate([crossing, ends], axis=1), axis=1)
    at = a[:, None] + t[..., None] * d[:, None]
    excess = at - np.clip(at, -half, half)
    slope = np.einsum("nki,ni->nk", excess, d)
    # The derivative is negative before the minimum; take the interval in which it changes sign.
    last = np.clip(np.sum(slope < 0.0, axis=1), 1, t.shape[1] - 1)
    rows = np.arange(len(a))
    t0, t1 = t[rows, last - 1], t[rows, last]
    s0, s1 = slope[rows, last - 1], slope[rows, last]
    rise = s1 - s0
    step = np.where(rise > 0.0, -s0 / np.where(rise > 0.0, rise, 1.0), 0.0)
    best = t0 + np.clip(step, 0.0, 1.0) * (t1 - t0)
    # Rounding may leave the minimum at an end of the interval.
    candidates = np.stack([best, t0, t1], axis=1)
    distance = point_distance(half, a[:, None] + candidates[..., None] * d[:, None])
    return np.asarray(distance.min(axis=1))


def boxes_overlap(
    half: FloatArray, size: FloatArray, R: FloatArray, p: FloatArray, clearance: FloatArray
) -> BoolArray:
    """Return which boxes overlap a box about the origin that is larger by a clearance, shape (n,).

    Separating axes: the faces of both boxes and the products of their edges. Without a separating
    axis they overlap.

    Args:
        half: Half sizes of the box at the origin [m], shape (3,).
        size: Half sizes of the others [m], shape (n, 3).
        R: Their orientations, shape (n, 3, 3).
        p: Their centres [m], shape (n, 3).
        clearance: Enlargement of the box at the origin for each [m], shape (n,).
    """
    enlarged = half + clearance[:, None]
    extent = np.abs(R)
    separated = np.any(np.abs(p) > enlarged + _product(extent, size) + SEPARATED, axis=1)
    along = np.abs(_product(np.swapaxes(R, 1, 2), p))
    separated |= np.any(
        along > size + _product(np.swapaxes(extent, 1, 2), enlarged) + SEPARATED, axis=1
    )
    # Few boxes pass the faces and are separated by edges only.
    rest = np.flatnonzero(~separated)
    separated[rest] = _separated_by_edges(enlarged[rest], size[rest], R[rest], p[rest])
    return np.asarray(~separated)


def _separated_by_edges(
    enlarged: FloatArray, size: FloatArray, R: FloatArray, p: FloatArray
) -> BoolArray:
    """Return which pairs of boxes a product of two edges separates, shape (n,)."""
    one, two = [1, 2, 0], [2, 0, 1]
    extent = np.abs(R)
    # Axis e_i x r_j. Of parallel edges it vanishes, which separates nothing.
    across = p[:, two, None] * R[:, one] - p[:, one, None] * R[:, two]
    reach = enlarged[:, one, None] * extent[:, two] + enlarged[:, two, None] * extent[:, one]
    reach += size[:, None, one] * extent[:, :, two] + size[:, None, two] * extent[:, :, one]
    return np.asarray(np.any(np.abs(across) > reach + SEPARATED, axis=(1, 2)))


def _product(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return products of matrices (n, 3, 3) and vectors (n, 3), shape (n, 3)."""
    product: FloatArray = np.matmul(matrices, vectors[:, :, None])[:, :, 0]
    return product

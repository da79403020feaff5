"""Groups of packed shapes that move together, each with a box around it.

A body has up to dozens of shapes. A test of the box around them rules most of them out at once; the
shapes alone decide what touches.
"""

from __future__ import annotations

import itertools

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray, IntArray
from tcs.kernel.collide import BOUND, CENTRE, COLUMNS, ROTATION, SIZE, TYPE

ROUNDING = 1e-9
"""Growth of a box around shapes [m], so that rounding never leaves a shape outside."""


def first_rows(*keys: IntArray) -> IntArray:
    """Return the first shape of each run of shapes with equal keys, and their number.

    Args:
        keys: Whatever tells the groups apart, shapes (n,).

    Returns:
        Shape (groups + 1,).
    """
    n = len(keys[0])
    starts = np.zeros(n, np.bool_)
    starts[:1] = True
    for key in keys:
        starts[1:] |= key[1:] != key[:-1]
    return np.append(np.flatnonzero(starts), n).astype(np.int64)


def with_boxes(rows: FloatArray, first: IntArray) -> FloatArray:
    """Return packed shapes, followed by the box around each group.

    Args:
        rows: Packed shapes, shape (states, n, COLUMNS). Shapes of a group keep their relative poses
            from state to state.
        first: From `first_rows`, shape (groups + 1,).

    Returns:
        Shape (states, n + groups, COLUMNS). The box of a single shape is the shape.
    """
    around = [
        rows[:, a : a + 1] if b - a == 1 else _box_around(rows[:, a:b])[:, None]
        for a, b in itertools.pairwise(first)
    ]
    return np.ascontiguousarray(np.concatenate([rows, *around], axis=1))


def with_group_rows(gaps: FloatArray, first: IntArray) -> FloatArray:
    """Return gaps of pairs of shapes [m], followed by a row with the greatest of each group.

    Args:
        gaps: Shape (n, m).
        first: From `first_rows`, shape (groups + 1,).

    Returns:
        Shape (n + groups, m).
    """
    if not len(gaps):
        return gaps
    greatest = np.maximum.reduceat(gaps, first[:-1], axis=0)
    return np.ascontiguousarray(np.concatenate([gaps, greatest]))


def _box_around(rows: FloatArray) -> FloatArray:
    """Return the smallest box around shapes with the orientation of one, shape (states, COLUMNS).

    Args:
        rows: Packed shapes, shape (states, n, COLUMNS), n > 0.
    """
    R = rows[..., ROTATION:].reshape(*rows.shape[:2], 3, 3)
    p = rows[..., CENTRE : CENTRE + 3]
    half = _core(rows[0])
    radius = np.where(rows[0, :, TYPE] == BOX, 0.0, rows[0, :, SIZE])
    # Of the boxes with the orientation of each shape k around all shapes n.
    along = np.abs(np.einsum("kri,nrj->knij", R[0], R[0]))
    spread = np.einsum("knij,nj->kni", along, half) + radius[:, None]
    middle = np.einsum("knr,kri->kni", p[0] - p[0][:, None], R[0])
    low, high = (middle - spread).min(axis=1), (middle + spread).max(axis=1)
    sizes = (high - low) / 2 + ROUNDING
    k = int(np.argmin(sizes.prod(axis=1)))
    best = np.empty((len(rows), COLUMNS))
    best[:, TYPE], best[:, SIZE : SIZE + 3] = BOX, sizes[k]
    best[:, BOUND] = np.linalg.norm(sizes[k])
    best[:, CENTRE : CENTRE + 3] = p[:, k] + R[:, k] @ ((low[k] + high[k]) / 2)
    best[:, ROTATION:] = R[:, k].reshape(-1, 9)
    return best


def _core(rows: FloatArray) -> FloatArray:
    """Return the half sizes of the cores of packed shapes along their axes [m], shape (n, 3)."""
    half = np.zeros((len(rows), 3))
    boxes, capsules = rows[:, TYPE] == BOX, rows[:, TYPE] == CAPSULE
    half[boxes] = rows[boxes, SIZE : SIZE + 3]
    half[capsules, 2] = rows[capsules, SIZE + 1]
    return half

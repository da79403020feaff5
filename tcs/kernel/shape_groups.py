"""Groups of packed shapes that move together, each with a box around it, and clusters in them.

A body has up to hundreds of shapes. A test of the box around them rules most of them out at once,
and so do, in a group of many, tests of the boxes around its clusters: shapes beside each other. The
shapes alone decide what touches.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray, IntArray
from tcs.kernel.collide import BOUND, CENTRE, COLUMNS, ROTATION, ROUNDING, SIZE, TYPE

CLUSTER = 12
"""Greatest number of shapes of a cluster. Counted on Baxter, 10 to 12 make for the fewest tests."""


class ShapeGroups(NamedTuple):
    """Groups of packed shapes, and the clusters that make up each group.

    Further rows follow the n rows of shapes: the box around each group, then the boxes around the
    clusters of the groups that have several.
    """

    first: IntArray
    """First row of each group, and n, shape (groups + 1,)."""
    clusters: IntArray
    """First cluster of each group, and their number, shape (groups + 1,)."""
    members: IntArray
    """Rows of the shapes, cluster by cluster, shape (n,)."""
    cluster_first: IntArray
    """First of each cluster in `members`, and n, shape (clusters + 1,)."""
    cluster_box: IntArray
    """Row of the box around each cluster, that of the group for its only one, shape (clusters,)."""

    def in_boxes(self) -> list[IntArray]:
        """Return the rows of the shapes in each box."""
        of_groups = [np.arange(a, b) for a, b in itertools.pairwise(self.first)]
        of_clusters = np.split(self.members, self.cluster_first[1:-1])
        several = self.cluster_box >= self.first[-1] + len(of_groups)
        return of_groups + list(itertools.compress(of_clusters, several))


def groups_of(centres: FloatArray, *keys: NDArray[Any]) -> ShapeGroups:
    """Return the groups of runs of shapes with equal keys, and their clusters.

    A group is halved along the longest extent of the centres until clusters are left.

    Args:
        centres: Of the shapes [m], shape (n, 3).
        keys: Whatever tells the groups apart, shapes (n,).
    """
    first = _first_rows(*keys)
    clusters = [
        [a + members for members in _halved(centres[a:b])]
        for a, b in itertools.pairwise(first.tolist())
    ]
    counts = [len(of_group) for of_group in clusters]
    box, rows = [], first[-1] + len(counts)
    for g, count in enumerate(counts):
        if count == 1:
            box.append(first[-1] + g)
        else:
            box += range(rows, rows + count)
            rows += count
    each = list(itertools.chain(*clusters))
    return ShapeGroups(
        first=first,
        clusters=np.cumsum([0, *counts], dtype=np.int64),
        members=np.concatenate([np.empty(0, np.int64), *each]),
        cluster_first=np.cumsum([0, *map(len, each)], dtype=np.int64),
        cluster_box=np.array(box, np.int64),
    )


def with_boxes(rows: FloatArray, groups: ShapeGroups) -> FloatArray:
    """Return packed shapes, followed by the boxes around groups and clusters.

    Args:
        rows: Packed shapes, shape (states, n, COLUMNS). Shapes of a group keep their relative poses
            from state to state.
        groups: Of the n shapes.

    Returns:
        Shape (states, n + boxes, COLUMNS). The box of a single shape is the shape.
    """
    around = [
        rows[:, inside] if len(inside) == 1 else _box_around(rows[:, inside])[:, None]
        for inside in groups.in_boxes()
    ]
    return np.ascontiguousarray(np.concatenate([rows, *around], axis=1))


def with_group_rows(gaps: FloatArray, groups: ShapeGroups) -> FloatArray:
    """Return gaps of pairs of shapes [m], followed by the greatest of those in each box.

    Args:
        gaps: Shape (n, m).
        groups: Of the n shapes.

    Returns:
        Shape (n + boxes, m).
    """
    of_groups = np.maximum.reduceat(gaps, groups.first[:-1])
    of_clusters = np.maximum.reduceat(gaps[groups.members], groups.cluster_first[:-1])
    own = groups.cluster_box >= len(gaps) + len(of_groups)
    return np.ascontiguousarray(np.concatenate([gaps, of_groups, of_clusters[own]]))


def _first_rows(*keys: NDArray[Any]) -> IntArray:
    """Return the first shape of each run of shapes with equal keys, and their number."""
    n = len(keys[0])
    starts = np.zeros(n, np.bool_)
    starts[:1] = True
    for key in keys:
        starts[1:] |= key[1:] != key[:-1]
    return np.append(np.flatnonzero(starts), n).astype(np.int64)


def _halved(centres: FloatArray) -> list[IntArray]:
    """Return the clusters of a group of shapes at these centres [m], shape (n, 3)."""
    n = len(centres)
    if n <= CLUSTER:
        return [np.arange(n)]
    along = np.argsort(centres[:, np.argmax(np.ptp(centres, axis=0))], kind="stable")
    halves = np.sort(along[: n // 2]), np.sort(along[n // 2 :])
    return [half[members] for half in halves for members in _halved(centres[half])]


def _box_around(rows: FloatArray) -> FloatArray:
    """Return the smallest box around shapes with the orientation of one, shape (states, COLUMNS).

    Args:
        rows: Packed shapes, shape (states, n, COLUMNS), n > 0.
    """
    R = rows[..., ROTATION:].reshape(*rows.shape[:2], 3, 3)
    p = rows[..., CENTRE : CENTRE + 3]
    half = _core(rows[0])
    radius = np.where(rows[0, :, TYPE] == BOX, 0.0, rows[0, :, SIZE])
    # Of the boxes around all shapes with each orientation k among theirs.
    of = list({R_k.tobytes(): k for k, R_k in enumerate(R[0])}.values())
    low, high = _extents(R[0], p[0] - p[0, 0], half, radius, R[0, of])
    sizes = (high - low) / 2 + ROUNDING
    k = int(np.argmin(sizes.prod(axis=1)))
    best = np.empty((len(rows), COLUMNS))
    best[:, TYPE], best[:, SIZE : SIZE + 3] = BOX, sizes[k]
    best[:, BOUND] = np.linalg.norm(sizes[k])
    best[:, CENTRE : CENTRE + 3] = p[:, 0] + R[:, of[k]] @ ((low[k] + high[k]) / 2)
    best[:, ROTATION:] = R[:, of[k]].reshape(-1, 9)
    return best


def _extents(
    R: FloatArray, p: FloatArray, half: FloatArray, radius: FloatArray, axes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the least and the greatest extents of shapes along given axes [m], shapes (m, 3).

    Sums of three products one by one: products of large matrices would wake all threads of the
    linear algebra library, which then spin, and compiled code takes a second to compile.

    Args:
        R: Orientations of the shapes, shape (n, 3, 3).
        p: Their centres [m], shape (n, 3).
        half: Half sizes of their cores [m], shape (n, 3).
        radius: Radii around these [m], shape (n,).
        axes: The axes, as columns, shape (m, 3, 3).
    """
    x, y, z = (axes[:, i, :, None] for i in range(3))
    spread = radius
    for r in range(3):
        along = x * R[:, 0, r] + y * R[:, 1, r] + z * R[:, 2, r]
        spread = spread + half[:, r] * np.abs(along)
    middle = x * p[:, 0] + y * p[:, 1] + z * p[:, 2]
    return (middle - spread).min(axis=2), (middle + spread).max(axis=2)


def _core(rows: FloatArray) -> FloatArray:
    """Return the half sizes of the cores of packed shapes along their axes [m], shape (n, 3)."""
    half = np.zeros((len(rows), 3))
    boxes, capsules = rows[:, TYPE] == BOX, rows[:, TYPE] == CAPSULE
    half[boxes] = rows[boxes, SIZE : SIZE + 3]
    half[capsules, 2] = rows[capsules, SIZE + 1]
    return half

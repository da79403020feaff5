"""Contacts of groups of shapes that are in place: a shape of one group touches one of another.

A group is a row of shapes that move together; the box around them stands behind all shapes.
"""

from __future__ import annotations

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import closer, spheres_overlap


@inner
def group_touches(
    a: FloatArray,
    first: IntArray,
    g: int,
    b: FloatArray,
    j: int,
    gaps: FloatArray,
    touching: IntArray,
) -> bool:
    """Return whether group g of a, with its shapes in place, touches shape j of b."""
    box = first[-1] + g
    return closer(a, box, b, j, gaps[box, j]) and _shapes_touch(a, first, g, b, j, gaps, touching)


@inner
def groups_touch(
    a: FloatArray,
    first_a: IntArray,
    g: int,
    b: FloatArray,
    first_b: IntArray,
    h: int,
    gaps: FloatArray,
    touching: IntArray,
) -> bool:
    """Return whether a shape of group g of a touches one of group h of b; fills `touching`."""
    if first_b[h + 1] - first_b[h] == 1:
        return _shapes_touch(a, first_a, g, b, first_b[h], gaps, touching)
    box = first_b[-1] + h
    for i in range(first_a[g], first_a[g + 1]):
        gap = gaps[i, box]
        if gap <= 0.0 or not spheres_overlap(a, i, b, box, gap):
            continue
        for j in range(first_b[h], first_b[h + 1]):
            gap = gaps[i, j]
            if gap > 0.0 and spheres_overlap(a, i, b, j, gap) and closer(a, i, b, j, gap):
                touching[0], touching[1] = i, j
                return True
    return False


@inner
def _shapes_touch(
    a: FloatArray,
    first: IntArray,
    g: int,
    b: FloatArray,
    j: int,
    gaps: FloatArray,
    touching: IntArray,
) -> bool:
    """Return whether a shape of group g of a touches row j of b; fills `touching`."""
    touching[0], touching[1] = first[g], j
    # The box of a single shape is the shape, and touches.
    if first[g + 1] - first[g] == 1:
        return True
    for i in range(first[g], first[g + 1]):
        gap = gaps[i, j]
        if gap > 0.0 and spheres_overlap(a, i, b, j, gap) and closer(a, i, b, j, gap):
            touching[0] = i
            return True
    return False

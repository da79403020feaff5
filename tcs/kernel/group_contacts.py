"""Contacts of groups of shapes that are in place: a shape of one group touches one of another.

A group is a row of shapes that move together; the box around them stands behind all shapes, and
behind all boxes, those around its clusters.
"""

from __future__ import annotations

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import closer, sphere_is_near, spheres_overlap
from tcs.kernel.shape_groups import ShapeGroups


@inner
def group_touches(
    a: FloatArray,
    groups: ShapeGroups,
    g: int,
    b: FloatArray,
    j: int,
    gaps: FloatArray,
    touching: IntArray,
) -> bool:
    """Return whether group g of a, with its shapes in place, touches shape j of b."""
    box = groups.first[-1] + g
    gap = gaps[box, j]
    return (
        sphere_is_near(a, box, b, j, gap)
        and closer(a, box, b, j, gap)
        and _shapes_touch(a, groups, g, b, j, gaps, touching)
    )


@inner
def groups_touch(
    a: FloatArray,
    groups: ShapeGroups,
    g: int,
    b: FloatArray,
    others: ShapeGroups,
    h: int,
    gaps: FloatArray,
    touching: IntArray,
) -> bool:
    """Return whether a shape of group g of a touches one of group h of b; fills `touching`.

    The boxes around the groups touch.
    """
    if others.first[h + 1] - others.first[h] == 1:
        return _shapes_touch(a, groups, g, b, others.first[h], gaps, touching)
    box, other = groups.first[-1] + g, others.first[-1] + h
    first, clusters, cluster_box = groups.cluster_first, groups.clusters, groups.cluster_box
    for c in range(clusters[g], clusters[g + 1]):
        part = cluster_box[c]
        gap = gaps[part, other]
        if part != box and not (
            gap > 0.0 and spheres_overlap(a, part, b, other, gap) and closer(a, part, b, other, gap)
        ):
            continue
        for d in range(others.clusters[h], others.clusters[h + 1]):
            other_part = others.cluster_box[d]
            gap = gaps[part, other_part]
            if other_part != other and not (
                gap > 0.0
                and spheres_overlap(a, part, b, other_part, gap)
                and closer(a, part, b, other_part, gap)
            ):
                continue
            for n in range(first[c], first[c + 1]):
                i = groups.members[n]
                gap = gaps[i, other_part]
                if (
                    gap > 0.0
                    and spheres_overlap(a, i, b, other_part, gap)
                    and closer(a, i, b, other_part, gap)
                    and shape_touches_cluster(a, i, b, others, d, gaps, touching)
                ):
                    return True
    return False


@inner
def first_touching(
    a: FloatArray,
    i: int,
    b: FloatArray,
    groups: ShapeGroups,
    h: int,
    gaps: FloatArray,
    touching: IntArray,
) -> bool:
    """Return whether shape i of a touches group h of b; fills `touching` with the first it touches.

    The shape touches the box around the group.
    """
    box, least, members = groups.first[-1] + h, groups.first[h + 1], groups.members
    for d in range(groups.clusters[h], groups.clusters[h + 1]):
        part, start = groups.cluster_box[d], groups.cluster_first[d]
        if members[start] >= least:
            continue
        gap = gaps[i, part]
        if part != box and not (
            gap > 0.0 and spheres_overlap(a, i, b, part, gap) and closer(a, i, b, part, gap)
        ):
            continue
        for n in range(start, groups.cluster_first[d + 1]):
            j = members[n]
            if j >= least:
                break
            gap = gaps[i, j]
            if gap > 0.0 and spheres_overlap(a, i, b, j, gap) and closer(a, i, b, j, gap):
                least = j
                break
    if least == groups.first[h + 1]:
        return False
    touching[0], touching[1] = i, least
    return True


@inner
def shape_touches_cluster(
    a: FloatArray,
    i: int,
    b: FloatArray,
    groups: ShapeGroups,
    d: int,
    gaps: FloatArray,
    touching: IntArray,
) -> bool:
    """Return whether shape i of a touches a shape of cluster d of b; fills `touching`."""
    for n in range(groups.cluster_first[d], groups.cluster_first[d + 1]):
        j = groups.members[n]
        gap = gaps[i, j]
        if gap > 0.0 and spheres_overlap(a, i, b, j, gap) and closer(a, i, b, j, gap):
            touching[0], touching[1] = i, j
            return True
    return False


@inner
def _shapes_touch(
    a: FloatArray,
    groups: ShapeGroups,
    g: int,
    b: FloatArray,
    j: int,
    gaps: FloatArray,
    touching: IntArray,
) -> bool:
    """Return whether a shape of group g of a touches row j of b; fills `touching`."""
    first, clusters, cluster_first = groups.first, groups.clusters, groups.cluster_first
    box, touching[0], touching[1] = first[-1] + g, first[g], j
    # The box of a single shape is the shape, and touches.
    if first[g + 1] - first[g] == 1:
        return True
    for c in range(clusters[g], clusters[g + 1]):
        part = groups.cluster_box[c]
        gap = gaps[part, j]
        if part != box and not (
            gap > 0.0 and spheres_overlap(a, part, b, j, gap) and closer(a, part, b, j, gap)
        ):
            continue
        for n in range(cluster_first[c], cluster_first[c + 1]):
            i = groups.members[n]
            gap = gaps[i, j]
            if gap > 0.0 and spheres_overlap(a, i, b, j, gap) and closer(a, i, b, j, gap):
                touching[0] = i
                return True
    return False

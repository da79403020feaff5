"""Contacts of a group of the arm, whose box is in place, with a shape or another group.

Clusters and shapes of the group are placed only where their bounding spheres touch. Clusters tell
whether anything touches; the pair that is named is the first one in the order of the shapes, so
that what is searched from it does not depend on the clusters.
"""

from __future__ import annotations

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import BOUND, CENTRE, closer, spheres_overlap
from tcs.kernel.group_contacts import shape_touches_cluster
from tcs.kernel.groups import Groups
from tcs.kernel.problem import Problem
from tcs.kernel.workspace import Workspace, place_link, place_shapes


@inner
def environment_touches(
    problem: Problem, work: Workspace, g: int, environment: FloatArray, j: int
) -> bool:
    """Return whether group g of the arm touches environment shape j; fills `work.touching`.

    Call it, and the functions below, for a group whose bounding sphere touches.
    """
    arm, first, gaps = work.arm, problem.link_groups.first, problem.gap_environment
    box = first[-1] + g
    return closer(arm, box, environment, j, gaps[box, j]) and _link_touches_shape(
        problem, work, g, environment, j, gaps
    )


@inner
def _link_touches_shape(
    problem: Problem, work: Workspace, g: int, b: FloatArray, j: int, gaps: FloatArray
) -> bool:
    """Return whether a shape of group g of the arm touches row j of b; fills `work.touching`."""
    first, touching = problem.link_groups.first, work.touching
    touching[0], touching[1] = first[g], j
    # The box of a single shape is the shape, and touches.
    if first[g + 1] - first[g] == 1:
        return True
    if _is_divided(problem.link_groups, g) and not _clusters_touch_shape(
        problem, work, g, b, j, gaps
    ):
        return False
    x, y, z = _seen_from_link(problem, work, g, b, j)
    for i in range(first[g], first[g + 1]):
        gap = gaps[i, j]
        if (
            gap > 0.0
            and _is_near(problem.links, i, x, y, z, b[j, BOUND] + gap)
            and _row_touches(problem, work, i, b, j, gap)
        ):
            touching[0] = i
            return True
    return False


@inner
def _clusters_touch_shape(
    problem: Problem, work: Workspace, g: int, b: FloatArray, j: int, gaps: FloatArray
) -> bool:
    """Return whether a shape of group g of the arm, which has clusters, touches row j of b."""
    groups = problem.link_groups
    x, y, z = _seen_from_link(problem, work, g, b, j)
    for c in range(groups.clusters[g], groups.clusters[g + 1]):
        box = groups.cluster_box[c]
        gap = gaps[box, j]
        if not (
            gap > 0.0
            and _is_near(problem.links, box, x, y, z, b[j, BOUND] + gap)
            and _row_touches(problem, work, box, b, j, gap)
        ):
            continue
        for n in range(groups.cluster_first[c], groups.cluster_first[c + 1]):
            i = groups.members[n]
            gap = gaps[i, j]
            if (
                gap > 0.0
                and _is_near(problem.links, i, x, y, z, b[j, BOUND] + gap)
                and _row_touches(problem, work, i, b, j, gap)
            ):
                return True
    return False


@inner
def _link_touches_group(
    problem: Problem,
    work: Workspace,
    g: int,
    b: FloatArray,
    others: Groups,
    h: int,
    gaps: FloatArray,
) -> bool:
    """Return whether a shape of group g of the arm touches one of group h of b, in place.

    Fills `work.touching`.
    """
    if others.first[h + 1] - others.first[h] == 1:
        return _link_touches_shape(problem, work, g, b, others.first[h], gaps)
    if (_is_divided(problem.link_groups, g) or _is_divided(others, h)) and not _clusters_touch(
        problem, work, g, b, others, h, gaps
    ):
        return False
    arm, first, touching, box = (
        work.arm,
        problem.link_groups.first,
        work.touching,
        others.first[-1] + h,
    )
    x, y, z = _seen_from_link(problem, work, g, b, box)
    for i in range(first[g], first[g + 1]):
        gap = gaps[i, box]
        if (
            gap <= 0.0
            or not _is_near(problem.links, i, x, y, z, b[box, BOUND] + gap)
            or not _row_touches(problem, work, i, b, box, gap)
        ):
            continue
        for j in range(others.first[h], others.first[h + 1]):
            gap = gaps[i, j]
            if gap > 0.0 and spheres_overlap(arm, i, b, j, gap) and closer(arm, i, b, j, gap):
                touching[0], touching[1] = i, j
                return True
    return False


@inner
def _clusters_touch(
    problem: Problem,
    work: Workspace,
    g: int,
    b: FloatArray,
    others: Groups,
    h: int,
    gaps: FloatArray,
) -> bool:
    """Return whether a shape of group g of the arm touches one of group h of b by clusters."""
    arm, groups = work.arm, problem.link_groups
    box, other = groups.first[-1] + g, others.first[-1] + h
    x, y, z = _seen_from_link(problem, work, g, b, other)
    for c in range(groups.clusters[g], groups.clusters[g + 1]):
        part = groups.cluster_box[c]
        gap = gaps[part, other]
        if part != box and not (
            gap > 0.0
            and _is_near(problem.links, part, x, y, z, b[other, BOUND] + gap)
            and _row_touches(problem, work, part, b, other, gap)
        ):
            continue
        for d in range(others.clusters[h], others.clusters[h + 1]):
            other_part = others.cluster_box[d]
            gap = gaps[part, other_part]
            if other_part != other and not (
                gap > 0.0
                and spheres_overlap(arm, part, b, other_part, gap)
                and closer(arm, part, b, other_part, gap)
            ):
                continue
            if _cluster_touches(problem, work, g, c, b, others, d, gaps):
                return True
    return False


@inner
def _cluster_touches(
    problem: Problem,
    work: Workspace,
    g: int,
    c: int,
    b: FloatArray,
    others: Groups,
    d: int,
    gaps: FloatArray,
) -> bool:
    """Return whether a shape of cluster c, of group g of the arm, touches one of cluster d of b."""
    groups, box = problem.link_groups, others.cluster_box[d]
    x, y, z = _seen_from_link(problem, work, g, b, box)
    for n in range(groups.cluster_first[c], groups.cluster_first[c + 1]):
        i = groups.members[n]
        gap = gaps[i, box]
        if (
            gap > 0.0
            and _is_near(problem.links, i, x, y, z, b[box, BOUND] + gap)
            and _row_touches(problem, work, i, b, box, gap)
            and shape_touches_cluster(work.arm, i, b, others, d, gaps, work.touching)
        ):
            return True
    return False


@inner
def _is_divided(groups: Groups, g: int) -> bool:
    """Return whether a group has several clusters."""
    return groups.clusters[g + 1] - groups.clusters[g] > 1


@inner
def _row_touches(
    problem: Problem, work: Workspace, i: int, b: FloatArray, j: int, gap: float
) -> bool:
    """Return whether row i of the arm, which is placed first, touches row j of b."""
    place_link(problem, work, i)
    return closer(work.arm, i, b, j, gap)


@inner
def _seen_from_link(
    problem: Problem, work: Workspace, g: int, b: FloatArray, j: int
) -> tuple[float, float, float]:
    """Return the centre of row j of b in the frame of group g's link [m]."""
    frame = problem.link_frame[problem.link_groups.first[g]]
    R, p = work.link_R[frame], work.link_p[frame]
    x, y, z = b[j, CENTRE] - p[0], b[j, CENTRE + 1] - p[1], b[j, CENTRE + 2] - p[2]
    return (
        R[0, 0] * x + R[1, 0] * y + R[2, 0] * z,
        R[0, 1] * x + R[1, 1] * y + R[2, 1] * z,
        R[0, 2] * x + R[1, 2] * y + R[2, 2] * z,
    )


@inner
def _is_near(links: FloatArray, i: int, x: float, y: float, z: float, reach: float) -> bool:
    """Return whether the bounding sphere of shape i is within a distance [m] of a point."""
    x, y, z = x - links[i, CENTRE], y - links[i, CENTRE + 1], z - links[i, CENTRE + 2]
    apart = links[i, BOUND] + reach
    return x * x + y * y + z * z < apart * apart


@inner
def body_touches(problem: Problem, work: Workspace, body_A: FloatArray, g: int, h: int) -> bool:
    """Return whether group g of the arm touches group h of the body; fills `work.touching`."""
    others, gaps = problem.body_groups, problem.gap_body
    box, other = problem.link_groups.first[-1] + g, others.first[-1] + h
    return closer(work.arm, box, body_A, other, gaps[box, other]) and _link_touches_group(
        problem, work, g, body_A, others, h, gaps
    )


@inner
def arm_touches(problem: Problem, work: Workspace, g: int, h: int) -> bool:
    """Return whether two groups of the arm touch; fills `work.touching`."""
    arm, groups, gaps = work.arm, problem.link_groups, problem.gap_arm
    box, other = groups.first[-1] + g, groups.first[-1] + h
    if not closer(arm, box, arm, other, gaps[box, other]):
        return False
    place_shapes(problem, work, h)
    return _link_touches_group(problem, work, g, arm, groups, h, gaps)

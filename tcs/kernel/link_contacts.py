"""Contacts of a group of the arm, whose box is in place, with a shape or another group.

Clusters and shapes of the group are placed only where their bounding spheres touch. The pair that
is named is the first one in the order of the shapes, so that what is searched from it does not
depend on the clusters: of a cluster, only shapes before the first found so far are looked at.
"""

from __future__ import annotations

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import (
    BOUND,
    CENTRE,
    ROTATION,
    ROUNDING,
    closer,
    core,
    sphere_is_near,
    square_beyond,
)
from tcs.kernel.group_contacts import first_touching
from tcs.kernel.problem import Problem
from tcs.kernel.shape_groups import ShapeGroups
from tcs.kernel.workspace import Workspace, place_link, place_shapes


@inner
def environment_touches(
    problem: Problem, work: Workspace, g: int, environment: FloatArray, j: int
) -> bool:
    """Return whether group g of the arm touches environment shape j; fills `work.touching`.

    Call it, and the functions below, for a group whose bounding sphere touches.
    """
    arm, first, gaps = work.arm, problem.links.groups.first, problem.clearances.environment
    box = first[-1] + g
    gap = gaps[box, j]
    return (
        sphere_is_near(arm, box, environment, j, gap)
        and closer(arm, box, environment, j, gap)
        and _link_touches_shape(problem, work, g, environment, j, gaps)
    )


@inner
def _link_touches_shape(
    problem: Problem, work: Workspace, g: int, b: FloatArray, j: int, gaps: FloatArray
) -> bool:
    """Return whether a shape of group g of the arm touches row j of b; fills `work.touching`."""
    groups, touching = problem.links.groups, work.touching
    first, end = groups.first[g], groups.first[g + 1]
    touching[0], touching[1] = first, j
    # The box of a single shape is the shape, and touches.
    if end - first == 1:
        return True
    box, least, seen = groups.first[-1] + g, end, _seen_from(problem, work, g, b, j, gaps)
    for c in range(groups.clusters[g], groups.clusters[g + 1]):
        part, start = groups.cluster_box[c], groups.cluster_first[c]
        if groups.members[start] >= least:
            continue
        if part != box and not _row_touches(problem, work, part, seen, b, j, gaps):
            continue
        for n in range(start, groups.cluster_first[c + 1]):
            i = groups.members[n]
            if i >= least:
                break
            if _row_touches(problem, work, i, seen, b, j, gaps):
                least = i
                break
    if least == end:
        return False
    touching[0] = least
    return True


@inner
def _link_touches_group(
    problem: Problem,
    work: Workspace,
    g: int,
    b: FloatArray,
    others: ShapeGroups,
    h: int,
    gaps: FloatArray,
) -> bool:
    """Return whether a shape of group g of the arm touches one of group h of b, in place.

    Fills `work.touching`.
    """
    if others.first[h + 1] - others.first[h] == 1:
        return _link_touches_shape(problem, work, g, b, others.first[h], gaps)
    groups = problem.links.groups
    box, other, least = groups.first[-1] + g, others.first[-1] + h, groups.first[g + 1]
    seen = _seen_from(problem, work, g, b, other, gaps)
    for c in range(groups.clusters[g], groups.clusters[g + 1]):
        part, start = groups.cluster_box[c], groups.cluster_first[c]
        if groups.members[start] >= least:
            continue
        if part != box and not _row_touches(problem, work, part, seen, b, other, gaps):
            continue
        for n in range(start, groups.cluster_first[c + 1]):
            i = groups.members[n]
            if i >= least:
                break
            if _row_touches(problem, work, i, seen, b, other, gaps) and first_touching(
                work.arm, i, b, others, h, gaps, work.touching
            ):
                least = i
                break
    return least < groups.first[g + 1]


@inner
def _row_touches(
    problem: Problem,
    work: Workspace,
    i: int,
    seen: tuple[float, ...],
    b: FloatArray,
    j: int,
    gaps: FloatArray,
) -> bool:
    """Return whether row i of the arm touches row j of b, as `seen` from its link.

    Places row i where its bounding sphere is near. Its gap, which lies far from those of the other
    rows in memory, is read only then.
    """
    if not _is_near(problem.links.shapes, i, seen) or gaps[i, j] <= 0.0:
        return False
    place_link(problem, work, i)
    return closer(work.arm, i, b, j, gaps[i, j])


@inner
def _seen_from(
    problem: Problem, work: Workspace, g: int, b: FloatArray, j: int, gaps: FloatArray
) -> tuple[float, ...]:
    """Return how row j of b is seen from the link of group g.

    Returns:
        The rotation from the link's frame to that of the row, row by row; the origin of the link in
        the frame of the row [m]; the half sizes of the row's core; and the radius around it that no
        bounding sphere may enter, with the gap of the group [m].
    """
    frame = problem.links.frame[problem.links.groups.first[g]]
    R, p = work.link_R[frame], work.link_p[frame]
    x, y, z = p[0] - b[j, CENTRE], p[1] - b[j, CENTRE + 1], p[2] - b[j, CENTRE + 2]
    ax, bx, cx = R[0, 0], R[0, 1], R[0, 2]
    ay, by, cy = R[1, 0], R[1, 1], R[1, 2]
    az, bz, cz = R[2, 0], R[2, 1], R[2, 2]
    ux, uy, uz = b[j, ROTATION], b[j, ROTATION + 3], b[j, ROTATION + 6]
    vx, vy, vz = b[j, ROTATION + 1], b[j, ROTATION + 4], b[j, ROTATION + 7]
    wx, wy, wz = b[j, ROTATION + 2], b[j, ROTATION + 5], b[j, ROTATION + 8]
    hx, hy, hz, radius = core(b, j)
    return (
        ux * ax + uy * ay + uz * az,
        ux * bx + uy * by + uz * bz,
        ux * cx + uy * cy + uz * cz,
        vx * ax + vy * ay + vz * az,
        vx * bx + vy * by + vz * bz,
        vx * cx + vy * cy + vz * cz,
        wx * ax + wy * ay + wz * az,
        wx * bx + wy * by + wz * bz,
        wx * cx + wy * cy + wz * cz,
        ux * x + uy * y + uz * z,
        vx * x + vy * y + vz * z,
        wx * x + wy * y + wz * z,
        hx,
        hy,
        hz,
        radius + gaps[problem.links.groups.first[-1] + g, j] + ROUNDING,
    )


@inner
def _is_near(links: FloatArray, i: int, seen: tuple[float, ...]) -> bool:
    """Return whether the bounding sphere of row i is within the gap of a row, as `seen`."""
    x, y, z = links[i, CENTRE], links[i, CENTRE + 1], links[i, CENTRE + 2]
    u = seen[0] * x + seen[1] * y + seen[2] * z + seen[9]
    v = seen[3] * x + seen[4] * y + seen[5] * z + seen[10]
    w = seen[6] * x + seen[7] * y + seen[8] * z + seen[11]
    apart = links[i, BOUND] + seen[15]
    return square_beyond(u, v, w, seen[12], seen[13], seen[14]) < apart * apart


@inner
def body_touches(problem: Problem, work: Workspace, body_A: FloatArray, g: int, h: int) -> bool:
    """Return whether group g of the arm touches group h of the body; fills `work.touching`."""
    others, gaps = problem.body.groups, problem.clearances.body
    box, other = problem.links.groups.first[-1] + g, others.first[-1] + h
    gap = gaps[box, other]
    return (
        sphere_is_near(work.arm, box, body_A, other, gap)
        and closer(work.arm, box, body_A, other, gap)
        and _link_touches_group(problem, work, g, body_A, others, h, gaps)
    )


@inner
def arm_touches(problem: Problem, work: Workspace, g: int, h: int) -> bool:
    """Return whether two groups of the arm touch; fills `work.touching`."""
    arm, groups, gaps = work.arm, problem.links.groups, problem.clearances.arm
    box, other = groups.first[-1] + g, groups.first[-1] + h
    gap = gaps[box, other]
    if not (sphere_is_near(arm, box, arm, other, gap) and closer(arm, box, arm, other, gap)):
        return False
    place_shapes(problem, work, h)
    return _link_touches_group(problem, work, g, arm, groups, h, gaps)

"""First contact found of base, gripper and arm with the environment and with the robot itself.

A contact is a code `robot_body * bodies + other`, where `other` numbers the bodies of the
environment first and then those of the robot; NO_CONTACT where nothing touches.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant, jit
from tcs.kernel.collide import BOUND, CENTRE, closer, move, spheres_overlap
from tcs.kernel.distances import are_apart
from tcs.kernel.group_contacts import group_touches
from tcs.kernel.kinematics import link_poses
from tcs.kernel.problem import Problem

NO_CONTACT = -1
ENVIRONMENT, BODY, ARM = int_constant(0), int_constant(1), int_constant(2)
"""Partner of the arm in a contact."""
BASE_FIXED, TORSO_MOUNTED = int_constant(0), int_constant(1)
"""Mount of a body shape: fixed to the base, or mounted on the torso."""
AT_GOAL = 1e-7
"""Greatest pose error [m, and as entries of a rotation] of a solution. The closed form is good to
1e-12 except within 1e-7 rad of a singularity."""


class Workspace(NamedTuple):
    """Scratch of one worker, reused from pair to pair."""

    arm: FloatArray
    """Rows of `Problem.links` in A at the current posture; of groups that `is_placed` does not name
    only the shapes that were looked at."""
    is_placed: BoolArray
    """Whether the shapes of each group of the arm are up to date, shape (arm groups,)."""
    touching: IntArray
    """Rows of the two shapes found in contact last, shape (2,)."""
    environment_B: FloatArray
    """Environment shapes in B, packed."""
    environment_A: FloatArray
    """Environment shapes in A, packed; only those listed in `near` are up to date."""
    near: IntArray
    """Indices of the environment shapes within the arm's reach, shape (n_environment,)."""
    near_count: IntArray
    """Number of entries in `near`, shape (1,)."""
    link_R: FloatArray
    """Orientations of A, L1..L7 and the coupled links in A, shape (8 + coupled, 3, 3)."""
    link_p: FloatArray
    """Origins of A, L1..L7 and the coupled links in A [m], shape (8 + coupled, 3)."""
    last: IntArray
    """Last pair in contact: partner of the arm (-1 for none), arm shape, partner's shape; shape
    (3,)."""
    R_BW: FloatArray
    """Orientation of the environment W in the current base B, shape (3, 3)."""
    p_BW: FloatArray
    """Origin of W in B [m], shape (3,)."""
    R_AG: FloatArray
    """Orientation of the current goal in the arm base A, shape (3, 3)."""
    p_AG: FloatArray
    """Position of the goal in A [m], shape (3,)."""


def new_workspace(problem: Problem) -> Workspace:
    """Return scratch memory for one worker."""
    return Workspace(
        np.empty_like(problem.links),
        np.zeros(len(problem.link_first) - 1, np.bool_),
        np.zeros(2, np.int64),
        np.empty_like(problem.environment[0]),
        np.empty_like(problem.environment[0]),
        np.zeros(problem.environment_body.size, np.int64),
        np.zeros(1, np.int64),
        np.empty((8 + len(problem.coupled), 3, 3)),
        np.empty((8 + len(problem.coupled), 3)),
        np.full(3, -1, np.int64),
        np.eye(3),
        np.zeros(3),
        np.eye(3),
        np.zeros(3),
    )


@inner
def contact_code(problem: Problem, robot_body: int, other: int, partner: int) -> int:
    """Return the code of a contact between a robot body and body `other` of a partner."""
    if partner != ENVIRONMENT:
        other += problem.environment_bodies
    return robot_body * (problem.environment_bodies + problem.robot_bodies) + other


@inner
def base_contact(problem: Problem, work: Workspace, torso: int, mount: int) -> int:
    """Return the first contact of the body shapes of one mount with the environment.

    `work.environment_B` must be up to date.
    """
    body, environment, gaps = problem.body[torso], work.environment_B, problem.gap_base
    mounts, sphere = problem.body_mount, problem.body_spheres[torso, mount]
    first, boxes = problem.body_first, len(mounts)
    for j in range(len(environment)):
        x = environment[j, CENTRE] - sphere[0]
        y = environment[j, CENTRE + 1] - sphere[1]
        z = environment[j, CENTRE + 2] - sphere[2]
        apart = environment[j, BOUND] + sphere[3] + problem.widest_gap
        if apart <= 0.0 or x * x + y * y + z * z > apart * apart:
            continue
        for g in range(len(first) - 1):
            gap = gaps[boxes + g, j]
            if (
                mounts[first[g]] == mount
                and gap > 0.0
                and spheres_overlap(body, boxes + g, environment, j, gap)
                and group_touches(body, first, g, environment, j, gaps, work.touching)
            ):
                i = work.touching[0]
                return contact_code(
                    problem, problem.body_body[i], problem.environment_body[j], ENVIRONMENT
                )
    return NO_CONTACT


@inner
def gripper_environment_contact(problem: Problem, work: Workspace, state: int, goal: int) -> int:
    """Return the first contact of the gripper with the environment, the tool being at a goal."""
    R, p = problem.goal_R[state, goal], problem.goal_p[state, goal]
    return gripper_contact_at(problem, work, state, R, p)


@inner
def gripper_contact_at(
    problem: Problem, work: Workspace, state: int, R: FloatArray, p: FloatArray
) -> int:
    """Return the first contact of the gripper with the environment, the tool at a pose in W."""
    place_gripper(problem, work, R, p)
    arm, environment, gaps = work.arm, problem.environment[state], problem.gap_environment
    box = len(problem.link_body)
    for g in range(problem.gripper_groups):
        for j in range(len(environment)):
            gap = gaps[box + g, j]
            if (
                gap > 0.0
                and spheres_overlap(arm, box + g, environment, j, gap)
                and _environment_touches(problem, work, g, environment, j)
            ):
                return pair_code(problem, ENVIRONMENT, work.touching[0], j)
    return NO_CONTACT


@inner
def gripper_body_contact(problem: Problem, work: Workspace, body_A: FloatArray) -> int:
    """Return the first contact of the gripper with the robot's body, the tool being at the goal.

    The gripper's groups in A remain in `work.arm`.
    """
    place_gripper(problem, work, work.R_AG, work.p_AG)
    arm, gaps = work.arm, problem.gap_body
    box, others = len(problem.link_body), len(problem.body_body)
    for g in range(problem.gripper_groups):
        for h in range(len(problem.body_first) - 1):
            gap = gaps[box + g, others + h]
            if (
                gap > 0.0
                and spheres_overlap(arm, box + g, body_A, others + h, gap)
                and _body_touches(problem, work, body_A, g, h)
            ):
                return pair_code(problem, BODY, work.touching[0], work.touching[1])
    return NO_CONTACT


@inner
def place_gripper(problem: Problem, work: Workspace, R: FloatArray, p: FloatArray) -> None:
    """Place the groups of the last link such that the tool is at the pose (R, p)."""
    R7, p7 = work.link_R[7], work.link_p[7]
    F, f = problem.chain_R[7], problem.chain_p[7]
    for r in range(3):
        for c in range(3):
            R7[r, c] = R[r, 0] * F[c, 0] + R[r, 1] * F[c, 1] + R[r, 2] * F[c, 2]
    for r in range(3):
        p7[r] = p[r] - (R7[r, 0] * f[0] + R7[r, 1] * f[1] + R7[r, 2] * f[2])
    for g in range(problem.gripper_groups):
        _place_group(problem, work, g)


@inner
def arm_contact(problem: Problem, work: Workspace, body_A: FloatArray, q: FloatArray) -> int:
    """Return the first contact of the arm at joint angles q [rad], shape (7,).

    Contacts of the gripper with environment and body are not checked: they depend on the goal only.
    `gripper_body_contact` must have placed the gripper. The last pair in contact is checked first.
    """
    arm, environment, last, touching = work.arm, work.environment_A, work.last, work.touching
    gap_environment, gap_body, gap_arm = problem.gap_environment, problem.gap_body, problem.gap_arm
    near, near_count = work.near, work.near_count[0]
    distances, link_body, first = problem.distances, problem.link_body, problem.link_first
    body_body, body_first = problem.body_body, problem.body_first
    groups, body_groups = len(first) - 1, len(body_first) - 1
    boxes, body_boxes = len(problem.link_body), len(problem.body_body)
    link_poses(problem.chain_R, problem.chain_p, q, work.link_R, work.link_p)
    if len(problem.coupled):
        place_coupled_links(problem, work, q)
    partner, i, j = last[0], last[1], last[2]
    if partner >= 0 and pair_touches(problem, work, body_A, q, partner, i, j):
        return pair_code(problem, partner, i, j)
    for g in range(problem.gripper_groups, groups):
        box, body = boxes + g, link_body[first[g]]
        _place_group(problem, work, g)
        for n in range(near_count):
            j = near[n]
            gap = gap_environment[box, j]
            if (
                gap > 0.0
                and spheres_overlap(arm, box, environment, j, gap)
                and _environment_touches(problem, work, g, environment, j)
            ):
                last[0], last[1], last[2] = ENVIRONMENT, touching[0], j
                return pair_code(problem, ENVIRONMENT, last[1], j)
        for h in range(body_groups):
            gap = gap_body[box, body_boxes + h]
            if (
                gap > 0.0
                and spheres_overlap(arm, box, body_A, body_boxes + h, gap)
                and not are_apart(distances, body, body_body[body_first[h]], q, gap)
                and _body_touches(problem, work, body_A, g, h)
            ):
                last[0], last[1], last[2] = BODY, touching[0], touching[1]
                return pair_code(problem, BODY, last[1], last[2])
        for h in range(g):
            gap = gap_arm[box, boxes + h]
            if (
                gap > 0.0
                and spheres_overlap(arm, box, arm, boxes + h, gap)
                and not are_apart(distances, body, link_body[first[h]], q, gap)
                and _arm_touches(problem, work, g, h)
            ):
                last[0], last[1], last[2] = ARM, touching[0], touching[1]
                return pair_code(problem, ARM, last[1], last[2])
    return NO_CONTACT


@inner
def place_coupled_links(problem: Problem, work: Workspace, q: FloatArray) -> None:
    """Fill the poses of the links between coupled joints, behind the link of their joint."""
    for n in range(len(problem.coupled)):
        i = int(problem.coupled[n, 0])
        behind = (1.0 - problem.coupled[n, 1]) * problem.chain_p[i, 3] * q[i]
        for r in range(3):
            work.link_p[8 + n, r] = work.link_p[i + 1, r] - behind * work.link_R[i + 1, r, 2]
            for c in range(3):
                work.link_R[8 + n, r, c] = work.link_R[i + 1, r, c]


@jit
def at_goal(problem: Problem, work: Workspace) -> bool:
    """Return whether the tool is at the current goal, within AT_GOAL, for the current link poses.

    Forward kinematics thus confirms every solution that counts as reached.
    """
    R, p, F, f = work.link_R[7], work.link_p[7], problem.chain_R[7], problem.chain_p[7]
    worst = 0.0
    for r in range(3):
        along = p[r] + R[r, 0] * f[0] + R[r, 1] * f[1] + R[r, 2] * f[2] - work.p_AG[r]
        worst = max(worst, abs(along))
        for c in range(3):
            turned = R[r, 0] * F[0, c] + R[r, 1] * F[1, c] + R[r, 2] * F[2, c]
            worst = max(worst, abs(turned - work.R_AG[r, c]))
    return worst < AT_GOAL


@inner
def pair_touches(
    problem: Problem,
    work: Workspace,
    body_A: FloatArray,
    q: FloatArray,
    partner: int,
    i: int,
    j: int,
) -> bool:
    """Return whether arm shape i touches shape j of a partner.

    Args:
        problem: The scene.
        work: Workspace with the current link poses.
        body_A: The robot's other shapes in A.
        q: Joint angles of these poses [rad], shape (7,).
        partner: Partner of the arm.
        i: Shape of the arm.
        j: Shape of the partner.
    """
    arm, distances, body = work.arm, problem.distances, problem.link_body[i]
    _place_link(problem, work, i)
    if partner == ENVIRONMENT:
        return closer(arm, i, work.environment_A, j, problem.gap_environment[i, j])
    if partner == BODY:
        gap = problem.gap_body[i, j]
        other = problem.body_body[j]
        return closer(arm, i, body_A, j, gap) and not are_apart(distances, body, other, q, gap)
    _place_link(problem, work, j)
    gap, other = problem.gap_arm[i, j], problem.link_body[j]
    return closer(arm, i, arm, j, gap) and not are_apart(distances, body, other, q, gap)


@inner
def pair_code(problem: Problem, partner: int, i: int, j: int) -> int:
    """Return the contact code of arm shape i and shape j of a partner."""
    if partner == ENVIRONMENT:
        other = problem.environment_body[j]
    elif partner == BODY:
        other = problem.body_body[j]
    else:
        other = problem.link_body[j]
    return contact_code(problem, problem.link_body[i], other, partner)


@inner
def _environment_touches(
    problem: Problem, work: Workspace, g: int, environment: FloatArray, j: int
) -> bool:
    """Return whether group g of the arm touches environment shape j; fills `work.touching`.

    Call it, and the functions below, for a group whose bounding sphere touches.
    """
    arm, first, gaps = work.arm, problem.link_first, problem.gap_environment
    box = first[-1] + g
    return closer(arm, box, environment, j, gaps[box, j]) and _link_touches_shape(
        problem, work, g, environment, j, gaps
    )


@inner
def _link_touches_shape(
    problem: Problem, work: Workspace, g: int, b: FloatArray, j: int, gaps: FloatArray
) -> bool:
    """Return whether a shape of group g of the arm touches row j of b; fills `work.touching`.

    Only shapes whose bounding spheres touch that of the row are placed.
    """
    arm, first, touching = work.arm, problem.link_first, work.touching
    touching[0], touching[1] = first[g], j
    # The box of a single shape is the shape, and touches.
    if first[g + 1] - first[g] == 1:
        return True
    x, y, z = _seen_from_link(problem, work, g, b, j)
    for i in range(first[g], first[g + 1]):
        gap = gaps[i, j]
        if gap > 0.0 and _is_near(problem.links, i, x, y, z, b[j, BOUND] + gap):
            _place_link(problem, work, i)
            if closer(arm, i, b, j, gap):
                touching[0] = i
                return True
    return False


@inner
def _link_touches_group(
    problem: Problem,
    work: Workspace,
    g: int,
    b: FloatArray,
    first_b: IntArray,
    h: int,
    gaps: FloatArray,
) -> bool:
    """Return whether a shape of group g of the arm touches one of group h of b, in place.

    Fills `work.touching`. Of group g, only shapes whose bounding spheres touch that of the box
    around group h are placed.
    """
    if first_b[h + 1] - first_b[h] == 1:
        return _link_touches_shape(problem, work, g, b, first_b[h], gaps)
    arm, first, touching, box = work.arm, problem.link_first, work.touching, first_b[-1] + h
    x, y, z = _seen_from_link(problem, work, g, b, box)
    for i in range(first[g], first[g + 1]):
        gap = gaps[i, box]
        if gap <= 0.0 or not _is_near(problem.links, i, x, y, z, b[box, BOUND] + gap):
            continue
        _place_link(problem, work, i)
        if not closer(arm, i, b, box, gap):
            continue
        for j in range(first_b[h], first_b[h + 1]):
            gap = gaps[i, j]
            if gap > 0.0 and spheres_overlap(arm, i, b, j, gap) and closer(arm, i, b, j, gap):
                touching[0], touching[1] = i, j
                return True
    return False


@inner
def _seen_from_link(
    problem: Problem, work: Workspace, g: int, b: FloatArray, j: int
) -> tuple[float, float, float]:
    """Return the centre of row j of b in the frame of group g's link [m]."""
    frame = problem.link_frame[problem.link_first[g]]
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
def _body_touches(problem: Problem, work: Workspace, body_A: FloatArray, g: int, h: int) -> bool:
    """Return whether group g of the arm touches group h of the body; fills `work.touching`."""
    arm, first, others, gaps = work.arm, problem.link_first, problem.body_first, problem.gap_body
    box, other = first[-1] + g, others[-1] + h
    return closer(arm, box, body_A, other, gaps[box, other]) and _link_touches_group(
        problem, work, g, body_A, others, h, gaps
    )


@inner
def _arm_touches(problem: Problem, work: Workspace, g: int, h: int) -> bool:
    """Return whether two groups of the arm touch; fills `work.touching`."""
    arm, first, gaps = work.arm, problem.link_first, problem.gap_arm
    box, other = first[-1] + g, first[-1] + h
    if not closer(arm, box, arm, other, gaps[box, other]):
        return False
    _place_shapes(problem, work, h)
    return _link_touches_group(problem, work, g, arm, first, h, gaps)


@inner
def _place_group(problem: Problem, work: Workspace, g: int) -> None:
    """Place the box around a group of the arm in A; its shapes have to follow."""
    _place_link(problem, work, problem.link_first[-1] + g)
    work.is_placed[g] = False


@inner
def _place_shapes(problem: Problem, work: Workspace, g: int) -> None:
    """Place the shapes of a group of the arm in A unless they are up to date."""
    if not work.is_placed[g]:
        for i in range(problem.link_first[g], problem.link_first[g + 1]):
            _place_link(problem, work, i)
        work.is_placed[g] = True


@inner
def _place_link(problem: Problem, work: Workspace, i: int) -> None:
    """Place arm shape i in A from the link poses in the workspace."""
    frame = problem.link_frame[i]
    move(work.link_R[frame], work.link_p[frame], problem.links, i, work.arm, i)

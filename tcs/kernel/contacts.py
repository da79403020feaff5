"""First contact found of base, gripper and arm with the environment and with the robot itself.

A contact is a code `robot_body * bodies + other`, where `other` numbers the bodies of the
environment first and then those of the robot; NO_CONTACT where nothing touches.
"""

from __future__ import annotations

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, int_constant, jit
from tcs.kernel.collide import BOUND, CENTRE, closer, sphere_is_near, spheres_overlap
from tcs.kernel.distances import are_apart
from tcs.kernel.group_contacts import group_touches
from tcs.kernel.kinematics import link_poses
from tcs.kernel.link_contacts import arm_touches, body_touches, environment_touches
from tcs.kernel.problem import Problem
from tcs.kernel.workspace import Workspace, place_group, place_link

NO_CONTACT = -1
ENVIRONMENT, BODY, ARM = int_constant(0), int_constant(1), int_constant(2)
"""Partner of the arm in a contact."""
BASE_FIXED, TORSO_MOUNTED = int_constant(0), int_constant(1)
"""Mount of a body shape: fixed to the base, or mounted on the torso."""
AT_GOAL = 1e-7
"""Greatest pose error [m, and as entries of a rotation] of a solution. The closed form is good to
1e-12 except within 1e-7 rad of a singularity."""


@inner
def contact_code(problem: Problem, robot_body: int, other: int, partner: int) -> int:
    """Return the code of a contact between a robot body and body `other` of a partner."""
    if partner != ENVIRONMENT:
        other += problem.environment.bodies
    return robot_body * (problem.environment.bodies + problem.robot_bodies) + other


@inner
def base_contact(problem: Problem, work: Workspace, torso: int, mount: int) -> int:
    """Return the first contact of the body shapes of one mount with the environment.

    `work.environment_B` must be up to date.
    """
    body, environment = problem.body.shapes[torso], work.environment_B
    gaps = problem.clearances.base
    mounts, sphere = problem.body.mount, problem.body.spheres[torso, mount]
    groups, first, boxes = problem.body.groups, problem.body.groups.first, len(mounts)
    for j in range(len(environment)):
        x = environment[j, CENTRE] - sphere[0]
        y = environment[j, CENTRE + 1] - sphere[1]
        z = environment[j, CENTRE + 2] - sphere[2]
        apart = environment[j, BOUND] + sphere[3] + problem.clearances.widest
        if apart <= 0.0 or x * x + y * y + z * z > apart * apart:
            continue
        for g in range(len(first) - 1):
            gap = gaps[boxes + g, j]
            if (
                mounts[first[g]] == mount
                and gap > 0.0
                and spheres_overlap(body, boxes + g, environment, j, gap)
                and group_touches(body, groups, g, environment, j, gaps, work.touching)
            ):
                i = work.touching[0]
                return contact_code(
                    problem, problem.body.body[i], problem.environment.body[j], ENVIRONMENT
                )
    return NO_CONTACT


@inner
def upper_contact(problem: Problem, work: Workspace, torso: int) -> int:
    """Return the first contact of what the base carries at a stop: torso, head, arms at rest.

    With `base_contact` of what is fixed to the base, it decides whether a configuration counts.
    `work.environment_B` must be up to date.
    """
    code = base_contact(problem, work, torso, TORSO_MOUNTED)
    return code if code != NO_CONTACT else rest_contact(problem, work, torso)


@inner
def rest_contact(problem: Problem, work: Workspace, torso: int) -> int:
    """Return the first contact of the arm in its first rest posture with the environment.

    If another rest posture touches nothing, neither does this one: NO_CONTACT.
    """
    code, touching = NO_CONTACT, work.touching
    for n in range(problem.rest.shapes.shape[1]):
        found = touches_at_rest(problem, work, torso, n)
        if not found:
            return NO_CONTACT
        if n == 0:
            code = pair_code(problem, ENVIRONMENT, touching[0], touching[1])
    return code


@inner
def touches_at_rest(problem: Problem, work: Workspace, torso: int, n: int) -> bool:
    """Return whether the arm in rest posture n touches the environment; fills `work.touching`."""
    environment, gaps = work.environment_B, problem.clearances.environment
    arm, spheres = problem.rest.shapes[torso, n], problem.rest.spheres[torso]
    groups, boxes, widest = problem.links.groups, len(problem.links.body), problem.clearances.widest
    for j in range(len(environment)):
        if not spheres_overlap(spheres, n, environment, j, widest) or not sphere_is_near(
            spheres, n, environment, j, widest
        ):
            continue
        for g in range(len(groups.first) - 1):
            gap = gaps[boxes + g, j]
            if (
                gap > 0.0
                and spheres_overlap(arm, boxes + g, environment, j, gap)
                and group_touches(arm, groups, g, environment, j, gaps, work.touching)
            ):
                return True
    return False


@inner
def gripper_environment_contact(problem: Problem, work: Workspace, state: int, goal: int) -> int:
    """Return the first contact of the gripper with the environment, the tool being at a goal."""
    R, p = problem.goals.R[state, goal], problem.goals.p[state, goal]
    return gripper_contact_at(problem, work, state, R, p)


@inner
def gripper_contact_at(
    problem: Problem, work: Workspace, state: int, R: FloatArray, p: FloatArray
) -> int:
    """Return the first contact of the gripper with the environment, the tool at a pose in W."""
    place_gripper(problem, work, R, p)
    arm, environment = work.arm, problem.environment.shapes[state]
    gaps = problem.clearances.environment
    box = len(problem.links.body)
    for g in range(problem.links.gripper_groups):
        for j in range(len(environment)):
            gap = gaps[box + g, j]
            if (
                gap > 0.0
                and spheres_overlap(arm, box + g, environment, j, gap)
                and environment_touches(problem, work, g, environment, j)
            ):
                return pair_code(problem, ENVIRONMENT, work.touching[0], j)
    return NO_CONTACT


@inner
def gripper_body_contact(problem: Problem, work: Workspace, body_A: FloatArray) -> int:
    """Return the first contact of the gripper with the robot's body, the tool being at the goal.

    The gripper's groups in A remain in `work.arm`.
    """
    place_gripper(problem, work, work.R_AG, work.p_AG)
    arm, gaps = work.arm, problem.clearances.body
    box, others = len(problem.links.body), len(problem.body.body)
    for g in range(problem.links.gripper_groups):
        for h in range(len(problem.body.groups.first) - 1):
            gap = gaps[box + g, others + h]
            if (
                gap > 0.0
                and spheres_overlap(arm, box + g, body_A, others + h, gap)
                and body_touches(problem, work, body_A, g, h)
            ):
                return pair_code(problem, BODY, work.touching[0], work.touching[1])
    return NO_CONTACT


@inner
def place_gripper(problem: Problem, work: Workspace, R: FloatArray, p: FloatArray) -> None:
    """Place the groups of the last link such that the tool is at the pose (R, p)."""
    R7, p7 = work.link_R[7], work.link_p[7]
    F, f = problem.chain.R[7], problem.chain.p[7]
    for r in range(3):
        for c in range(3):
            R7[r, c] = R[r, 0] * F[c, 0] + R[r, 1] * F[c, 1] + R[r, 2] * F[c, 2]
    for r in range(3):
        p7[r] = p[r] - (R7[r, 0] * f[0] + R7[r, 1] * f[1] + R7[r, 2] * f[2])
    for g in range(problem.links.gripper_groups):
        place_group(problem, work, g)


@inner
def arm_contact(problem: Problem, work: Workspace, body_A: FloatArray, q: FloatArray) -> int:
    """Return the first contact of the arm at joint angles q [rad], shape (7,).

    Contacts of the gripper with environment and body are not checked: they depend on the goal only.
    `gripper_body_contact` must have placed the gripper. The last pair in contact is checked first.
    """
    arm, environment, last, touching = work.arm, work.environment_A, work.last, work.touching
    gaps = problem.clearances
    gap_environment, gap_body, gap_arm = gaps.environment, gaps.body, gaps.arm
    near, near_count = work.near, work.near_count[0]
    distances, link_body, first = problem.distances, problem.links.body, problem.links.groups.first
    body_body, body_first = problem.body.body, problem.body.groups.first
    groups, body_groups = len(first) - 1, len(body_first) - 1
    boxes, body_boxes = len(problem.links.body), len(problem.body.body)
    link_poses(problem.chain.R, problem.chain.p, q, work.link_R, work.link_p)
    if len(problem.chain.coupled):
        place_coupled_links(problem, work, q)
    partner, i, j = last[0], last[1], last[2]
    if partner >= 0 and pair_touches(problem, work, body_A, q, partner, i, j):
        if partner == ARM and problem.links.frame[j] == 7:
            work.met_gripper[0] = True
        return pair_code(problem, partner, i, j)
    for g in range(problem.links.gripper_groups, groups):
        box, body = boxes + g, link_body[first[g]]
        place_group(problem, work, g)
        for n in range(near_count):
            j = near[n]
            gap = gap_environment[box, j]
            if (
                gap > 0.0
                and spheres_overlap(arm, box, environment, j, gap)
                and environment_touches(problem, work, g, environment, j)
            ):
                last[0], last[1], last[2] = ENVIRONMENT, touching[0], j
                return pair_code(problem, ENVIRONMENT, last[1], j)
        for h in range(body_groups):
            gap = gap_body[box, body_boxes + h]
            if (
                gap > 0.0
                and spheres_overlap(arm, box, body_A, body_boxes + h, gap)
                and not are_apart(distances, body, body_body[body_first[h]], q, gap)
                and body_touches(problem, work, body_A, g, h)
            ):
                last[0], last[1], last[2] = BODY, touching[0], touching[1]
                return pair_code(problem, BODY, last[1], last[2])
        for h in range(g):
            gap = gap_arm[box, boxes + h]
            if (
                gap > 0.0
                and spheres_overlap(arm, box, arm, boxes + h, gap)
                and not are_apart(distances, body, link_body[first[h]], q, gap)
                and arm_touches(problem, work, g, h)
            ):
                last[0], last[1], last[2] = ARM, touching[0], touching[1]
                if h < problem.links.gripper_groups:
                    work.met_gripper[0] = True
                return pair_code(problem, ARM, last[1], last[2])
    return NO_CONTACT


@inner
def place_coupled_links(problem: Problem, work: Workspace, q: FloatArray) -> None:
    """Fill the poses of the links between coupled joints, behind the link of their joint."""
    for n in range(len(problem.chain.coupled)):
        i = int(problem.chain.coupled[n, 0])
        behind = (1.0 - problem.chain.coupled[n, 1]) * problem.chain.p[i, 3] * q[i]
        for r in range(3):
            work.link_p[8 + n, r] = work.link_p[i + 1, r] - behind * work.link_R[i + 1, r, 2]
            for c in range(3):
                work.link_R[8 + n, r, c] = work.link_R[i + 1, r, c]


@jit
def at_goal(problem: Problem, work: Workspace) -> bool:
    """Return whether the tool is at the current goal, within AT_GOAL, for the current link poses.

    Forward kinematics thus confirms every solution that counts as reached.
    """
    R, p, F, f = work.link_R[7], work.link_p[7], problem.chain.R[7], problem.chain.p[7]
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
    arm, distances, body = work.arm, problem.distances, problem.links.body[i]
    place_link(problem, work, i)
    if partner == ENVIRONMENT:
        return closer(arm, i, work.environment_A, j, problem.clearances.environment[i, j])
    if partner == BODY:
        gap = problem.clearances.body[i, j]
        other = problem.body.body[j]
        return closer(arm, i, body_A, j, gap) and not are_apart(distances, body, other, q, gap)
    place_link(problem, work, j)
    gap, other = problem.clearances.arm[i, j], problem.links.body[j]
    return closer(arm, i, arm, j, gap) and not are_apart(distances, body, other, q, gap)


@inner
def pair_code(problem: Problem, partner: int, i: int, j: int) -> int:
    """Return the contact code of arm shape i and shape j of a partner."""
    if partner == ENVIRONMENT:
        other = problem.environment.body[j]
    elif partner == BODY:
        other = problem.body.body[j]
    else:
        other = problem.links.body[j]
    return contact_code(problem, problem.links.body[i], other, partner)

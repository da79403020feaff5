"""Goals that are reachable by construction, at the edges of what a search finds.

A posture within the limits is drawn first, forward kinematics gives the goal, and shapes about the
robot leave the posture free. A goal that scoring then does not reach is a miss, whatever any scan
finds. Forward kinematics and windows are those of the plain-loop reference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.kernel.arrays import (
    BOX,
    CAPSULE,
    SPHERE,
    Chain,
    FloatArray,
    GridArrays,
    SceneArrays,
    Shapes,
)
from tcs.kernel.base_pose import environment_in_arm_base, goal_in_arm_base, place_base
from tcs.kernel.cache import jit
from tcs.kernel.contacts import (
    BASE_FIXED,
    NO_CONTACT,
    arm_contact,
    base_contact,
    gripper_body_contact,
    gripper_environment_contact,
    upper_contact,
)
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import Rows, rows_at
from tcs.kernel.scores import Scores
from tcs.kernel.sweep import score
from tcs.kernel.views import unowned
from tcs.kernel.workspace import Workspace, new_workspace
from tests.reference.kinematics import (
    Pose,
    compose,
    distance,
    elbow,
    free_joint,
    link_poses,
    rot_z,
    shapes_of,
    solutions,
)

SHOULDER, ELBOW, WRIST = 1, 3, 5
"""Indices of the joints at some angles of which the arm is singular, or its closed form is."""
MARGIN_LEFT = 1e-5
"""How much farther apart than needed shapes are at the posture that makes a goal [m]: stored joints
are float32, which moves a far corner by 1e-6 m."""
CLUTTER = 10
"""Number of shapes added within an arm's length of the arm base."""


@dataclass(frozen=True, eq=False)
class Constructed:
    """Goals of one configuration, each with a posture that reaches it."""

    scene: SceneArrays
    """With one goal for each posture, the same in every state of the environment."""
    grid: GridArrays
    configuration: int
    """Flat index of the initial configuration."""
    postures: FloatArray
    """Joint angles [rad], shape (goals, 7)."""

    def scores(self, measure: str = "isotropy") -> Scores:
        """Return the kernel's scores of the configuration, shapes (1, goals, ...)."""
        row = rows_at(self.grid, [self.configuration])
        return score(build_problem(self.scene, measure), row)


def singular_angles(chain: Chain, joint: int) -> list[float]:
    """Return the two angles at which a joint is singular, limits aside [rad].

    Of the elbow, where the arm is stretched and folded; of any other joint, where the axes before
    and after it come nearest to parallel.
    """
    if joint == ELBOW:
        _, _, first = elbow(chain, 0.0)
    else:
        before, after = chain.R[joint].T[:, 2], chain.R[joint + 1][:, 2]
        first = math.atan2(before[1], before[0]) - math.atan2(after[1], after[0])
    return [math.remainder(first + half, 2.0 * math.pi) for half in (0.0, math.pi)]


def random_posture(rng: np.random.Generator, chain: Chain) -> FloatArray:
    """Return random joint angles within the limits [rad], shape (7,)."""
    limited = np.isfinite(chain.lower)
    return rng.uniform(
        np.where(limited, chain.lower, -np.pi), np.where(limited, chain.upper, np.pi)
    )


def near_singular(
    rng: np.random.Generator, chain: Chain, joint: int, away: float
) -> FloatArray | None:
    """Return a random posture with one joint `away` from singular [rad], None if limits forbid."""
    angles = [a + s * away for a in singular_angles(chain, joint) for s in (1.0, -1.0)]
    kept = [a for a in angles if chain.lower[joint] <= a <= chain.upper[joint]]
    if not kept:
        return None
    q = random_posture(rng, chain)
    q[joint] = rng.choice(kept)
    return q


def with_goals(scene: SceneArrays, grid: GridArrays, h: int, postures: FloatArray) -> SceneArrays:
    """Return the scene with the tool poses of postures as goals."""
    X_WA = arm_base(scene, grid, h)
    poses = [compose(X_WA, link_poses(scene.chain, q)[-1]) for q in postures]
    states = grid.environment_states
    return scene._replace(
        goal_R=np.repeat(np.array([R for R, _ in poses])[None], states, axis=0),
        goal_p=np.repeat(np.array([p for _, p in poses])[None], states, axis=0),
    )


def free_postures(scene: SceneArrays, grid: GridArrays, h: int, postures: FloatArray) -> FloatArray:
    """Return those postures at which arm and gripper touch nothing, MARGIN_LEFT to spare."""
    eased = scene._replace(
        margin=scene.margin + MARGIN_LEFT, self_margin=scene.self_margin + MARGIN_LEFT
    )
    problem, row = build_problem(with_goals(eased, grid, h, postures)), rows_at(grid, [h])
    work = new_workspace(problem)
    free = [posture_contact(problem, work, row, g, q) == NO_CONTACT for g, q in enumerate(postures)]
    return postures[np.array(free, bool)]


def near_singular_goals(
    rng: np.random.Generator,
    scene: SceneArrays,
    grid: GridArrays,
    joint: int,
    away: float,
    count: int,
) -> Constructed | None:
    """Return goals at one random configuration whose postures are nearly singular.

    Args:
        rng: Random generator.
        scene: The scene; shapes are added to it, and its goals replaced.
        grid: Its grid.
        joint: Index of the joint, such as ELBOW.
        away: How far the joint is from singular [rad].
        count: How many goals.

    Returns:
        The goals, None if the limits keep the joint from its singular angles.
    """
    if near_singular(rng, scene.chain, joint, away) is None:
        return None
    for _ in range(20):
        crowded, h = cluttered(rng, scene, grid)
        kept = np.empty((0, 7))
        for _ in range(20):
            drawn = [near_singular(rng, scene.chain, joint, away) for _ in range(4 * count)]
            postures = np.array([q for q in drawn if q is not None])
            kept = np.concatenate([kept, free_postures(crowded, grid, h, postures)])[:count]
            if len(kept) == count:
                return Constructed(with_goals(crowded, grid, h, kept), grid, h, kept)
    return None


def same_branch(chain: Chain, X_AG: Pose, q: FloatArray, angle: float) -> FloatArray:
    """Return the solution at an angle of the free joint that is nearest to joint angles q."""
    found = [s.q for s in solutions(chain, X_AG, angle).values()]
    off = [np.abs(np.remainder(f - q + np.pi, 2 * np.pi) - np.pi).max() for f in found]
    nearest = found[int(np.argmin(off))]
    return q + np.remainder(nearest - q + np.pi, 2 * np.pi) - np.pi


def between_limits(
    rng: np.random.Generator, scene: SceneArrays, grid: GridArrays, width: float
) -> Constructed | None:
    """Return a goal whose posture lies in a window of the free joint between two limits.

    Limits of two joints are moved to where the window ends; all others are cut to 1 rad about the
    posture. None if a try fails.

    Args:
        rng: Random generator.
        scene: The scene; its goals and limits are replaced.
        grid: Its grid.
        width: Width of the window [rad of the free joint].
    """
    chain = scene.chain
    free = free_joint(chain)
    crowded, h = cluttered(rng, scene, grid, 3)
    drawn = np.array([random_posture(rng, chain) for _ in range(16)])
    kept = free_postures(crowded, grid, h, drawn)
    if not len(kept):
        return None
    q = kept[0]
    X_AG = link_poses(chain, q)[-1]
    share = rng.uniform(0.2, 0.8)
    sides = [same_branch(chain, X_AG, q, q[free] + s * width) for s in (-share, 1.0 - share)]
    lower, upper = np.maximum(chain.lower, q - 1.0), np.minimum(chain.upper, q + 1.0)
    others = rng.permutation([i for i in range(7) if i != free])
    # One joint ends the window to either side: the one that moves away from the posture there.
    for side, i in zip(sides, others, strict=False):
        if abs(side[i] - q[i]) < 1e-5 or abs(side[i] - q[i]) > 0.5:
            return None
        if side[i] < q[i]:
            lower[i] = side[i]
        else:
            upper[i] = side[i]
    if np.any(q < lower + 1e-6) or np.any(q > upper - 1e-6):
        return None
    scene = crowded._replace(chain=chain._replace(lower=lower, upper=upper))
    return Constructed(with_goals(scene, grid, h, q[None]), grid, h, q[None])


def between_contacts(
    rng: np.random.Generator, scene: SceneArrays, grid: GridArrays, width: float
) -> Constructed | None:
    """Return a goal whose posture lies in a window that one pair of shapes leaves, on both sides.

    A large sphere lies inside the curve on which a link moves, so that the link is farthest from it
    at the posture. All limits are cut to 0.5 rad about the posture. None if a try fails.

    Args:
        rng: Random generator.
        scene: The scene; a shape is added, goals and limits are replaced.
        grid: Its grid.
        width: Width of the window [rad of the free joint].
    """
    chain = scene.chain
    free = free_joint(chain)
    crowded, h = cluttered(rng, scene, grid, 3)
    drawn = np.array([random_posture(rng, chain) for _ in range(16)])
    kept = free_postures(crowded, grid, h, drawn)
    if not len(kept):
        return None
    q = kept[0]
    X_AG = link_poses(chain, q)[-1]
    sides = [same_branch(chain, X_AG, q, q[free] + s * width) for s in (-0.5, 0.0, 0.5)]
    candidates = [i for i, frame in enumerate(scene.arm.frame) if 3 <= frame <= 5]
    i = int(rng.choice(candidates))
    frame, shape = int(scene.arm.frame[i]), shapes_of(scene.arm, 0)[i]
    links = [shape.moved(link_poses(chain, side)[frame - 1]) for side in sides]
    bend = links[0].p + links[2].p - 2.0 * links[1].p
    speed = np.linalg.norm(links[2].p - links[0].p)
    if np.linalg.norm(bend) < 1e-9 or speed < 1e-6:
        return None
    # The centre of curvature, and as far again.
    radius = (speed / 2.0) ** 2 / np.linalg.norm(bend)
    p = links[1].p + bend / np.linalg.norm(bend) * (2.0 * radius + 0.1)
    obstacle = type(shape)(SPHERE, np.zeros(3), np.eye(3), p, 0.0, 0)
    left, middle, right = (distance(link, obstacle) for link in links)
    gap = max(scene.margin, shape.pad)
    if middle < max(left, right) + 2.0 * MARGIN_LEFT or max(left, right) - gap < 0.01:
        return None
    X_WA = arm_base(scene, grid, h)
    where = X_WA[0] @ p + X_WA[1]
    tight = with_obstacle(
        crowded, SPHERE, np.array([max(left, right) - gap, 0.0, 0.0]), np.eye(3), where
    )
    lower, upper = np.maximum(chain.lower, q - 0.5), np.minimum(chain.upper, q + 0.5)
    tight = tight._replace(chain=chain._replace(lower=lower, upper=upper))
    problem = build_problem(tight)
    if not base_is_free(problem, new_workspace(problem), rows_at(grid, [h])):
        return None
    if not len(free_postures(tight, grid, h, q[None])):
        return None
    return Constructed(with_goals(tight, grid, h, q[None]), grid, h, q[None])


def cluttered(
    rng: np.random.Generator, scene: SceneArrays, grid: GridArrays, number: int = CLUTTER
) -> tuple[SceneArrays, int]:
    """Return the scene with shapes added about one random configuration, whose base stays free."""
    problem = build_problem(scene)
    while True:
        h = int(rng.integers(grid.size))
        row = rows_at(grid, [h])
        if not base_is_free(problem, new_workspace(problem), row):
            continue
        at = arm_base(scene, grid, h)[1]
        added = scene
        for k in range(number):
            more = with_obstacle(added, *random_shape(rng, at, k))
            crowded = build_problem(more)
            if base_is_free(crowded, new_workspace(crowded), row):
                added = more
        return added, h


def random_shape(
    rng: np.random.Generator, centre: FloatArray, k: int
) -> tuple[int, FloatArray, FloatArray, FloatArray]:
    """Return type, size [m], orientation and position [m] of a shape within 0.9 m of a point."""
    shape_type = (BOX, CAPSULE, SPHERE)[k % 3]
    size = rng.uniform(0.03, 0.12, 3)
    direction = rng.normal(size=3)
    p = centre + direction / np.linalg.norm(direction) * rng.uniform(0.3, 0.9)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return shape_type, size, axes * np.sign(np.linalg.det(axes)), p


def with_obstacle(
    scene: SceneArrays, shape_type: int, size: FloatArray, R: FloatArray, p: FloatArray
) -> SceneArrays:
    """Return the scene with one more shape in the environment, checked against everything."""
    old = scene.environment
    states = len(old.p)
    size = size * {SPHERE: [1, 0, 0], CAPSULE: [1, 1, 0], BOX: [1, 1, 1]}[shape_type]
    environment = Shapes(
        type=np.append(old.type, np.int8(shape_type)),
        size=np.concatenate([old.size, size[None]]),
        pad=np.append(old.pad, 0.0),
        body=np.append(old.body, old.body.max(initial=0)),
        frame=np.append(old.frame, np.int8(0)),
        R=np.concatenate([old.R, np.repeat(R[None, None], states, axis=0)], axis=1),
        p=np.concatenate([old.p, np.repeat(p[None, None], states, axis=0)], axis=1),
    )

    def more(mask: np.ndarray) -> np.ndarray:
        return np.concatenate([mask, np.ones((len(mask), 1), bool)], axis=1)

    return scene._replace(
        environment=environment,
        arm_vs_environment=more(scene.arm_vs_environment),
        body_vs_environment=more(scene.body_vs_environment),
    )


def arm_base(scene: SceneArrays, grid: GridArrays, h: int) -> Pose:
    """Return X_WA at configuration h."""
    _, x, y, yaw, torso = (int(i) for i in np.unravel_index(h, grid.shape))
    X_WB = rot_z(grid.base_yaw[yaw]), np.array([grid.base_x[x], grid.base_y[y], 0.0])
    return compose(X_WB, (scene.arm_base_R[torso], scene.arm_base_p[torso]))


@jit
def base_is_free(owned_problem: Problem, owned_work: Workspace, owned_row: Rows) -> bool:
    """Return whether the robot at rest touches nothing at a configuration."""
    problem, work, row = unowned(owned_problem), unowned(owned_work), unowned(owned_row)
    torso = row.torso[0]
    place_base(problem, work, row, 0)
    return (
        base_contact(problem, work, BASE_FIXED, BASE_FIXED) == NO_CONTACT
        and upper_contact(problem, work, torso) == NO_CONTACT
    )


@jit
def posture_contact(
    owned_problem: Problem, owned_work: Workspace, owned_row: Rows, goal: int, q: FloatArray
) -> int:
    """Return a contact of arm or gripper at joint angles q that hold the tool at a goal."""
    problem, work, row = unowned(owned_problem), unowned(owned_work), unowned(owned_row)
    state, torso = row.state[0], row.torso[0]
    place_base(problem, work, row, 0)
    code = gripper_environment_contact(problem, work, state, goal)
    if code != NO_CONTACT:
        return code
    goal_in_arm_base(problem, work, state, torso, goal)
    body_A = problem.body.shapes_A[torso]
    code = gripper_body_contact(problem, work, body_A)
    if code != NO_CONTACT:
        return code
    environment_in_arm_base(problem, work, torso)
    work.last[0] = -1
    return arm_contact(problem, work, body_A, q)

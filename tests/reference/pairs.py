"""Reference implementation of the score of one configuration at one goal, built on `kinematics`.

With it: goals with freedom, goals of two arms at once, and tables of distances.

It samples the same angles of the free joint as the kernel, so that results can be compared one by
one; where none is free, it halves the intervals in which joints move far, by a rule of its own.
`dense` measures whether these samples suffice. Between two samples in contact, the kernel
(`clearance.free_between`) may find a collision-free angle while the reference returns ARM_BLOCKED.
`confirms` then checks the kernel's solution.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tcs.kernel.analytic.score_pair import REFINE_SAMPLES, REFINEMENTS
from tcs.kernel.arrays import BodyDistances, BoolArray, FloatArray, GridArrays, SceneArrays
from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.kernel.five_joints.turned import turned_chain
from tcs.kernel.freedom.forms import AXIS, COLUMNS, FOLD, HALF, ROTATES, TILT
from tcs.kernel.freedom.goals import FreeGoals
from tcs.kernel.scores import (
    ARM_BLOCKED,
    BODY_BLOCKED,
    GRIPPER_BLOCKED_BY_ENVIRONMENT,
    GRIPPER_BLOCKED_BY_ROBOT,
    JOINT_LIMITS,
    REACHED,
    TOO_FAR,
)
from tcs.kernel.verification.newton_solutions import newton_solutions, within
from tcs.kernel.verification.plain_dexterity import measured, prescribed
from tests.reference.candidates import Candidate, elbow_arcs, fast_candidates, find_candidates
from tests.reference.kinematics import (
    PlacedShape,
    Pose,
    compose,
    coupled_pose,
    distance,
    free_joint,
    inverse,
    jacobian,
    link_poses,
    rot_z,
    separation,
    shapes_of,
    solutions,
)

STEP = 4e-5
"""Distance that one step of a corner stands for [m]."""
MOST = 255 * STEP
"""Greatest distance of a corner [m]."""
AT_LIMIT = 1e-12
"""Rounding of the slack of an angle that is tried at its limit."""


@dataclass(frozen=True)
class Verdict:
    """Result of `score`."""

    reason: int
    """Code of the reason, REACHED or why not."""
    dexterity: float = 0.0
    """Dexterity by the requested measure, 0 if not reached."""
    q: FloatArray | None = None
    """Joint angles of the solution [rad], shape (7,), if reached."""
    clearance: float = math.inf
    """Least distance of a checked pair from its collision threshold [m]; tests leave out results
    that rounding decides."""


NO_BOUNDS: Mapping[frozenset[int], float] = {}
FAR = 0.01
"""Least distance of two shapes beyond the required one [m] at which it is not computed."""


@dataclass
class PlacedScene:
    """A scene with the robot at one configuration; all poses are in the arm base A."""

    scene: SceneArrays
    environment: list[PlacedShape]
    body: list[PlacedShape]
    X_AG: Pose
    clearance: float = math.inf

    def touches(
        self,
        a: PlacedShape,
        b: PlacedShape,
        margin: float,
        bounds: Mapping[frozenset[int], float] = NO_BOUNDS,
    ) -> bool:
        """Return whether two shapes collide, and update `clearance`.

        Args:
            a: One shape.
            b: The other.
            margin: Distance that they must keep without paddings [m].
            bounds: Lower bounds of the distance of bodies, for two shapes of the robot [m].
        """
        required = max(margin, a.pad + b.pad)
        # Bounding spheres well apart make the exact distance unnecessary.
        if float(np.linalg.norm(a.p - b.p)) - a.sphere - b.sphere > required + FAR:
            return False
        # So does a gap along one axis, which takes far less time.
        if separation(a, b) - a.radius - b.radius > required + FAR:
            return False
        excess = distance(a, b) - required
        excess = max(excess, bounds.get(frozenset((a.body, b.body)), -math.inf) - required)
        self.clearance = min(self.clearance, abs(excess))
        return excess < 0.0

    def any_touch(
        self,
        first: list[PlacedShape],
        others: list[PlacedShape],
        checked: BoolArray,
        margin: float,
        bounds: Mapping[frozenset[int], float] = NO_BOUNDS,
    ) -> bool:
        """Return whether any checked pair of shapes collides.

        Args:
            first: n shapes.
            others: m shapes.
            checked: Whether each pair is checked, shape (n, m).
            margin: Distance that they must keep without paddings [m].
            bounds: As for `touches`.
        """
        if not (first and others):
            return False
        p, sphere, pad = (_column(first, name)[:, None] for name in ("p", "sphere", "pad"))
        q, reach, more = (_column(others, name)[None] for name in ("p", "sphere", "pad"))
        near = (
            np.linalg.norm(p - q, axis=2) - sphere - reach <= np.maximum(margin, pad + more) + FAR
        )
        pairs = np.argwhere(near & checked)
        return any(self.touches(first[i], others[j], margin, bounds) for i, j in pairs)

    def arm_at(self, q: FloatArray) -> list[PlacedShape]:
        """Return the arm's shapes in A at joint angles q [rad]."""
        poses = link_poses(self.scene.chain, q)
        shapes = shapes_of(self.scene.arm, 0)
        return [
            s.moved(coupled_pose(self.scene.chain, q, poses, int(f)))
            for s, f in zip(shapes, self.scene.arm.frame, strict=True)
        ]

    def touches_at_rest(self) -> bool:
        """Return whether the arm touches the environment in all of its rest postures."""
        scene = self.scene
        return len(scene.rest) > 0 and all(
            self.any_touch(self.arm_at(q), self.environment, scene.arm_vs_environment, scene.margin)
            for q in scene.rest
        )

    def gripper_touches(self, with_body: bool) -> bool:
        """Return whether the gripper at the goal touches the robot's body, or the environment."""
        X_A7 = compose(self.X_AG, inverse((self.scene.chain.R[7], self.scene.chain.p[7])))
        others = self.body if with_body else self.environment
        checked = self.scene.arm_vs_body if with_body else self.scene.arm_vs_environment
        margin = self.scene.self_margin if with_body else self.scene.margin
        held = self.scene.arm.frame == 7
        shapes = [s.moved(X_A7) for s in itertools.compress(shapes_of(self.scene.arm, 0), held)]
        return self.any_touch(shapes, others, checked[held], margin)

    def arm_touches(self, q: FloatArray) -> bool:
        """Return whether the arm at joint angles q touches the environment, the body or itself.

        Contacts of the gripper with environment and body are left to `gripper_touches`.
        """
        arm, scene = self.arm_at(q), self.scene
        free = scene.arm.frame != 7
        links = list(itertools.compress(arm, free))
        once = np.tril(scene.arm_vs_arm, -1) & (free[:, None] | free[None])
        bounds = bounds_at(scene.distances, q)
        return (
            self.any_touch(links, self.environment, scene.arm_vs_environment[free], scene.margin)
            or self.any_touch(links, self.body, scene.arm_vs_body[free], scene.self_margin, bounds)
            or self.any_touch(arm, arm, once, scene.self_margin, bounds)
        )


def _column(shapes: list[PlacedShape], name: str) -> FloatArray:
    """Return one attribute of shapes, shape (n, ...)."""
    return np.array([getattr(shape, name) for shape in shapes])


def placed_scene(
    scene: SceneArrays, grid: GridArrays, h: int, goal: int
) -> tuple[PlacedScene, bool]:
    """Return the scene with the robot at configuration h, and whether it is in contact at rest."""
    state, x, y, yaw, torso = (int(i) for i in np.unravel_index(h, grid.shape))
    X_WB = rot_z(grid.base_yaw[yaw]), np.array([grid.base_x[x], grid.base_y[y], 0.0])
    X_BA = scene.arm_base_R[torso], scene.arm_base_p[torso]
    X_AW = inverse(compose(X_WB, X_BA))
    X_AB = inverse(X_BA)
    placed = PlacedScene(
        scene=scene,
        environment=[s.moved(X_AW) for s in shapes_of(scene.environment, state)],
        body=[s.moved(X_AB) for s in shapes_of(scene.body, torso)],
        X_AG=compose(X_AW, (scene.goal_R[state, goal], scene.goal_p[state, goal])),
    )
    blocked = placed.any_touch(
        placed.body, placed.environment, scene.body_vs_environment, scene.margin
    )
    return placed, blocked or placed.touches_at_rest()


def score(
    scene: SceneArrays, grid: GridArrays, h: int, goal: int, measure: str = DEFAULT_MEASURE
) -> Verdict:
    """Return the result that the kernel should give for configuration h and one goal."""
    placed, blocked = placed_scene(scene, grid, h, goal)

    def verdict(reason: int, value: float = 0.0, q: FloatArray | None = None) -> Verdict:
        return Verdict(reason, value, q, placed.clearance)

    if blocked:
        return verdict(BODY_BLOCKED)
    chain = scene.chain
    if chain.joints == 5:
        return _five_joint_score(placed, goal, measure)
    if placed.gripper_touches(with_body=False):
        return verdict(GRIPPER_BLOCKED_BY_ENVIRONMENT)
    if chain.joints == 6:
        return _six_joint_score(placed, measure)
    arcs, possible = elbow_arcs(chain, placed.X_AG)
    if not possible:
        return verdict(TOO_FAR)
    if placed.gripper_touches(with_body=True):
        return verdict(GRIPPER_BLOCKED_BY_ROBOT)
    if not arcs:
        return verdict(JOINT_LIMITS)
    candidates = find_candidates(chain, placed.X_AG, arcs)

    def value(candidate: Candidate) -> float:
        q = candidate.q
        return measured(jacobian(chain, q), q, chain.lower, chain.upper, measure)

    def free(tried: list[Candidate]) -> Verdict | None:
        for candidate in sorted(tried, key=value, reverse=True):
            if not placed.arm_touches(candidate.q):
                best = climb(placed, candidate, value)
                return verdict(REACHED, value(best), best.q)
        return None

    if reached := free(candidates):
        return reached
    fast = fast_candidates(chain, placed.X_AG, arcs)
    return free(fast) or verdict(ARM_BLOCKED if candidates or fast else JOINT_LIMITS)


def _six_joint_score(placed: PlacedScene, measure: str) -> Verdict:
    """Return the result at one goal for an arm of six joints, from Newton's method."""
    chain = placed.scene.chain
    solutions = newton_solutions(chain, *placed.X_AG)
    if not len(solutions):
        return Verdict(TOO_FAR, clearance=placed.clearance)
    if placed.gripper_touches(with_body=True):
        return Verdict(GRIPPER_BLOCKED_BY_ROBOT, clearance=placed.clearance)
    postures = within(chain, solutions)
    if not len(postures):
        return Verdict(JOINT_LIMITS, clearance=placed.clearance)

    def value(q: FloatArray) -> float:
        return measured(jacobian(chain, q), q, chain.lower, chain.upper, measure)

    best = sorted(postures, key=value, reverse=True)
    contact_free = next((q for q in best if not placed.arm_touches(q)), None)
    if contact_free is None:
        return Verdict(ARM_BLOCKED, clearance=placed.clearance)
    return Verdict(REACHED, value(contact_free), contact_free, placed.clearance)


def _five_joint_score(placed: PlacedScene, goal: int, measure: str) -> Verdict:
    """Return the result at a goal that is free about an axis, for an arm of five joints.

    Newton's method solves the arm with that rotation as its sixth joint.
    """
    chain, axis = placed.scene.chain, placed.scene.freedom[goal, AXIS : AXIS + 3]
    turned = turned_chain(chain, axis)
    solutions = newton_solutions(turned, *placed.X_AG)
    if not len(solutions):
        return Verdict(TOO_FAR, clearance=placed.clearance)
    found = within(turned, solutions)
    if not len(found):
        return Verdict(JOINT_LIMITS, clearance=placed.clearance)
    postures = np.concatenate([np.zeros((len(found), 2)), found[:, 1:6]], axis=1)

    def value(q: FloatArray) -> float:
        J = prescribed(jacobian(chain, q), link_poses(chain, q)[-1][0] @ axis)
        return measured(J, q, chain.lower, chain.upper, measure)

    reasons = []
    for q in sorted(postures, key=value, reverse=True):
        placed.X_AG = link_poses(chain, q)[-1]
        if placed.gripper_touches(with_body=False):
            reasons.append(GRIPPER_BLOCKED_BY_ENVIRONMENT)
        elif placed.gripper_touches(with_body=True):
            reasons.append(GRIPPER_BLOCKED_BY_ROBOT)
        elif placed.arm_touches(q):
            reasons.append(ARM_BLOCKED)
        else:
            return Verdict(REACHED, value(q), q, placed.clearance)
    return Verdict(reasons[0], clearance=placed.clearance)


def confirms(scene: SceneArrays, grid: GridArrays, h: int, goal: int, q: FloatArray) -> bool:
    """Return whether the arm at joint angles q reaches the goal from h and touches nothing."""
    placed, blocked = placed_scene(scene, grid, h, goal)
    R, p = link_poses(scene.chain, q)[-1]
    # Joint angles are float32: seven rounding errors of 1.2e-7 rad, up to 1 m from the tool.
    at_goal = np.allclose(R, placed.X_AG[0], atol=2e-6) and np.allclose(
        p, placed.X_AG[1], atol=2e-6
    )
    within = bool(np.all((q >= scene.chain.lower) & (q <= scene.chain.upper)))
    gripper = placed.gripper_touches(with_body=False) or placed.gripper_touches(with_body=True)
    return at_goal and within and not (blocked or gripper or placed.arm_touches(q))


def climb(placed: PlacedScene, best: Candidate, value: Callable[[Candidate], float]) -> Candidate:
    """Return the best solution near a collision-free one, refined as in the kernel.

    Args:
        placed: The scene.
        best: Solution to start from.
        value: Function that returns the measure of a solution.
    """
    chain, step = placed.scene.chain, best.step
    for _ in range(REFINEMENTS):
        fine = 2 * step / (REFINE_SAMPLES - 1)
        near, angle = [], best.q[free_joint(chain)]
        for i in range(REFINE_SAMPLES):
            solution = solutions(chain, placed.X_AG, angle - step + i * fine)[best.branch]
            if solution.slack >= 0:
                near.append(Candidate(solution.q, best.branch, fine))
        better = [c for c in sorted(near, key=value, reverse=True) if value(c) > value(best)]
        best = next((c for c in better if not placed.arm_touches(c.q)), best)
        step = fine
    return best


def bounds_at(distances: BodyDistances, q: FloatArray) -> dict[frozenset[int], float]:
    """Return lower bounds of the distance of bodies of the robot at joint angles q [m].

    Args:
        distances: The tables.
        q: Joint angles [rad], shape (7,).

    Returns:
        By pair of indices of bodies, for the pairs that have a table; -1 where nothing is known.
    """
    found: dict[frozenset[int], float] = {}
    begin = 0
    for pair, joints, counts, reach in zip(
        distances.body, distances.joint, distances.size, distances.reach, strict=True
    ):
        rows, columns = (int(count) for count in counts)
        corners = distances.corners[begin : begin + rows * columns].reshape(rows, columns)
        begin += rows * columns
        cell, way, lost = [0, 0], [0.0, 0.0], 0.0
        for m, (joint, count, per_radian) in enumerate(
            zip(joints, (rows, columns), reach, strict=True)
        ):
            width = 2.0 * math.pi / count
            angle = float(q[joint])
            angle -= 2.0 * math.pi * math.floor(angle / (2.0 * math.pi))
            cell[m] = min(math.floor(angle / width), count - 1)
            before = angle - cell[m] * width
            after = width - before
            # Half the greatest curvature of a squared distance times the way to either end.
            lost += float(per_radian) * (float(per_radian) + MOST) * before * after
            way[m] = before / width
        total = 0.0
        for i in range(2):
            for j in range(2):
                corner = corners[(cell[0] + i) % rows, (cell[1] + j) % columns]
                share = (way[0] if i else 1.0 - way[0]) * (way[1] if j else 1.0 - way[1])
                total += share * (int(corner) * STEP) ** 2
        bound = math.sqrt(total - lost) if total > lost else -1.0
        found[frozenset(int(body) for body in pair)] = bound
    return found


def offset(form: FloatArray, u: FloatArray) -> Pose:
    """Return X_GT of the parameters u of a freedom."""
    tilt = u[1] * form[9:12] + u[2] * form[12:15]
    about = u[0] * form[AXIS : AXIS + 3]
    R = Rotation.from_rotvec(tilt) * Rotation.from_rotvec(about)
    return R.as_matrix(), np.array(u[3:6])


def free_score(
    scene: SceneArrays,
    grid: GridArrays,
    h: int,
    goal: int,
    free: FreeGoals,
    measure: str = DEFAULT_MEASURE,
) -> Verdict:
    """Return the best verdict over the samples of the poses of a goal, without refinement.

    If no sample reaches the goal, the verdict is that of the last sample.
    """
    best = None
    posed = []
    for pose in scene.poses_of(goal):
        tools = [(np.eye(3), np.zeros(3))]
        if free.first.size:
            tools = [offset(free.form[pose], u) for u in free.samples(pose)]
        posed += [(at_offset(scene, pose, tool), pose) for tool in tools]
    for single, pose in posed:
        verdict = score(single, grid, h, pose, measure)
        is_better = verdict.reason == REACHED and (
            best is None or best.reason != REACHED or verdict.dexterity > best.dexterity
        )
        if best is None or is_better:
            best = verdict
    assert best is not None
    return best


def at_offset(scene: SceneArrays, goal: int, X_GT: Pose) -> SceneArrays:
    """Return the scene whose goals are all poses, one of them moved by X_GT, and nothing free.

    An arm of five joints keeps the freedom, of which it needs the rotation.
    """
    R, p = scene.goal_R.copy(), scene.goal_p.copy()
    for state in range(len(R)):
        R[state, goal], p[state, goal] = compose((R[state, goal], p[state, goal]), X_GT)
    freedom = scene.freedom if scene.chain.joints == 5 else scene.freedom[:0]
    return scene._replace(goal_R=R, goal_p=p, freedom=freedom, first_pose=scene.first_pose[:0])


def is_served(scene: SceneArrays, grid: GridArrays, h: int, goal: int, q: FloatArray) -> bool:
    """Return whether the tool at joint angles q is at a pose that serves a goal, touching nothing.

    Joint angles are float32: the tolerances are those of `reference_pairs.confirms`.
    """
    return any(_is_served_at(scene, grid, h, pose, q) for pose in scene.poses_of(goal))


def _is_served_at(scene: SceneArrays, grid: GridArrays, h: int, goal: int, q: FloatArray) -> bool:
    """Return what `is_served` does, for one pose."""
    placed, blocked = placed_scene(scene, grid, h, goal)
    X_AT = link_poses(scene.chain, q)[-1]
    R, p = compose(inverse(placed.X_AG), X_AT)
    form = scene.freedom[goal].copy() if len(scene.freedom) else np.zeros(COLUMNS)
    if not np.any(form[AXIS : AXIS + 3]):
        # Nothing is free, about any axis.
        form[AXIS] = 1.0
    at_goal = bool(np.all(np.abs(p) <= form[HALF : HALF + 3] + 2e-6))
    if form[TILT] < math.pi or not form[ROTATES]:
        axis = form[AXIS : AXIS + 3]
        tilted = R @ axis
        angle = math.acos(min(max(float(axis @ tilted), -1.0), 1.0))
        # The cosine of a small angle loses half of the digits.
        at_goal = at_goal and angle <= form[TILT] + 5e-4
        if not form[ROTATES]:
            # R with its tilt taken back is a rotation about the axis by one of the angles.
            normal = np.cross(axis, tilted)
            length = float(np.linalg.norm(normal))
            back = Rotation.from_rotvec(-angle * normal / length if length > 0 else np.zeros(3))
            left = (back * Rotation.from_matrix(R)).as_rotvec()
            turn = 2.0 * math.pi / max(float(form[FOLD]), 1.0)
            at_goal = at_goal and abs(math.remainder(float(left @ axis), turn)) <= 1e-5
    placed.X_AG = X_AT
    limits = bool(np.all((q >= scene.chain.lower) & (q <= scene.chain.upper)))
    gripper = placed.gripper_touches(with_body=False) or placed.gripper_touches(with_body=True)
    return at_goal and limits and not (blocked or gripper or placed.arm_touches(q))


def arm_in_base(scene: SceneArrays, torso: int, q: FloatArray) -> list[PlacedShape]:
    """Return the shapes of an arm in the base frame B, at joint angles q [rad]."""
    X_BA = scene.arm_base_R[torso], scene.arm_base_p[torso]
    poses = link_poses(scene.chain, q)
    return [
        shape.moved(compose(X_BA, coupled_pose(scene.chain, q, poses, int(frame))))
        for shape, frame in zip(shapes_of(scene.arm, 0), scene.arm.frame, strict=True)
    ]


def arms_touch(
    scenes: tuple[SceneArrays, SceneArrays], torso: int, q: FloatArray, q_other: FloatArray
) -> tuple[bool, float]:
    """Return whether two arms touch, and by how much none of the compared shapes is a tie [m].

    Args:
        scenes: The scene of each arm.
        torso: The torso level.
        q: Joints of the first [rad], shape (7,).
        q_other: Joints of the second [rad], shape (7,).
    """
    first, second = scenes
    shapes, others = arm_in_base(first, torso, q), arm_in_base(second, torso, q_other)
    placed = PlacedScene(first, [], [], (np.eye(3), np.zeros(3)))
    every = np.ones((len(shapes), len(others)), np.bool_)
    margin = max(first.self_margin, second.self_margin)
    return placed.any_touch(shapes, others, every, margin), placed.clearance


def free_postures(
    scene: SceneArrays, grid: GridArrays, h: int, goal: int, angles: FloatArray
) -> list[FloatArray]:
    """Return the solutions of an arm by itself that touch nothing.

    Args:
        scene: The scene, without the other arm.
        grid: The configurations.
        h: Number of the configuration.
        goal: Number of the goal.
        angles: Angles of the free joint to try [rad].
    """
    placed, blocked = placed_scene(scene, grid, h, goal)
    if blocked or placed.gripper_touches(with_body=False) or placed.gripper_touches(with_body=True):
        return []
    found = []
    for angle in angles.tolist():
        for solution in solutions(scene.chain, placed.X_AG, angle).values():
            if solution.slack >= -AT_LIMIT and not placed.arm_touches(solution.q):
                found.append(solution.q)
    return found


def reached_together(
    scenes: tuple[SceneArrays, SceneArrays],
    grid: GridArrays,
    h: int,
    goals: tuple[int, int],
    samples: int,
) -> bool:
    """Return whether both arms reach their goals in postures in which they do not touch.

    Args:
        scenes: The scene of each arm, without the other.
        grid: The configurations.
        h: Number of the configuration.
        goals: Number of the goal of each arm.
        samples: Number of angles of each free joint that are tried.
    """
    torso = h % grid.torso_levels
    postures = []
    for scene, goal in zip(scenes, goals, strict=True):
        joint = free_joint(scene.chain)
        low, high = scene.chain.lower[joint], scene.chain.upper[joint]
        limited = bool(np.isfinite(low))
        first, last = (low, high) if limited else (-math.pi, math.pi)
        angles = np.linspace(first, last, samples, endpoint=limited)
        postures.append(free_postures(scene, grid, h, goal, angles))
    return any(
        not arms_touch(scenes, torso, q, other)[0] for q in postures[0] for other in postures[1]
    )

"""Reference implementation of the score of one configuration at one goal, built on `reference`.

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

from tcs.kernel.analytic.pairs import REFINE_SAMPLES, REFINEMENTS
from tcs.kernel.arrays import BoolArray, FloatArray, GridArrays, SceneArrays
from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.kernel.five_joints.turned import turned_chain
from tcs.kernel.freedom.forms import AXIS
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
from tcs.kernel.verification.reference import (
    PlacedShape,
    Pose,
    compose,
    coupled_pose,
    distance,
    free_joint,
    inverse,
    jacobian,
    link_poses,
    measured,
    prescribed,
    rot_z,
    separation,
    shapes_of,
    solutions,
)
from tcs.kernel.verification.reference_candidates import (
    Candidate,
    elbow_arcs,
    fast_candidates,
    find_candidates,
)
from tcs.kernel.verification.reference_distances import bounds_at


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

"""Reference implementation of the score of one configuration at one goal, built on `reference`.

It samples the same angles of the free joint as the kernel, so that results can be compared one by
one; `dense` measures whether these samples suffice. It does not bisect: where every sample is in
contact, the kernel (`pairs.bisect_contacts`) may find a collision-free angle between two samples
while the reference returns ARM_BLOCKED. `confirms` then checks the kernel's solution.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tcs.kernel.analytic.arcs import INSET, PEAK_SLOPE
from tcs.kernel.analytic.pairs import REFINE_SAMPLES, REFINEMENTS
from tcs.kernel.analytic.search import (
    FINE_SAMPLES,
    FINE_STEP,
    FIRST_SAMPLES,
    MIN_SAMPLES,
    PEAK_REFINEMENTS,
    STRAIGHT,
    STRAIGHT_REFINEMENTS,
)
from tcs.kernel.arrays import Chain, FloatArray, GridArrays, SceneArrays
from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.kernel.scores import (
    ARM_BLOCKED,
    BODY_BLOCKED,
    GRIPPER_BLOCKED_BY_ENVIRONMENT,
    GRIPPER_BLOCKED_BY_ROBOT,
    JOINT_LIMITS,
    REACHED,
    TOO_FAR,
)
from tcs.kernel.verification.reference import (
    Placed,
    Pose,
    compose,
    distance,
    elbow,
    free_joint,
    has_spherical_shoulder,
    inverse,
    jacobian,
    link_poses,
    measured,
    rot_z,
    shapes_of,
    solutions,
)

Branch = tuple[int, int, int]


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


@dataclass
class PlacedScene:
    """A scene with the robot at one configuration; all poses are in the arm base A."""

    scene: SceneArrays
    environment: list[Placed]
    body: list[Placed]
    X_AG: Pose
    clearance: float = math.inf

    def touches(self, a: Placed, b: Placed) -> bool:
        """Return whether two shapes collide, and update `clearance`."""
        required = max(self.scene.margin, a.pad + b.pad)
        # Bounding spheres well apart make the exact distance unnecessary.
        if float(np.linalg.norm(a.p - b.p)) - a.sphere - b.sphere > required + 0.01:
            return False
        excess = distance(a, b) - required
        self.clearance = min(self.clearance, abs(excess))
        return excess < 0.0

    def arm_at(self, q: FloatArray) -> list[Placed]:
        """Return the arm's shapes in A at joint angles q [rad]."""
        poses = link_poses(self.scene.chain, q)
        shapes = shapes_of(self.scene.arm, 0)
        return [s.moved(poses[f - 1]) for s, f in zip(shapes, self.scene.arm.frame, strict=True)]

    def gripper_touches(self, with_body: bool) -> bool:
        """Return whether the gripper at the goal touches the robot's body, or the environment."""
        X_A7 = compose(self.X_AG, inverse((self.scene.chain.R[7], self.scene.chain.p[7])))
        others = self.body if with_body else self.environment
        checked = self.scene.arm_vs_body if with_body else self.scene.arm_vs_environment
        shapes = shapes_of(self.scene.arm, 0)
        return any(
            self.touches(shapes[i].moved(X_A7), others[j])
            for i in range(len(shapes))
            if self.scene.arm.frame[i] == 7
            for j in range(len(others))
            if checked[i, j]
        )

    def arm_touches(self, q: FloatArray) -> bool:
        """Return whether the arm at joint angles q touches the environment, the body or itself.

        Contacts of the gripper with environment and body are left to `gripper_touches`.
        """
        arm, frame, scene = self.arm_at(q), self.scene.arm.frame, self.scene
        pairs = [
            (arm[i], other)
            for i in range(len(arm))
            if frame[i] < 7
            for others, checked in (
                (self.environment, scene.arm_vs_environment),
                (self.body, scene.arm_vs_body),
            )
            for j, other in enumerate(others)
            if checked[i, j]
        ]
        pairs += [
            (arm[i], arm[j])
            for i in range(len(arm))
            for j in range(i)
            if scene.arm_vs_arm[i, j] and min(frame[i], frame[j]) < 7
        ]
        return any(self.touches(a, b) for a, b in pairs)


def placed_scene(
    scene: SceneArrays, grid: GridArrays, h: int, goal: int
) -> tuple[PlacedScene, bool]:
    """Return the scene with the robot at configuration h, and whether its body is in contact."""
    shape = (
        grid.environment_states,
        len(grid.base_x),
        len(grid.base_y),
        len(grid.base_yaw),
        grid.torso_levels,
    )
    state, x, y, yaw, torso = (int(i) for i in np.unravel_index(h, shape))
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
    blocked = any(
        placed.touches(placed.body[i], placed.environment[j])
        for i in range(len(placed.body))
        for j in range(len(placed.environment))
        if scene.body_vs_environment[i, j]
    )
    return placed, blocked


def score(
    scene: SceneArrays, grid: GridArrays, h: int, goal: int, measure: str = DEFAULT_MEASURE
) -> Verdict:
    """Return the result that the kernel should give for configuration h and one goal."""
    placed, blocked = placed_scene(scene, grid, h, goal)

    def verdict(reason: int, value: float = 0.0, q: FloatArray | None = None) -> Verdict:
        return Verdict(reason, value, q, placed.clearance)

    if blocked:
        return verdict(BODY_BLOCKED)
    if placed.gripper_touches(with_body=False):
        return verdict(GRIPPER_BLOCKED_BY_ENVIRONMENT)
    chain = scene.chain
    arcs, possible = elbow_arcs(chain, placed.X_AG)
    if not arcs:
        return verdict(JOINT_LIMITS if possible else TOO_FAR)
    if placed.gripper_touches(with_body=True):
        return verdict(GRIPPER_BLOCKED_BY_ROBOT)
    candidates = find_candidates(chain, placed.X_AG, arcs)
    if not candidates:
        return verdict(JOINT_LIMITS)

    def value(candidate: Candidate) -> float:
        q = candidate.q
        return measured(jacobian(chain, q), q, chain.lower, chain.upper, measure)

    for candidate in sorted(candidates, key=value, reverse=True):
        if not placed.arm_touches(candidate.q):
            best = climb(placed, candidate, value)
            return verdict(REACHED, value(best), best.q)
    return verdict(ARM_BLOCKED)


@dataclass(frozen=True)
class Candidate:
    """A solution within the joint limits."""

    q: FloatArray
    """Joint angles [rad], shape (7,)."""
    branch: Branch
    """Signs of elbow, aim and wrist."""
    step: float
    """Spacing of the samples among which it was found [rad]."""


def elbow_arcs(chain: Chain, X_AG: Pose) -> tuple[list[tuple[float, float]], bool]:
    """Return the arcs of the free joint at which the elbow can span the distance |SW|.

    Returns:
        Arcs (first, last) within the limits of the free joint [rad], and whether any angle, limits
        of the free joint left aside, would do.
    """
    near, far = elbow_spans(chain)
    X_A7 = compose(X_AG, inverse((chain.R[7], chain.p[7])))
    if has_spherical_shoulder(chain):
        # In L7 the shoulder is fixed, and joint 7 rotates the wrist in the negative sense.
        w = inverse((chain.R[6], chain.p[6]))[1]
        s = inverse(X_A7)[0] @ (chain.p[0] - X_A7[1])
    else:
        # In the frame about whose z axis joint 1 rotates, the wrist is fixed; the shoulder rotates.
        w, s = compose(inverse((chain.R[0], chain.p[0])), X_A7)[1], chain.p[1]
    steady = float(w @ w + s @ s - 2 * w[2] * s[2])
    swing = 2 * math.hypot(w[0], w[1]) * math.hypot(s[0], s[1])
    if steady - swing > far or steady + swing < near:
        return [], False
    centre = math.atan2(w[1], w[0]) - math.atan2(s[1], s[0])
    inner = math.acos(min((steady - near) / swing, 1.0)) if steady - swing < near else 0.0
    outer = math.acos(max((steady - far) / swing, -1.0)) if steady + swing > far else math.pi
    free = free_joint(chain)
    lower, upper = chain.lower[free], chain.upper[free]
    inner, outer = inner + INSET * (inner > 0), outer - INSET * (outer < math.pi)
    if inner > outer:
        return [], False
    arcs: list[tuple[float, float]] = []
    for middle in (centre + 2 * math.pi * k for k in range(-2, 3)):
        for first, last in ((middle - outer, middle - inner), (middle + inner, middle + outer)):
            first, last = max(first, lower + INSET), min(last, upper - INSET)
            if first <= last and arcs and arcs[-1][1] >= first - INSET:
                arcs[-1] = (arcs[-1][0], last)
            elif first <= last:
                arcs.append((first, last))
    return arcs, True


def elbow_spans(chain: Chain) -> tuple[float, float]:
    """Return the least and the greatest |SW|^2 within the limits of joint 4 [m^2]."""
    _, _, phase = elbow(chain, 0.0)
    turning = [phase + k * math.pi for k in range(-4, 5)]
    angles = [a for a in turning if chain.lower[3] <= a <= chain.upper[3]]
    angles += [a for a in (chain.lower[3], chain.upper[3]) if math.isfinite(a)]
    spans = [float(np.sum((chain.p[3] + chain.R[3] @ rot_z(a) @ chain.p[4]) ** 2)) for a in angles]
    return min(spans), max(spans)


def find_candidates(chain: Chain, X_AG: Pose, arcs: list[tuple[float, float]]) -> list[Candidate]:
    """Return the feasible samples of the kernel's two passes: over the arcs, inside the windows."""
    length = sum(last - first for first, last in arcs)
    found: list[Candidate] = []
    straight: list[tuple[Branch, float, float]] = []
    for first, last in arcs:
        share = FIRST_SAMPLES * (last - first) / length if length else 0
        count = max(MIN_SAMPLES, int(share + 0.5))
        angles = [first + i * (last - first) / (count - 1) for i in range(count)]
        looks = [solutions(chain, X_AG, angle) for angle in angles]
        for branch in looks[0]:
            slack = [look[branch].slack for look in looks]
            step = (last - first) / (count - 1)
            for i, j in windows_of(slack, step):
                found += refine_window(chain, X_AG, branch, angles[i], angles[j])
            sines = [math.inf, *(look[branch].sine_squared for look in looks), math.inf]
            for i in range(1, count + 1):
                if sines[i] < STRAIGHT and sines[i] <= sines[i - 1] and sines[i] < sines[i + 1]:
                    straight.append((branch, angles[i - 1], step))
    if not found:
        for branch, middle, step in straight:
            found += refine_straight(chain, X_AG, branch, middle, step)
    return found


def refine_straight(
    chain: Chain, X_AG: Pose, branch: Branch, middle: float, step: float
) -> list[Candidate]:
    """Return feasible samples near an angle at which the wrist is nearly straight."""
    for _ in range(STRAIGHT_REFINEMENTS):
        low, step = middle - step, 2 * step / (FINE_SAMPLES - 1)
        angles = [low + i * step for i in range(FINE_SAMPLES)]
        found = candidates_at(chain, X_AG, branch, angles, step)
        if found:
            return found
        middle = min(angles, key=lambda angle: solutions(chain, X_AG, angle)[branch].sine_squared)
    return []


def windows_of(slack: list[float], step: float) -> list[tuple[int, int]]:
    """Return the windows (first, last) of samples that contain, or may contain, feasible angles."""
    last = len(slack) - 1
    inside = [i for i, left in enumerate(slack) if left >= 0]
    windows = []
    for i in inside:
        if i - 1 not in inside:
            j = next(k for k in range(i, last + 1) if k == last or slack[k + 1] < 0)
            windows.append((max(i - 1, 0), min(j + 1, last)))
    windows += [(max(i - 1, 0), min(i + 1, last)) for i in peaks_of(slack, step)]
    return windows


def peaks_of(slack: list[float], step: float) -> list[int]:
    """Return the infeasible samples next to which a window narrower than the spacing may lie."""
    last = len(slack) - 1
    peaks = []
    for i, left in enumerate(slack):
        sides = [slack[k] for k in (i - 1, i + 1) if 0 <= k <= last]
        if -PEAK_SLOPE * step < left < 0 and all(s <= left for s in sides):
            peaks.append(i)
    return peaks


def refine_window(
    chain: Chain, X_AG: Pose, branch: Branch, first: float, last: float
) -> list[Candidate]:
    """Return the feasible samples of one window on one branch."""
    count = max(MIN_SAMPLES, int((last - first) / FINE_STEP) + 1)
    step = (last - first) / (count - 1)
    angles = [first + i * step for i in range(count)]
    slack = [solutions(chain, X_AG, angle)[branch].slack for angle in angles]
    inside = [left >= 0 for left in slack]
    found = candidates_at(chain, X_AG, branch, angles, step)
    for i in range(1, count):
        if inside[i] != inside[i - 1]:
            outer, inner = (i - 1, i) if inside[i] else (i, i - 1)
            found += refine_end(chain, X_AG, branch, angles[outer], angles[inner])
    for i in peaks_of(slack, step):
        found += refine_peak(chain, X_AG, branch, angles[i], step, (first, last))
    return found


def refine_peak(
    chain: Chain, X_AG: Pose, branch: Branch, middle: float, step: float, ends: tuple[float, float]
) -> list[Candidate]:
    """Return feasible samples near an infeasible peak, found by refining the samples about it."""
    for _ in range(PEAK_REFINEMENTS):
        low, high = max(middle - step, ends[0]), min(middle + step, ends[1])
        step = (high - low) / (FINE_SAMPLES - 1)
        angles = [low + i * step for i in range(FINE_SAMPLES)]
        found = candidates_at(chain, X_AG, branch, angles, step)
        slack = [solutions(chain, X_AG, angle)[branch].slack for angle in angles]
        if found or max(slack) < -PEAK_SLOPE * step:
            return found
        middle = angles[slack.index(max(slack))]
    return []


def refine_end(
    chain: Chain, X_AG: Pose, branch: Branch, outer: float, inner: float
) -> list[Candidate]:
    """Return feasible samples strictly between two neighbouring samples."""
    fine = (inner - outer) / (FINE_SAMPLES - 1)
    near = [outer + k * fine for k in range(1, FINE_SAMPLES - 1)]
    return candidates_at(chain, X_AG, branch, near, abs(fine))


def candidates_at(
    chain: Chain, X_AG: Pose, branch: Branch, angles: list[float], step: float
) -> list[Candidate]:
    """Return the candidates among angles of the free joint [rad] on one branch."""
    found = []
    for angle in angles:
        solution = solutions(chain, X_AG, angle)[branch]
        if solution.slack >= 0:
            found.append(Candidate(solution.q, branch, step))
    return found


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

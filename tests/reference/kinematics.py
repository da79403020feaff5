"""Reference implementation of the kernel in plain Python, written for clarity.

Tests compare the compiled kernel with it, and it with Drake; benchmarks measure speed-ups over it.
Dexterity is in `tcs.kernel.verification.plain_dexterity`, because `tcs verify` uses it too. The
reference shares no code with the kernel, so that mistakes cannot cancel. Where the kernel takes a
shortcut (packed rows, samples, a determinant by minors, contacts in the order of likelihood), it
applies the definition.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, Chain, FloatArray, Shapes

LEAST_ELBOW = 1e-6
"""Least angle of the elbow from stretched and from folded [rad]."""
STRETCH_ROUNDING = 1e-11
"""What rounding may take from the squared sine of the elbow."""
MEETING_TOLERANCE = 1e-9
"""Link origins closer than this [m] coincide, up to rounding."""
Pose = tuple[FloatArray, FloatArray]
"""Rotation matrix, shape (3, 3), and position [m], shape (3,)."""


ORIGIN = np.zeros(3)


def compose(X_AB: Pose, X_BC: Pose) -> Pose:
    """Return X_AC."""
    return X_AB[0] @ X_BC[0], X_AB[1] + X_AB[0] @ X_BC[1]


def inverse(X_AB: Pose) -> Pose:
    """Return X_BA."""
    return X_AB[0].T, -X_AB[0].T @ X_AB[1]


def rot_z(angle: float) -> FloatArray:
    """Return the rotation by `angle` [rad] about z, shape (3, 3)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def link_poses(chain: Chain, q: FloatArray) -> list[Pose]:
    """Return X_AL1 .. X_AL7 and X_AT."""
    X: Pose = (np.eye(3), np.zeros(3))
    poses = []
    for i in range(7):
        slide = chain.slides[i]
        moved = (np.eye(3), np.array([0.0, 0.0, slide * q[i]])) if slide else (rot_z(q[i]), ORIGIN)
        X = compose(compose(X, (chain.R[i], chain.p[i])), moved)
        poses.append(X)
    poses.append(compose(X, (chain.R[7], chain.p[7])))
    return poses


def coupled_pose(chain: Chain, q: FloatArray, poses: list[Pose], frame: int) -> Pose:
    """Return the pose in A of the link frame of that number, given `link_poses`."""
    if frame <= 7:
        return poses[frame - 1]
    joint, fraction = int(chain.coupled[frame - 8, 0]), chain.coupled[frame - 8, 1]
    back = (fraction - 1.0) * chain.slides[joint] * q[joint]
    return compose(poses[joint], (np.eye(3), np.array([0.0, 0.0, back])))


def jacobian(chain: Chain, q: FloatArray) -> FloatArray:
    """Return the Jacobian of the tool in A, shape (6, joints), rows [angular; linear]."""
    *links, tool = link_poses(chain, q)
    columns = [
        np.concatenate([np.zeros(3), slide * R[:, 2]])
        if slide
        else np.concatenate([R[:, 2], np.cross(R[:, 2], tool[1] - p)])
        for (R, p), slide in zip(links, chain.slides, strict=True)
    ]
    return np.array(columns[7 - chain.joints :]).T


# --- inverse kinematics -----------------------------------------------------------------------


def angles_to_height(
    R: FloatArray, v: FloatArray, height: float
) -> tuple[float, list[float], float]:
    """Return the angles t about z for which R Rz(t) v has the z component `height`.

    Returns:
        Feasibility margin (1 at the middle height, negative if no angle exists); the two angles
        [rad], first that of sign +1, then that of sign -1; and how far the height is out of reach.
    """
    P = R[2, 0] * v[0] + R[2, 1] * v[1]
    Q = R[2, 1] * v[0] - R[2, 0] * v[1]
    m = height - R[2, 2] * v[2]
    left = P * P + Q * Q - m * m
    h = math.sqrt(max(left, 0.0))
    turns = [math.atan2(Q * m + P * g, P * m - Q * g) for g in (h, -h)]
    return left / (P * P + Q * Q), turns, abs(m) - math.hypot(P, Q)


@dataclass(frozen=True)
class Solution:
    """One branch of the closed form at one value of the free joint."""

    q: FloatArray
    """Joint angles [rad], shifted by full turns towards the middle of their limits, shape (7,)."""
    slack: float
    """>= 0 if the branch exists and every joint is within its limits."""
    excess: float
    """How far aim [m] or wrist are out of reach, whichever is farther; <= 0 if both exist."""


def has_spherical_shoulder(chain: Chain) -> bool:
    """Return whether axes 1, 2 and 3 meet, and 5 and 6, but not also 5, 6 and 7."""
    return bool(np.any(np.abs(chain.p[[2, 5, 6]]) > MEETING_TOLERANCE))


def free_joint(chain: Chain) -> int:
    """Return the index of the free joint: 0, or 6 for an arm of the spherical-shoulder class."""
    return 6 if has_spherical_shoulder(chain) else 0


def solutions(chain: Chain, X_AG: Pose, angle: float) -> dict[tuple[int, int, int], Solution]:
    """Return the solutions at an angle of the free joint by branch: signs of elbow, aim, wrist."""
    solve = (
        spherical_shoulder_solutions if has_spherical_shoulder(chain) else spherical_wrist_solutions
    )
    return solve(chain, X_AG, angle)


def spherical_wrist_solutions(
    chain: Chain, X_AG: Pose, q1: float
) -> dict[tuple[int, int, int], Solution]:
    """Return the solutions of an arm with a spherical wrist, from its base outward."""
    R_A7 = X_AG[0] @ chain.R[7].T
    wrist = X_AG[1] - R_A7 @ chain.p[7]
    X_AL1 = compose((chain.R[0], chain.p[0]), (rot_z(q1), np.zeros(3)))
    v = inverse(X_AL1)[0] @ (wrist - X_AL1[1]) - chain.p[1]
    elbow_left, cosine, phase = elbow(chain, float(v @ v))
    v = chain.R[1].T @ v
    found = {}
    for elbow_sign in (1, -1):
        q4 = phase + elbow_sign * elbow_angle(cosine)
        u = chain.p[3] + chain.R[3] @ rot_z(q4) @ chain.p[4]
        aim_left, aims, aim_excess = angles_to_height(chain.R[2], u, v[2])
        for aim_sign, q3 in zip((1, -1), aims, strict=True):
            k = chain.R[2] @ rot_z(q3) @ u
            q2 = math.atan2(v[1], v[0]) - math.atan2(k[1], k[0])
            R = X_AL1[0]
            for i, angle in ((1, q2), (2, q3), (3, q4)):
                R = R @ chain.R[i] @ rot_z(angle)
            M = (R @ chain.R[4]).T @ R_A7
            f = chain.R[6][:, 2]
            wrist_left, flexes, wrist_excess = angles_to_height(chain.R[5], f, M[2, 2])
            for wrist_sign, q6 in zip((1, -1), flexes, strict=True):
                e = chain.R[5] @ rot_z(q6) @ f
                q5 = math.atan2(M[1, 2], M[0, 2]) - math.atan2(e[1], e[0])
                N = (rot_z(q5) @ chain.R[5] @ rot_z(q6) @ chain.R[6]).T @ M
                q7 = math.atan2(N[1, 0], N[0, 0])
                left = min(elbow_left, aim_left, wrist_left)
                q = [q1, q2, q3, q4, q5, q6, q7]
                excess = max(aim_excess, wrist_excess)
                found[elbow_sign, aim_sign, wrist_sign] = limited(chain, q, left, excess)
    return found


def spherical_shoulder_solutions(
    chain: Chain, X_AG: Pose, q7: float
) -> dict[tuple[int, int, int], Solution]:
    """Return the solutions of an arm with a spherical shoulder, from its tool inward.

    Unlike in the kernel, the chain is not reversed: joint 7 determines the frame L6 and with it the
    wrist W, where axes 5 and 6 meet; the shoulder S, where axes 1, 2 and 3 meet, is fixed.
    """
    X_67 = compose((chain.R[6], chain.p[6]), (rot_z(q7), np.zeros(3)))
    X_A6 = compose(compose(X_AG, inverse((chain.R[7], chain.p[7]))), inverse(X_67))
    s = inverse(X_A6)[0] @ (chain.p[0] - X_A6[1])
    elbow_left, cosine, phase = elbow(chain, float(s @ s))
    found = {}
    for elbow_sign in (1, -1):
        q4 = phase + elbow_sign * elbow_angle(cosine)
        # From W to S, in the frame about whose z axis joint 5 rotates.
        X_34 = compose((chain.R[3], chain.p[3]), (rot_z(q4), np.zeros(3)))
        X_35 = compose(X_34, (chain.R[4], chain.p[4]))
        k = inverse(X_35)[1]
        aim_left, aims, aim_excess = angles_to_height(chain.R[5].T, k, s[2])
        for aim_sign, q5 in zip((1, -1), (-t for t in aims), strict=True):
            n = chain.R[5].T @ rot_z(-q5) @ k
            q6 = math.atan2(n[1], n[0]) - math.atan2(s[1], s[0])
            R_36 = X_35[0] @ rot_z(q5) @ chain.R[5] @ rot_z(q6)
            M = chain.R[0].T @ X_A6[0] @ R_36.T
            f = chain.R[2][:, 2]
            shoulder_left, shoulders, shoulder_excess = angles_to_height(chain.R[1], f, M[2, 2])
            for shoulder_sign, q2 in zip((1, -1), shoulders, strict=True):
                # In the kernel's order, which affects the slack of infeasible samples.
                R_13 = chain.R[1] @ rot_z(q2) @ chain.R[2]
                q3 = math.atan2(R_13[2, 1], R_13[2, 0]) - math.atan2(M[2, 1], M[2, 0])
                N = M @ (R_13 @ rot_z(q3)).T
                q1 = math.atan2(-N[0, 1], N[0, 0])
                left = min(elbow_left, aim_left, shoulder_left)
                q = [q1, q2, q3, q4, q5, q6, q7]
                excess = max(aim_excess, shoulder_excess)
                found[elbow_sign, aim_sign, shoulder_sign] = limited(chain, q, left, excess)
    return found


def limited(chain: Chain, angles: list[float], left: float, excess: float) -> Solution:
    """Return the solution with joints shifted into their limits; its slack is at most `left`."""
    q = np.array(angles)
    for i in range(7):
        q[i], kept = into_limits(q[i], chain.lower[i], chain.upper[i])
        left = min(left, kept)
    return Solution(q, left, excess)


def elbow(chain: Chain, square: float) -> tuple[float, float, float]:
    """Return, for |SW|^2 = square, 1 - cos(q4 - phase)^2, cos(q4 - phase), and the phase [rad]."""
    least, most = (
        [float(np.sum((chain.p[3] + chain.R[3] @ rot_z(a) @ chain.p[4]) ** 2)) for a in (0.0, t)]
        for t in (math.pi / 2, math.pi)
    )
    # |SW|^2 = c + a cos(q4) + b sin(q4): three values of q4 give c, a and b.
    c = (most[0] + most[1]) / 2
    a, b = most[0] - c, least[1] - c
    cosine = (square - c) / math.hypot(a, b)
    return 1.0 - cosine * cosine + STRETCH_ROUNDING, cosine, math.atan2(b, a)


def elbow_angle(cosine: float) -> float:
    """Return the angle from stretched [rad], LEAST_ELBOW from stretched and folded at least.

    A straight elbow would leave the joints before and after it undetermined; so little a bend moves
    the tool by its square.
    """
    return min(max(math.acos(min(max(cosine, -1.0), 1.0)), LEAST_ELBOW), math.pi - LEAST_ELBOW)


def into_limits(angle: float, lower: float, upper: float) -> tuple[float, float]:
    """Return the angle [rad] shifted by full turns towards the middle of its limits, and its slack.

    The slack is the cosine of its distance from the middle less the cosine of half the range.
    """
    if not math.isfinite(lower):
        return math.remainder(angle, 2 * math.pi), 1.0
    middle, half = (lower + upper) / 2, (upper - lower) / 2
    off = math.remainder(angle - middle, 2 * math.pi)
    if half >= math.pi:
        return middle + off, 1.0
    return middle + off, math.cos(off) - math.cos(half)


# --- distances --------------------------------------------------------------------------------


@dataclass(frozen=True)
class PlacedShape:
    """One shape at one pose."""

    type: int
    size: FloatArray
    R: FloatArray
    p: FloatArray
    pad: float
    body: int

    def moved(self, X: Pose) -> PlacedShape:
        """Return the shape at X times its pose."""
        R, p = compose(X, (self.R, self.p))
        return PlacedShape(self.type, self.size, R, p, self.pad, self.body)

    @property
    def radius(self) -> float:
        """Radius by which the core is grown [m]."""
        return 0.0 if self.type == BOX else float(self.size[0])

    @property
    def sphere(self) -> float:
        """Radius of the bounding sphere about the centre [m]."""
        return float(np.linalg.norm(self.half)) + self.radius

    @property
    def half(self) -> FloatArray:
        """Half sizes of the core along the shape's axes [m]: of a point, a segment or a box."""
        if self.type == BOX:
            return np.asarray(self.size)
        return np.array([0.0, 0.0, self.size[1] if self.type == CAPSULE else 0.0])


def shapes_of(shapes: Shapes, state: int) -> list[PlacedShape]:
    """Return the shapes in one state, one object each."""
    return [
        PlacedShape(
            int(shapes.type[i]),
            shapes.size[i],
            shapes.R[state, i],
            shapes.p[state, i],
            float(shapes.pad[i]),
            int(shapes.body[i]),
        )
        for i in range(len(shapes.type))
    ]


def distance(a: PlacedShape, b: PlacedShape) -> float:
    """Return the distance between the cores of two shapes, 0 if they overlap, less the radii [m].

    A core is a box, some of whose half sizes may be 0. Cores overlap if no separating axis exists;
    otherwise the least distance is attained on an edge of one of them.
    """
    if separation(a, b) <= 1e-15:
        return -(a.radius + b.radius)
    least = min(_edges_to_box(a, b), _edges_to_box(b, a))
    return least - a.radius - b.radius


def separation(a: PlacedShape, b: PlacedShape) -> float:
    """Return the widest gap that one of the 15 candidate axes shows between the cores [m].

    It is at most their distance, and not above 0 if they overlap.
    """
    axes = [a.R[:, i] for i in range(3)] + [b.R[:, i] for i in range(3)]
    axes += [np.cross(a.R[:, i], b.R[:, j]) for i in range(3) for j in range(3)]
    widest = -math.inf
    for axis in axes:
        length = float(np.linalg.norm(axis))
        if length < 1e-6:
            continue
        spread = np.abs(axis @ a.R) @ a.half + np.abs(axis @ b.R) @ b.half
        widest = max(widest, (abs(float(axis @ (b.p - a.p))) - float(spread)) / length)
    return widest


def _edges_to_box(a: PlacedShape, b: PlacedShape) -> float:
    """Return the least distance from the edges of core a to core b [m]."""
    starts, ways = [], []
    for along in range(3):
        for signs in product((-1.0, 1.0), repeat=2):
            corner = np.insert(np.array(signs), along, -1.0) * a.half
            starts.append(b.R.T @ (a.R @ corner + a.p - b.p))
            ways.append(b.R.T @ (a.R[:, along] * 2 * a.half[along]))
    return _segments_to_box(np.array(starts), np.array(ways), b.half)


def _segments_to_box(start: FloatArray, way: FloatArray, half: FloatArray) -> float:
    """Return the least distance from the segments start + t way, t in [0, 1], to the box [m].

    The distance of each is convex in t: its minimum is bracketed by bisection on the sign of the
    slope.

    Args:
        start: One end of each segment [m], shape (n, 3).
        way: From there to the other end [m], shape (n, 3).
        half: Half sizes of the box [m], shape (3,).
    """

    def beyond(t: FloatArray) -> FloatArray:
        point = start + t[:, None] * way
        return point - np.minimum(np.maximum(point, -half), half)

    low, high = np.zeros(len(start)), np.ones(len(start))
    for _ in range(60):
        t = (low + high) / 2
        nearing = np.sum(beyond(t) * way, axis=1) < 0
        low, high = np.where(nearing, t, low), np.where(nearing, high, t)
    tried = (np.zeros(len(start)), (low + high) / 2, np.ones(len(start)))
    return min(float(np.linalg.norm(beyond(t), axis=1).min()) for t in tried)

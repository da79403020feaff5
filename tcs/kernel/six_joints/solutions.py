"""All solutions of the inverse kinematics of an arm of six joints, joint limits left aside."""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.ik import sample_joints, wrist_goal
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, int_constant, jit
from tcs.kernel.kinematics import link_poses, place_tool
from tcs.kernel.six_joints.arm import SixJointArm
from tcs.kernel.six_joints.elimination import is_known, solve_general

MOST_SOLUTIONS = 16
"""Greatest number of solutions; with a closed form eight: two for each of three choices."""
TURN = 2.0 * np.pi
ON_GOAL = 1e-7
"""Greatest error of a solution, in entries of the rotation matrix and of the position [m]."""
ROUNDING = 1e-12
"""What rounding may add to a cosine."""
ALIGNED = 1e-18
"""Squared length of a vector [m^2 or 1] that has no direction."""
COPLANAR = 1e-9
"""Triple product of three directions below which they lie in a plane."""
FORTH, BACK = int_constant(1), int_constant(-1)
"""Directions of a rotation: by the matrix, or by its transpose."""


@jit
def solve_six_joints(
    arm: SixJointArm, R_AG: FloatArray, p_AG: FloatArray, solutions: FloatArray
) -> int:
    """Fill all solutions for a goal, each confirmed by forward kinematics.

    Args:
        arm: The arm.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        solutions: Filled with joint angles, each in any full turn [rad], shape (MOST_SOLUTIONS, 7).

    Returns:
        Number of solutions. Where a wrist is exactly straight, one stands for a continuum.
    """
    link_R, link_p = np.empty((8, 3, 3)), np.empty((8, 3))
    R_AT, p_AT = np.empty((3, 3)), np.empty(3)
    found = 0
    if len(arm.wrist.branches):
        goal = np.empty((4, 3))
        wrist_goal(arm.wrist, R_AG, p_AG, goal)
        for b in range(len(arm.wrist.branches)):
            sample_joints(arm.wrist, goal, arm.wrist.branches[b], 0.0, solutions[found])
            found += 1
    elif arm.general.direction != 0:
        found = solve_general(arm.general, arm.R, arm.p, R_AG, p_AG, solutions)
    elif arm.p.shape[1] > 3:
        found = _three_slides(arm, R_AG, p_AG, solutions)
    else:
        found = _parallel_axes(arm, R_AG, p_AG, solutions)
    kept = 0
    for n in range(found):
        link_poses(arm.R, arm.p, solutions[n], link_R, link_p)
        place_tool(arm.R, arm.p, link_R, link_p, R_AT, p_AT)
        worst = 0.0
        for r in range(3):
            worst = max(worst, abs(p_AT[r] - p_AG[r]))
            for c in range(3):
                worst = max(worst, abs(R_AT[r, c] - R_AG[r, c]))
        if worst < ON_GOAL and not is_known(solutions, kept, solutions[n]):
            for k in range(7):
                solutions[kept, k] = solutions[n, k]
            kept += 1
    return kept


@jit
def within_limits(arm: SixJointArm, solutions: FloatArray, count: int) -> int:
    """Shift solutions by full turns into the limits; move those within them to the front.

    Args:
        arm: The arm.
        solutions: Changed in place [rad], shape (count or more, 7).
        count: Number of solutions.

    Returns:
        Number of solutions within the limits.
    """
    kept = 0
    for n in range(count):
        inside = True
        for k in range(7):
            lower, upper, angle = arm.lower[k], arm.upper[k], solutions[n, k]
            middle = 0.5 * (lower + upper) if np.isfinite(lower) else 0.0
            if arm.p.shape[1] <= 3 or arm.p[k, 3] == 0.0:
                angle -= TURN * np.ceil((angle - middle - np.pi) / TURN)
            inside = inside and lower <= angle <= upper
            solutions[kept, k] = angle
        kept += 1 if inside else 0
    return kept


def six_joint_solutions(arm: SixJointArm, R_AG: FloatArray, p_AG: FloatArray) -> FloatArray:
    """Return all postures within the joint limits with the tool at a pose.

    Args:
        arm: The arm.
        R_AG: Goal orientation in the arm base A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).

    Returns:
        Joint angles [rad], shape (n, 7) with n up to MOST_SOLUTIONS, the first one 0.
    """
    R, p = np.array(R_AG, dtype=np.float64, order="C"), np.array(p_AG, dtype=np.float64)
    solutions = np.empty((MOST_SOLUTIONS, 7))
    count = solve_six_joints(arm, R, p, solutions)
    return solutions[: within_limits(arm, solutions, count)]


@inner
def _three_slides(
    arm: SixJointArm, R_AG: FloatArray, p_AG: FloatArray, solutions: FloatArray
) -> int:
    """Fill the solutions of an arm of three prismatic and three revolute joints, in any order.

    Prismatic joints leave the orientation alone, so it gives the three angles. Each prismatic joint
    then has a known direction, and the position is linear in the three.
    """
    # Rotations before, between and after the revolute joints.
    between = np.empty((4, 3, 3))
    turning, sliding = np.empty(3, np.int64), np.empty(3, np.int64)
    turns = slides = 0
    total = _product(arm.R[0], arm.R[1], FORTH)
    for i in range(1, 7):
        if arm.p[i, 3] > 0.0:
            sliding[slides] = i
            slides += 1
        else:
            between[turns] = total
            turning[turns] = i
            turns += 1
            total = np.eye(3)
        total = _product(total, arm.R[i + 1], FORTH)
    between[3] = total
    M = _product(_product(_transposed(between[0]), R_AG, FORTH), between[3], BACK)
    row, f = between[1][2], between[2][:, 2]
    middles = np.empty(2)
    link_R, link_p = np.empty((8, 3, 3)), np.empty((8, 3))
    R_AT, p_AT = np.empty((3, 3)), np.empty(3)
    cosine, sine = row[0] * f[0] + row[1] * f[1], row[1] * f[0] - row[0] * f[1]
    found = 0
    for j in range(_angles(cosine, sine, M[2, 2] - row[2] * f[2], middles)):
        inner = _product(_rotated(between[1], middles[j]), between[2], FORTH)
        first = _azimuth(M[0, 2], M[1, 2]) - _azimuth(inner[0, 2], inner[1, 2])
        N = _product(_transposed(_product(_rotated(np.eye(3), first), inner, FORTH)), M, FORTH)
        q = solutions[found]
        for k in range(7):
            q[k] = 0.0
        q[turning[0]], q[turning[1]] = first, middles[j]
        q[turning[2]] = np.arctan2(N[1, 0], N[0, 0])
        link_poses(arm.R, arm.p, q, link_R, link_p)
        place_tool(arm.R, arm.p, link_R, link_p, R_AT, p_AT)
        a, b, c = (
            link_R[sliding[0] + 1][:, 2],
            link_R[sliding[1] + 1][:, 2],
            link_R[sliding[2] + 1][:, 2],
        )
        v = p_AG - p_AT
        volume = _triple(a, b, c)
        if abs(volume) < COPLANAR:
            continue
        q[sliding[0]] = _triple(v, b, c) / (volume * arm.p[sliding[0], 3])
        q[sliding[1]] = _triple(a, v, c) / (volume * arm.p[sliding[1], 3])
        q[sliding[2]] = _triple(a, b, v) / (volume * arm.p[sliding[2], 3])
        found += 1
    return found


@inner
def _triple(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Return the triple product a . (b x c)."""
    return (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )


@inner
def _parallel_axes(
    arm: SixJointArm, R_AG: FloatArray, p_AG: FloatArray, solutions: FloatArray
) -> int:
    """Fill the solutions of an arm whose axes 2, 3 and 4 are parallel, and 5 and 6 meet.

    W is the point where axes 5 and 6 meet. Its distance along the parallel axes depends on joint 1
    alone, and the tilt of axis 6 towards them on joints 1 and 5. Joint 6 follows from the azimuth,
    and joints 2, 3 and 4 are a planar arm.
    """
    R, p = arm.R, arm.p
    # Orientation of L7 and position of W in A.
    R_A7 = _product(R_AG, R[7], BACK)
    W = p_AG - _turned(R_A7, p[7], FORTH)
    base = _product(R[0], R[1], FORTH)
    origin = p[0] + _turned(R[0], p[1], FORTH)
    v = _turned(base, W - origin, BACK)
    # Signs of the directions of the fourth and the fifth axis of the chain along the third.
    s4 = 1.0 if R[3, 2, 2] > 0.0 else -1.0
    s5 = s4 if R[4, 2, 2] > 0.0 else -s4
    along = p[3, 2] + s4 * p[4, 2] + s5 * p[5, 2]
    hx, hy, hz = R[2, 0, 2], R[2, 1, 2], R[2, 2, 2]
    height = along + hx * p[2, 0] + hy * p[2, 1] + hz * p[2, 2] - hz * v[2]
    rx, ry, rz, fx, fy, fz = R[5, 2, 0], R[5, 2, 1], R[5, 2, 2], R[6, 0, 2], R[6, 1, 2], R[6, 2, 2]
    firsts, fifths, thirds = np.empty(2), np.empty(2), np.empty(2)
    found = 0
    for i in range(_angles(hx * v[0] + hy * v[1], hx * v[1] - hy * v[0], height, firsts)):
        R_A2 = _rotated(base, firsts[i])
        R_A3 = _product(R_A2, R[2], FORTH)
        p_A3 = origin + _turned(R_A2, p[2], FORTH)
        # Orientation of L7 in L3 with joint 2 of the arm at 0.
        N = _product(_transposed(R_A3), R_A7, FORTH)
        tilt = N[2, 2] * s5 - rz * fz
        for j in range(_angles(rx * fx + ry * fy, ry * fx - rx * fy, tilt, fifths)):
            wrist = _product(_rotated(R[5], fifths[j]), R[6], FORTH)
            sixth = _azimuth(s5 * wrist[2, 0], s5 * wrist[2, 1]) - _azimuth(N[2, 0], N[2, 1])
            R_A5 = _product(R_A7, _rotated(wrist, sixth), BACK)
            u = _turned(R_A3, W - _turned(R_A5, p[5], FORTH) - p_A3, BACK)
            for k in range(_elbow(arm, u, thirds)):
                R_34 = _rotated(R[3], thirds[k])
                m = p[3] + _turned(R_34, p[4], FORTH)
                second = _azimuth(u[0], u[1]) - _azimuth(m[0], m[1])
                R_A4 = _product(_rotated(R_A3, second), R_34, FORTH)
                K = _product(_transposed(_product(R_A4, R[4], FORTH)), R_A5, FORTH)
                q = solutions[found]
                q[0], q[1], q[2], q[3] = 0.0, firsts[i], second, thirds[k]
                q[4], q[5], q[6] = np.arctan2(K[1, 0], K[0, 0]), fifths[j], sixth
                found += 1
    return found


@inner
def _elbow(arm: SixJointArm, u: FloatArray, angles: FloatArray) -> int:
    """Fill the angles of the middle parallel joint at which the outer two are as far apart as u."""
    R, a, b = arm.R[3], arm.p[3], arm.p[4]
    x, y = R[0, 0] * a[0] + R[1, 0] * a[1], R[0, 1] * a[0] + R[1, 1] * a[1]
    square = u[0] * u[0] + u[1] * u[1]
    rest = a[0] * a[0] + a[1] * a[1] + b[0] * b[0] + b[1] * b[1]
    return _angles(2.0 * (x * b[0] + y * b[1]), 2.0 * (y * b[0] - x * b[1]), square - rest, angles)


@inner
def _angles(cosine: float, sine: float, total: float, angles: FloatArray) -> int:
    """Fill the angles t with cosine cos(t) + sine sin(t) = total [rad], shape (2,).

    Returns:
        Number of angles, 0 or 2.
    """
    length = np.hypot(cosine, sine)
    if length * length < ALIGNED or abs(total) > length * (1.0 + ROUNDING):
        return 0
    middle, off = np.arctan2(sine, cosine), np.arccos(min(max(total / length, -1.0), 1.0))
    angles[0], angles[1] = middle - off, middle + off
    return 2


@inner
def _azimuth(x: float, y: float) -> float:
    """Return the angle of a vector from the x axis [rad], 0 for one without a direction."""
    return np.arctan2(y, x) if x * x + y * y > ALIGNED else 0.0


@inner
def _rotated(R: FloatArray, angle: float) -> FloatArray:
    """Return R Rz(angle), shape (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    out = np.empty((3, 3))
    for r in range(3):
        x, y = R[r, 0], R[r, 1]
        out[r, 0], out[r, 1], out[r, 2] = c * x + s * y, c * y - s * x, R[r, 2]
    return out


@inner
def _product(A: FloatArray, B: FloatArray, direction: int) -> FloatArray:
    """Return A B, or A B^T if the direction is BACK, shape (3, 3)."""
    out = np.empty((3, 3))
    for r in range(3):
        for c in range(3):
            total = 0.0
            for k in range(3):
                total += A[r, k] * (B[c, k] if direction == BACK else B[k, c])
            out[r, c] = total
    return out


@inner
def _turned(R: FloatArray, v: FloatArray, direction: int) -> FloatArray:
    """Return R v, or R^T v if the direction is BACK, shape (3,)."""
    out = np.empty(3)
    for r in range(3):
        total = 0.0
        for k in range(3):
            total += (R[k, r] if direction == BACK else R[r, k]) * v[k]
        out[r] = total
    return out


@inner
def _transposed(R: FloatArray) -> FloatArray:
    """Return the transpose of R, in memory of its own, shape (3, 3)."""
    out = np.empty((3, 3))
    for r in range(3):
        for c in range(3):
            out[r, c] = R[c, r]
    return out

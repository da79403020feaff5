"""Inverse kinematics of many samples of the free joint at once.

A sample is a value of joint 1 on one branch of the solution. The loop over samples contains no
conditional jumps, so the compiler vectorises it. Joints 1 .. 7 are those of the chain as solved,
which is reversed for an arm of the spherical-shoulder class.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import jit

MAX_SAMPLES = 512
"""Most samples that are solved at once."""
ROW = MAX_SAMPLES + 8
"""Distance of the rows of joints: at a power of two they would displace each other from the
processor's cache."""
_ROW = np.uint64(ROW)
# Unsigned: numba then adds no test for indices counted from the end, which would keep the compiler
# from vectorising. Rows at constant distances of one array need no test for overlaps either.
C2, S2, C3, S3, C4, S4 = (np.uint64(k) * _ROW for k in range(6))
C5, S5, C6, S6, C7, S7 = (np.uint64(k) * _ROW for k in range(6, 12))
"""Offsets of cos(q2), sin(q2) .. sin(q7) in the rows. Out of reach, the nearest angle is used, so
that all of them vary continuously with q1."""
AIM, WRIST = np.uint64(12) * _ROW, np.uint64(13) * _ROW
"""How far aim [m] and wrist [1] are out of reach; <= 0 where they exist."""
A7X, A7Y, A7Z = (np.uint64(k) * _ROW for k in range(14, 17))
"""Axis 7 in L3."""
TOOL_X, TOOL_Y, TOOL_Z = (np.uint64(k) * _ROW for k in range(17, 20))
"""From the wrist centre to the tool, in L3 [m]."""
ROWS = 20
TINY = 1e-300
"""Avoids 0/0 at a singularity; such samples are infeasible."""
SHARP = 1e24
"""A direction is along an axis where the squared sine of their angle is below 1 / SHARP. An angle
of 1e-12 rad still determines the joint to 1e-4 rad; the joints that follow compensate for that
error, so that the pose is exact."""
LEAST_BEND = 5e-13
"""How far the cosine of the elbow stays from 1 and -1: the elbow keeps an angle of 1e-6 rad, so
that the joints next to it stay determined. The tool moves by less than 1e-12 m for that."""
ELBOW_ROUNDING = 1e-11
"""What rounding may take from 1 - cos^2 of the elbow at full stretch: twice the rounding of |SW|^2
that counts as reached (`arcs.REACH_ROUNDING`) over twice the product of the lengths of upper arm
and forearm, which is above 0.02 m^2."""
LEAST_TILT = 3e-10
"""Added to the components of axis 7 across axis 5 before joint 5 is computed from them. Where the
wrist is exactly straight, joints 5 and 7 may rotate against each other at a single angle of the
free joint: this spreads their postures over 3e-10 rad of it, far above rounding, and changes the
pose by no more."""
TILTED = 1e-14
"""Squared sine of joint 6 below which LEAST_TILT is added: elsewhere it would only change the
order of solutions of equal measure."""
LEAST_FLEX = 1e-22
"""Least squared sine of joint 6 from the straight wrist: it keeps an angle of 1e-11 rad, so that
joint 5 stays determined."""
WRIST_ROUNDING = 2e-15
"""What rounding may take from the squared sine of joint 6, ten times over: at the straight wrist it
must not decide whether a sample is feasible. The tool rotates by up to 4e-8 rad for that."""


@jit
def solve_samples(
    arm: ArmSolver,
    goal: FloatArray,
    branch: IntArray,
    cosines: FloatArray,
    sines: FloatArray,
    count: int,
    rows: FloatArray,
    slack: FloatArray,
) -> None:
    """Fill the joints of each sample, and its slack.

    Args:
        arm: The arm.
        goal: From `wrist_goal`, shape (4, 3).
        branch: Three signs, one row of `arm.branches`.
        cosines: cos(q1) for the values of the free joint, shape (>= count,).
        sines: sin(q1) for the same values, shape (>= count,).
        count: Number of samples.
        rows: Filled from `C2` to `TOOL_Z`, shape (ROWS * ROW,).
        slack: Filled, shape (>= count,): >= 0 where the branch exists and every joint is within its
            limits. It measures the worst condition, as a difference of cosines, and varies
            continuously with q1.
    """
    R, p = arm.R, arm.p
    a00, a01, a02 = R[1, 0, 0], R[1, 0, 1], R[1, 0, 2]
    a10, a11, a12 = R[1, 1, 0], R[1, 1, 1], R[1, 1, 2]
    a20, a21, a22 = R[1, 2, 0], R[1, 2, 1], R[1, 2, 2]
    b00, b01, b02 = R[2, 0, 0], R[2, 0, 1], R[2, 0, 2]
    b10, b11, b12 = R[2, 1, 0], R[2, 1, 1], R[2, 1, 2]
    b20, b21, b22 = R[2, 2, 0], R[2, 2, 1], R[2, 2, 2]
    c00, c01, c02 = R[3, 0, 0], R[3, 0, 1], R[3, 0, 2]
    c10, c11, c12 = R[3, 1, 0], R[3, 1, 1], R[3, 1, 2]
    c20, c21, c22 = R[3, 2, 0], R[3, 2, 1], R[3, 2, 2]
    d00, d01, d02 = R[4, 0, 0], R[4, 0, 1], R[4, 0, 2]
    d10, d11, d12 = R[4, 1, 0], R[4, 1, 1], R[4, 1, 2]
    d20, d21, d22 = R[4, 2, 0], R[4, 2, 1], R[4, 2, 2]
    e00, e01, e02 = R[5, 0, 0], R[5, 0, 1], R[5, 0, 2]
    e10, e11, e12 = R[5, 1, 0], R[5, 1, 1], R[5, 1, 2]
    e20, e21, e22 = R[5, 2, 0], R[5, 2, 1], R[5, 2, 2]
    f00, f10, f20 = R[6, 0, 0], R[6, 1, 0], R[6, 2, 0]
    f01, f11, f21 = R[6, 0, 1], R[6, 1, 1], R[6, 2, 1]
    f02, f12, f22 = R[6, 0, 2], R[6, 1, 2], R[6, 2, 2]
    sx, sy, sz = p[1, 0], p[1, 1], p[1, 2]
    u0x, u0y, u0z = arm.u0[0], arm.u0[1], arm.u0[2]
    ucx, ucy, ucz = arm.uc[0], arm.uc[1], arm.uc[2]
    usx, usy, usz = arm.us[0], arm.us[1], arm.us[2]
    reach0, reach1 = arm.reach[0], arm.reach[1]
    cphase, sphase = np.cos(arm.reach[2]), np.sin(arm.reach[2])
    h1, h2, h3, h4 = arm.limit_cos[0], arm.limit_cos[1], arm.limit_cos[2], arm.limit_cos[3]
    h5, h6, h7 = arm.limit_cos[4], arm.limit_cos[5], arm.limit_cos[6]
    mc1, ms1 = arm.middle_cos[0], arm.middle_sin[0]
    mc2, ms2 = arm.middle_cos[1], arm.middle_sin[1]
    mc3, ms3 = arm.middle_cos[2], arm.middle_sin[2]
    mc4, ms4 = arm.middle_cos[3], arm.middle_sin[3]
    mc5, ms5 = arm.middle_cos[4], arm.middle_sin[4]
    mc6, ms6 = arm.middle_cos[5], arm.middle_sin[5]
    mc7, ms7 = arm.middle_cos[6], arm.middle_sin[6]
    elbow, aim, wrist = float(branch[0]), float(branch[1]), float(branch[2])
    wx, wy, wz = goal[0, 0], goal[0, 1], goal[0, 2]
    zx, zy, zz = goal[1, 0], goal[1, 1], goal[1, 2]
    xx, xy, xz = goal[2, 0], goal[2, 1], goal[2, 2]
    tx, ty, tz = goal[3, 0], goal[3, 1], goal[3, 2]
    # Wrist: g_z = P6 cos q6 + Q6 sin q6 + const, the same for every sample.
    P6 = e20 * f02 + e21 * f12
    Q6 = e21 * f02 - e20 * f12
    N6 = P6 * P6 + Q6 * Q6 + TINY
    root6 = np.sqrt(N6)
    for i in range(count):
        c1, s1 = cosines[i], sines[i]
        # SW in L1, then in the frame about whose z axis joint 2 rotates.
        vx, vy, vz = c1 * wx + s1 * wy - sx, -s1 * wx + c1 * wy - sy, wz - sz
        square = vx * vx + vy * vy + vz * vz
        v2x = a00 * vx + a10 * vy + a20 * vz
        v2y = a01 * vx + a11 * vy + a21 * vz
        v2z = a02 * vx + a12 * vy + a22 * vz
        # Joint 4 from the distance between shoulder and wrist.
        k = (square - reach0) / reach1
        elbow_left = 1.0 - k * k + ELBOW_ROUNDING
        k = min(max(k, LEAST_BEND - 1.0), 1.0 - LEAST_BEND)
        s = elbow * np.sqrt(1.0 - k * k)
        c4, s4 = k * cphase - s * sphase, k * sphase + s * cphase
        ux = u0x + ucx * c4 + usx * s4
        uy = u0y + ucy * c4 + usy * s4
        uz = u0z + ucz * c4 + usz * s4
        # Joint 3: the component of SW along axis 2 must be v2z.
        P, Q = b20 * ux + b21 * uy, b21 * ux - b20 * uy
        N = P * P + Q * Q + TINY
        m = v2z - b22 * uz
        aim_left = N - m * m
        # Out of reach, the nearest angle is used, so that slack remains continuous.
        root = np.sqrt(N)
        aim_excess = abs(m) - root
        m = min(max(m, -root), root)
        h = aim * np.sqrt(max(aim_left, 0.0))
        c3, s3 = (P * m - Q * h) / N, (Q * m + P * h) / N
        # Joint 2: rotate SW towards the wrist centre of the goal.
        rx, ry = c3 * ux - s3 * uy, s3 * ux + c3 * uy
        kx = b00 * rx + b01 * ry + b02 * uz
        ky = b10 * rx + b11 * ry + b12 * uz
        D2 = kx * kx + ky * ky
        # Where the aim succeeds, D equals D2; out of reach it keeps (c2, s2) of length 1, so that
        # slack remains continuous, as the search for narrow windows requires.
        D = np.sqrt(D2 * (v2x * v2x + v2y * v2y) + TINY)
        c2, s2 = (kx * v2x + ky * v2y) / D, (kx * v2y - ky * v2x) / D
        # Axis 7, its x axis and the tool offset, into L3.
        gx, gy, gz = c1 * zx + s1 * zy, -s1 * zx + c1 * zy, zz
        px, py, pz = a00 * gx + a10 * gy + a20 * gz, a01 * gx + a11 * gy + a21 * gz, 0.0
        pz = a02 * gx + a12 * gy + a22 * gz
        gx, gy, gz = c2 * px + s2 * py, -s2 * px + c2 * py, pz
        px, py, pz = b00 * gx + b10 * gy + b20 * gz, b01 * gx + b11 * gy + b21 * gz, 0.0
        pz = b02 * gx + b12 * gy + b22 * gz
        a7x, a7y, a7z = c3 * px + s3 * py, -s3 * px + c3 * py, pz
        gx, gy, gz = c1 * xx + s1 * xy, -s1 * xx + c1 * xy, xz
        px, py, pz = a00 * gx + a10 * gy + a20 * gz, a01 * gx + a11 * gy + a21 * gz, 0.0
        pz = a02 * gx + a12 * gy + a22 * gz
        gx, gy, gz = c2 * px + s2 * py, -s2 * px + c2 * py, pz
        px, py, pz = b00 * gx + b10 * gy + b20 * gz, b01 * gx + b11 * gy + b21 * gz, 0.0
        pz = b02 * gx + b12 * gy + b22 * gz
        n7x, n7y, n7z = c3 * px + s3 * py, -s3 * px + c3 * py, pz
        gx, gy, gz = c1 * tx + s1 * ty, -s1 * tx + c1 * ty, tz
        px, py, pz = a00 * gx + a10 * gy + a20 * gz, a01 * gx + a11 * gy + a21 * gz, 0.0
        pz = a02 * gx + a12 * gy + a22 * gz
        gx, gy, gz = c2 * px + s2 * py, -s2 * px + c2 * py, pz
        px, py, pz = b00 * gx + b10 * gy + b20 * gz, b01 * gx + b11 * gy + b21 * gz, 0.0
        pz = b02 * gx + b12 * gy + b22 * gz
        ox, oy, oz = c3 * px + s3 * py, -s3 * px + c3 * py, pz
        # Axis 7 and its x axis, into the frame about whose z axis joint 5 rotates.
        px, py, pz = c00 * a7x + c10 * a7y + c20 * a7z, c01 * a7x + c11 * a7y + c21 * a7z, 0.0
        pz = c02 * a7x + c12 * a7y + c22 * a7z
        gx, gy, gz = c4 * px + s4 * py, -s4 * px + c4 * py, pz
        m7x = d00 * gx + d10 * gy + d20 * gz
        m7y = d01 * gx + d11 * gy + d21 * gz
        m7z = d02 * gx + d12 * gy + d22 * gz
        px, py, pz = c00 * n7x + c10 * n7y + c20 * n7z, c01 * n7x + c11 * n7y + c21 * n7z, 0.0
        pz = c02 * n7x + c12 * n7y + c22 * n7z
        gx, gy, gz = c4 * px + s4 * py, -s4 * px + c4 * py, pz
        k7x = d00 * gx + d10 * gy + d20 * gz
        k7y = d01 * gx + d11 * gy + d21 * gz
        k7z = d02 * gx + d12 * gy + d22 * gz
        # Joints 6, 5, 7.
        m = m7z - e22 * f22
        wrist_left = N6 - m * m
        wrist_excess = abs(m) - root6
        m = min(max(m, -root6), root6)
        h = wrist * np.sqrt(max(wrist_left, LEAST_FLEX * N6))
        c6, s6 = (P6 * m - Q6 * h) / N6, (Q6 * m + P6 * h) / N6
        rx, ry = c6 * f02 - s6 * f12, s6 * f02 + c6 * f12
        kx = e00 * rx + e01 * ry + e02 * f22
        ky = e10 * rx + e11 * ry + e12 * f22
        D5 = kx * kx + ky * ky
        tilt = LEAST_TILT if m7x * m7x + m7y * m7y < TILTED else 0.0
        m7x, m7y = m7x + tilt, m7y + tilt
        D = np.sqrt(D5 * (m7x * m7x + m7y * m7y) + TINY)
        c5, s5 = (kx * m7x + ky * m7y) / D, (kx * m7y - ky * m7x) / D
        px, py = c5 * k7x + s5 * k7y, -s5 * k7x + c5 * k7y
        gx = e00 * px + e10 * py + e20 * k7z
        gy = e01 * px + e11 * py + e21 * k7z
        gz = e02 * px + e12 * py + e22 * k7z
        px, py = c6 * gx + s6 * gy, -s6 * gx + c6 * gy
        c7 = f00 * px + f10 * py + f20 * gz
        s7 = f01 * px + f11 * py + f21 * gz
        # Its length is 1 except where wrist or aim is out of reach: normalise as for joint 2.
        D = np.sqrt(c7 * c7 + s7 * s7 + TINY)
        c7, s7 = c7 / D, s7 / D
        left = min(elbow_left, min(aim_left / N, wrist_left / N6 + WRIST_ROUNDING))
        # Where SW lies along axis 2 or 3, or axis 7 along axis 5, a joint is undetermined: such
        # samples are infeasible. Elsewhere these terms are far above any slack.
        left = min(left, min(min(N, D2) * SHARP - square, D5 * SHARP - 1.0))
        left = min(left, c1 * mc1 + s1 * ms1 - h1)
        left = min(left, c2 * mc2 + s2 * ms2 - h2)
        left = min(left, c3 * mc3 + s3 * ms3 - h3)
        left = min(left, c4 * mc4 + s4 * ms4 - h4)
        left = min(left, c5 * mc5 + s5 * ms5 - h5)
        left = min(left, c6 * mc6 + s6 * ms6 - h6)
        left = min(left, c7 * mc7 + s7 * ms7 - h7)
        slack[i] = left
        n = np.uint64(i)
        rows[C2 + n], rows[S2 + n] = c2, s2
        rows[C3 + n], rows[S3 + n] = c3, s3
        rows[C4 + n], rows[S4 + n] = c4, s4
        rows[C5 + n], rows[S5 + n] = c5, s5
        rows[C6 + n], rows[S6 + n] = c6, s6
        rows[C7 + n], rows[S7 + n] = c7, s7
        rows[AIM + n], rows[WRIST + n] = aim_excess, wrist_excess
        rows[A7X + n], rows[A7Y + n], rows[A7Z + n] = a7x, a7y, a7z
        rows[TOOL_X + n], rows[TOOL_Y + n], rows[TOOL_Z + n] = ox, oy, oz


@jit
def measure_samples(
    arm: ArmSolver, rows: FloatArray, slack: FloatArray, count: int, measure: FloatArray
) -> None:
    """Fill the isotropy of each sample.

    Args:
        arm: The arm.
        rows: From `solve_samples`.
        slack: From `solve_samples`.
        count: Number of samples.
        measure: Filled, shape (>= count,): kinematic isotropy to the sixth power, negative where
            slack < 0.

    Source:
        Isotropy: TCS eq. (2) with the sixth root, Delta = det(J J^T)^(1/6) / (trace(J J^T)/6).
        det(J J^T) does not depend on the point whose velocity J describes, so it is taken at the
        wrist centre, where joints 5 to 7 move nothing. By Cauchy and Binet it is the sum of the
        squared 6x6 minors, which are products of 3x3 determinants there. The trace is taken at
        the tool.
    """
    R, p = arm.R, arm.p
    a20, a21, a22 = R[1, 2, 0], R[1, 2, 1], R[1, 2, 2]
    b00, b01, b02 = R[2, 0, 0], R[2, 0, 1], R[2, 0, 2]
    b10, b11, b12 = R[2, 1, 0], R[2, 1, 1], R[2, 1, 2]
    b20, b21, b22 = R[2, 2, 0], R[2, 2, 1], R[2, 2, 2]
    c00, c01, c02 = R[3, 0, 0], R[3, 0, 1], R[3, 0, 2]
    c10, c11, c12 = R[3, 1, 0], R[3, 1, 1], R[3, 1, 2]
    c20, c21, c22 = R[3, 2, 0], R[3, 2, 1], R[3, 2, 2]
    d00, d01, d02 = R[4, 0, 0], R[4, 0, 1], R[4, 0, 2]
    d10, d11, d12 = R[4, 1, 0], R[4, 1, 1], R[4, 1, 2]
    d20, d21, d22 = R[4, 2, 0], R[4, 2, 1], R[4, 2, 2]
    e02, e12, e22 = R[5, 0, 2], R[5, 1, 2], R[5, 2, 2]
    sx, sy, sz = p[1, 0], p[1, 1], p[1, 2]
    ex, ey, ez = p[3, 0], p[3, 1], p[3, 2]
    u0x, u0y, u0z = arm.u0[0], arm.u0[1], arm.u0[2]
    ucx, ucy, ucz = arm.uc[0], arm.uc[1], arm.uc[2]
    usx, usy, usz = arm.us[0], arm.us[1], arm.us[2]
    # From the shoulder S to a point of axis 1, in the frame that joint 2 turns about.
    s2x = -(R[1, 0, 0] * sx + R[1, 1, 0] * sy + a20 * sz)
    s2y = -(R[1, 0, 1] * sx + R[1, 1, 1] * sy + a21 * sz)
    s2z = -(R[1, 0, 2] * sx + R[1, 1, 2] * sy + a22 * sz)
    for i in range(count):
        n = np.uint64(i)
        c2, s2 = rows[C2 + n], rows[S2 + n]
        c3, s3 = rows[C3 + n], rows[S3 + n]
        c4, s4 = rows[C4 + n], rows[S4 + n]
        c5, s5 = rows[C5 + n], rows[S5 + n]
        a7x, a7y, a7z = rows[A7X + n], rows[A7Y + n], rows[A7Z + n]
        ox, oy, oz = rows[TOOL_X + n], rows[TOOL_Y + n], rows[TOOL_Z + n]
        ux = u0x + ucx * c4 + usx * s4
        uy = u0y + ucy * c4 + usy * s4
        uz = u0z + ucz * c4 + usz * s4
        # Axes 1, 2 (3 is z), 4 .. 6 in L3, and the velocity of W that each joint causes.
        px, py = c2 * a20 + s2 * a21, -s2 * a20 + c2 * a21
        gx, gy = b00 * px + b10 * py + b20 * a22, b01 * px + b11 * py + b21 * a22
        gz = b02 * px + b12 * py + b22 * a22
        a1x, a1y, a1z = c3 * gx + s3 * gy, -s3 * gx + c3 * gy, gz
        px, py = c2 * s2x + s2 * s2y, -s2 * s2x + c2 * s2y
        gx, gy = b00 * px + b10 * py + b20 * s2z, b01 * px + b11 * py + b21 * s2z
        gz = b02 * px + b12 * py + b22 * s2z
        kx, ky, kz = ux - (c3 * gx + s3 * gy), uy - (-s3 * gx + c3 * gy), uz - gz
        l1x, l1y, l1z = a1y * kz - a1z * ky, a1z * kx - a1x * kz, a1x * ky - a1y * kx
        a2x, a2y, a2z = c3 * b20 + s3 * b21, -s3 * b20 + c3 * b21, b22
        l2x, l2y, l2z = a2y * uz - a2z * uy, a2z * ux - a2x * uz, a2x * uy - a2y * ux
        l3x, l3y = -uy, ux
        kx, ky, kz = ux - ex, uy - ey, uz - ez
        l4x, l4y, l4z = c12 * kz - c22 * ky, c22 * kx - c02 * kz, c02 * ky - c12 * kx
        px, py = c4 * d02 - s4 * d12, s4 * d02 + c4 * d12
        a5x = c00 * px + c01 * py + c02 * d22
        a5y = c10 * px + c11 * py + c12 * d22
        a5z = c20 * px + c21 * py + c22 * d22
        px, py = c5 * e02 - s5 * e12, s5 * e02 + c5 * e12
        gx = d00 * px + d01 * py + d02 * e22
        gy = d10 * px + d11 * py + d12 * e22
        gz = d20 * px + d21 * py + d22 * e22
        px, py = c4 * gx - s4 * gy, s4 * gx + c4 * gy
        a6x = c00 * px + c01 * py + c02 * gz
        a6y = c10 * px + c11 * py + c12 * gz
        a6z = c20 * px + c21 * py + c22 * gz
        # n spans the null space of the 3x4 block of wrist velocities.
        x34, y34, z34 = l3y * l4z, -l3x * l4z, l3x * l4y - l3y * l4x
        x12, y12, z12 = l1y * l2z - l1z * l2y, l1z * l2x - l1x * l2z, l1x * l2y - l1y * l2x
        n1 = l2x * x34 + l2y * y34 + l2z * z34
        n2 = -(l1x * x34 + l1y * y34 + l1z * z34)
        n3 = x12 * l4x + y12 * l4y + z12 * l4z
        n4 = -(x12 * l3x + y12 * l3y)
        kx = n1 * a1x + n2 * a2x + n4 * c02
        ky = n1 * a1y + n2 * a2y + n4 * c12
        kz = n1 * a1z + n2 * a2z + n3 + n4 * c22
        x67, y67, z67 = a6y * a7z - a6z * a7y, a6z * a7x - a6x * a7z, a6x * a7y - a6y * a7x
        x57, y57, z57 = a5y * a7z - a5z * a7y, a5z * a7x - a5x * a7z, a5x * a7y - a5y * a7x
        x56, y56, z56 = a5y * a6z - a5z * a6y, a5z * a6x - a5x * a6z, a5x * a6y - a5y * a6x
        d567 = a5x * x67 + a5y * y67 + a5z * z67
        d67 = kx * x67 + ky * y67 + kz * z67
        d57 = kx * x57 + ky * y57 + kz * z57
        d56 = kx * x56 + ky * y56 + kz * z56
        n_square = n1 * n1 + n2 * n2 + n3 * n3 + n4 * n4
        det = n_square * d567 * d567 + d67 * d67 + d57 * d57 + d56 * d56
        # The trace at the tool: each column of J is a unit axis a and a linear part l + a x o.
        kx, ky, kz = l1x + a1y * oz - a1z * oy, l1y + a1z * ox - a1x * oz, l1z + a1x * oy - a1y * ox
        trace = 7.0 + kx * kx + ky * ky + kz * kz
        kx, ky, kz = l2x + a2y * oz - a2z * oy, l2y + a2z * ox - a2x * oz, l2z + a2x * oy - a2y * ox
        trace += kx * kx + ky * ky + kz * kz
        kx, ky = l3x - oy, l3y + ox
        trace += kx * kx + ky * ky
        kx, ky, kz = l4x + c12 * oz - c22 * oy, l4y + c22 * ox - c02 * oz, l4z + c02 * oy - c12 * ox
        trace += kx * kx + ky * ky + kz * kz
        kx, ky, kz = a5y * oz - a5z * oy, a5z * ox - a5x * oz, a5x * oy - a5y * ox
        trace += kx * kx + ky * ky + kz * kz
        kx, ky, kz = a6y * oz - a6z * oy, a6z * ox - a6x * oz, a6x * oy - a6y * ox
        trace += kx * kx + ky * ky + kz * kz
        kx, ky, kz = a7y * oz - a7z * oy, a7z * ox - a7x * oz, a7x * oy - a7y * ox
        trace += kx * kx + ky * ky + kz * kz
        scale = 6.0 / trace
        scale = scale * scale * scale
        isotropy = det * scale * scale
        measure[i] = isotropy if slack[i] >= 0.0 else -isotropy

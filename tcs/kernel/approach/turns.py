"""The closed form at one value of the free joint, with the sines and cosines of all joints.

`ik.sample_joints` takes sine, cosine and arc tangent joint by joint from the library, which takes
longer than the rest of it; scoring keeps that: its results do not change by a bit. Here sines and
cosines follow from each other, as in `samples`, and all arc tangents are found in one vector loop.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.ik import rotated_back, turned_back, within
from tcs.kernel.analytic.samples import LEAST_BEND, LEAST_FLEX, LEAST_TILT, TILTED, TINY
from tcs.kernel.analytic.solver import LAST, ArmSolver
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.motion.link_poses import LANES

EIGHTH = np.sqrt(2.0) - 1.0
"""Tangent of an eighth of a half turn: beyond it an angle is counted from a quarter of one."""
A0, A1, A2 = 3.33333333333329318027e-01, -1.99999999998764832476e-01, 1.42857142725034663711e-01
A3, A4, A5 = -1.11111104054623557880e-01, 9.09088713343650656196e-02, -7.69187620504482999495e-02
A6, A7, A8 = 6.66107313738753120669e-02, -5.83357013379057348645e-02, 4.97687799461593236017e-02
A9, A10 = -3.65315727442169155270e-02, 1.62858201153657823623e-02
"""Coefficients of the arc tangent up to 7/16, as in FreeBSD's `s_atan.c` (Sun Microsystems 1993):
good to the last bit but one."""


@inner
def place_sample(
    arm: ArmSolver,
    goal: FloatArray,
    branch: IntArray,
    free: float,
    q: FloatArray,
    turns: FloatArray,
) -> None:
    """Fill the seven joint angles of one sample as `ik.sample_joints` does, and their turns.

    Args:
        arm: The arm.
        goal: From `wrist_goal`, shape (4, 3).
        branch: Three signs, one row of `arm.branches`.
        free: Angle of the free joint [rad].
        q: Filled with joint angles [rad], shape (7,).
        turns: Filled, shape (3, LANES): scratch, sines and cosines.
    """
    R, angle, sine, cosine = arm.R, turns[0], turns[1], turns[2]
    c, s = np.cos(free), np.sin(free)
    sine[0], cosine[0] = s, c
    vx, vy, vz = turned_back(c, s, goal[0, 0], goal[0, 1], goal[0, 2])
    zx, zy, zz = turned_back(c, s, goal[1, 0], goal[1, 1], goal[1, 2])
    xx, xy, xz = turned_back(c, s, goal[2, 0], goal[2, 1], goal[2, 2])
    vx, vy, vz = vx - arm.p[1, 0], vy - arm.p[1, 1], vz - arm.p[1, 2]
    square = vx * vx + vy * vy + vz * vz
    vx, vy, vz = rotated_back(R[1], vx, vy, vz)
    k = (square - arm.reach[0]) / arm.reach[1]
    k = min(max(k, LEAST_BEND - 1.0), 1.0 - LEAST_BEND)
    s = branch[0] * np.sqrt(1.0 - k * k)
    cosine[3] = k * arm.phase[0] - s * arm.phase[1]
    sine[3] = k * arm.phase[1] + s * arm.phase[0]
    ux = arm.u0[0] + arm.uc[0] * cosine[3] + arm.us[0] * sine[3]
    uy = arm.u0[1] + arm.uc[1] * cosine[3] + arm.us[1] * sine[3]
    uz = arm.u0[2] + arm.uc[2] * cosine[3] + arm.us[2] * sine[3]
    cosine[2], sine[2] = _turn_to_height(R[2], ux, uy, uz, vz, branch[1], 0.0)
    kx, ky = _across(R[2], cosine[2], sine[2], ux, uy, uz)
    cosine[1], sine[1] = _turn_between(kx, ky, vx, vy)
    for j in range(1, 4):
        zx, zy, zz = rotated_back(R[j], zx, zy, zz)
        zx, zy, zz = turned_back(cosine[j], sine[j], zx, zy, zz)
        xx, xy, xz = rotated_back(R[j], xx, xy, xz)
        xx, xy, xz = turned_back(cosine[j], sine[j], xx, xy, xz)
    zx, zy, zz = rotated_back(R[4], zx, zy, zz)
    xx, xy, xz = rotated_back(R[4], xx, xy, xz)
    fx, fy, fz = R[6, 0, 2], R[6, 1, 2], R[6, 2, 2]
    cosine[5], sine[5] = _turn_to_height(R[5], fx, fy, fz, zz, branch[2], LEAST_FLEX)
    kx, ky = _across(R[5], cosine[5], sine[5], fx, fy, fz)
    tilt = LEAST_TILT if zx * zx + zy * zy < TILTED else 0.0
    cosine[4], sine[4] = _turn_between(kx, ky, zx + tilt, zy + tilt)
    xx, xy, xz = turned_back(cosine[4], sine[4], xx, xy, xz)
    xx, xy, xz = rotated_back(R[5], xx, xy, xz)
    xx, xy, xz = turned_back(cosine[5], sine[5], xx, xy, xz)
    xx, xy, xz = rotated_back(R[6], xx, xy, xz)
    length = np.sqrt(xx * xx + xy * xy + TINY)
    cosine[6], sine[6] = xx / length, xy / length
    if arm.free == LAST:
        for j in range(3):
            sine[j], sine[6 - j] = sine[6 - j], sine[j]
            cosine[j], cosine[6 - j] = cosine[6 - j], cosine[j]
    fill_angles(turns)
    for j in range(7):
        q[j] = angle[j]
    q[arm.free] = free
    for j in range(7):
        q[j] = within(q[j], arm.lower[j], arm.upper[j])


@inner
def fill_angles(turns: FloatArray) -> None:
    """Fill angles in (-pi, pi] from their sines and cosines, the rows of `turns` after them."""
    angle, sine, cosine = turns[0], turns[1], turns[2]
    # No branch: LLVM makes this loop a vector loop.
    for n in range(LANES):
        x, y = abs(cosine[n]), abs(sine[n])
        is_steep = y > x
        t = (x if is_steep else y) / (y if is_steep else x)
        is_wide = t > EIGHTH
        t = (t - 1.0) / (t + 1.0) if is_wide else t
        z = t * t
        w = z * z
        odd = z * (A0 + w * (A2 + w * (A4 + w * (A6 + w * (A8 + w * A10)))))
        even = w * (A1 + w * (A3 + w * (A5 + w * (A7 + w * A9))))
        turn = (0.25 * np.pi if is_wide else 0.0) + (t - t * (odd + even))
        turn = 0.5 * np.pi - turn if is_steep else turn
        turn = np.pi - turn if cosine[n] < 0.0 else turn
        angle[n] = -turn if sine[n] < 0.0 else turn


@inner
def _turn_to_height(
    R: FloatArray, x: float, y: float, z: float, height: float, sign: int, least: float
) -> tuple[float, float]:
    """Return cosine and sine of the angle that `ik` finds for a height."""
    P, Q = R[2, 0] * x + R[2, 1] * y, R[2, 1] * x - R[2, 0] * y
    m = height - R[2, 2] * z
    N = P * P + Q * Q
    h = sign * np.sqrt(max(N - m * m, least * N))
    scale = 1.0 / np.sqrt(N * (m * m + h * h) + TINY)
    return (P * m - Q * h) * scale, (Q * m + P * h) * scale


@inner
def _across(R: FloatArray, c: float, s: float, x: float, y: float, z: float) -> tuple[float, float]:
    """Return the components of R Rz (x, y, z) across the z axis; Rz has cosine c and sine s."""
    rx, ry = c * x - s * y, s * x + c * y
    return (
        R[0, 0] * rx + R[0, 1] * ry + R[0, 2] * z,
        R[1, 0] * rx + R[1, 1] * ry + R[1, 2] * z,
    )


@inner
def _turn_between(kx: float, ky: float, vx: float, vy: float) -> tuple[float, float]:
    """Return cosine and sine of the angle from k to v, both in a plane."""
    scale = 1.0 / np.sqrt((kx * kx + ky * ky) * (vx * vx + vy * vy) + TINY)
    return (kx * vx + ky * vy) * scale, (kx * vy - ky * vx) * scale

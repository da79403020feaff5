"""Tool poses whose wrist is within reach, of a goal far from the arm that any orientation serves.

From the goal, the wrist has to lie in the directions of a spherical cap about that of the pivot. A
small cap holds few of the poses that are spread over all orientations, so poses are made in it: the
direction of the wrist in the cap, and the rotation of the tool about it.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.freedom.forms import FULL_TURN, PARAMETERS
from tcs.kernel.low_discrepancy import spread

STEP = np.remainder(spread(1, 3)[0] + 0.5, 1.0)
RISE, ROUND, ROLL = float(STEP[0]), float(STEP[1]), float(STEP[2])
"""Steps of a low-discrepancy sequence in the unit cube."""
WHOLE = -1.0
"""Cosine of the half-angle of a cap of all directions."""
SHORT = 1e-3
"""Distance of two points below which the direction from one to the other says nothing [m]."""
PARALLEL = 1e-12
"""Length of the cross product of two unit vectors below which they are parallel."""


@jit
def cap_cosine(wrist: FloatArray, pivot: FloatArray, span: float) -> float:
    """Return the cosine of the half-angle of the cap, above 1 if no direction is within reach.

    Args:
        wrist: The wrist in T [m], shape (3,).
        pivot: The pivot in the frame of the goal, where the tool is [m], shape (3,).
        span: Greatest distance of the wrist from the pivot [m].
    """
    away, out = norm(pivot), norm(wrist)
    if away + out <= span:
        return WHOLE
    if away - out > span:
        return 2.0
    if away < SHORT or out < SHORT:
        return WHOLE
    return float((away * away + out * out - span * span) / (2.0 * away * out))


@jit
def cap_pose(
    form: FloatArray, wrist: FloatArray, pivot: FloatArray, cosine: float, n: int, u: FloatArray
) -> None:
    """Fill the parameters of a pose in the cap, number n of a low-discrepancy sequence.

    Args:
        form: Row of `FreeGoals.form`, of any orientation.
        wrist: The wrist in T [m], shape (3,).
        pivot: The pivot in the frame of the goal [m], shape (3,).
        cosine: From `cap_cosine`.
        n: Number of the pose.
        u: Filled; without displacement, shape (PARAMETERS,).
    """
    T, G, R = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    direction, v = np.empty(3), 1.0 / norm(pivot)
    for k in range(3):
        direction[k] = v * pivot[k]
    _triad(direction, 0.0, G)
    along = 1.0 - ((0.5 + n * RISE) % 1.0) * (1.0 - cosine)
    across, azimuth = np.sqrt(max(1.0 - along * along, 0.0)), FULL_TURN * ((n * ROUND) % 1.0)
    x, y = across * np.cos(azimuth), across * np.sin(azimuth)
    for k in range(3):
        direction[k] = along * G[0, k] + x * G[1, k] + y * G[2, k]
    _triad(direction, FULL_TURN * ((n * ROLL) % 1.0), G)
    v = 1.0 / norm(wrist)
    for k in range(3):
        direction[k] = v * wrist[k]
    _triad(direction, 0.0, T)
    for r in range(3):
        for c in range(3):
            R[r, c] = G[0, r] * T[0, c] + G[1, r] * T[1, c] + G[2, r] * T[2, c]
    parameters_of(form, R, u)


@inner
def parameters_of(form: FloatArray, R: FloatArray, u: FloatArray) -> None:
    """Fill the parameters of an orientation R_GT, without displacement.

    Args:
        form: Row of `FreeGoals.form`, of any orientation.
        R: The orientation, shape (3, 3).
        u: Filled, shape (PARAMETERS,).
    """
    axis, first, second = form[0:3], form[9:12], form[12:15]
    tilted, turned = np.empty(3), np.empty(3)
    for r in range(3):
        tilted[r] = R[r, 0] * axis[0] + R[r, 1] * axis[1] + R[r, 2] * axis[2]
        turned[r] = R[r, 0] * first[0] + R[r, 1] * first[1] + R[r, 2] * first[2]
    x = axis[1] * tilted[2] - axis[2] * tilted[1]
    y = axis[2] * tilted[0] - axis[0] * tilted[2]
    z = axis[0] * tilted[1] - axis[1] * tilted[0]
    sine, cosine = np.sqrt(x * x + y * y + z * z), _dot(axis, tilted)
    angle = np.arctan2(sine, cosine)
    if sine > PARALLEL:
        x, y, z = x / sine, y / sine, z / sine
    else:
        x, y, z = first[0], first[1], first[2]
    for k in range(PARAMETERS):
        u[k] = 0.0
    u[1] = angle * (x * first[0] + y * first[1] + z * first[2])
    u[2] = angle * (x * second[0] + y * second[1] + z * second[2])
    # The vector `first` after the rotation about the axis: the tilt is taken back from `turned`.
    along = x * turned[0] + y * turned[1] + z * turned[2]
    c, s = np.cos(angle), np.sin(angle)
    bx = c * turned[0] - s * (y * turned[2] - z * turned[1]) + (1.0 - c) * along * x
    by = c * turned[1] - s * (z * turned[0] - x * turned[2]) + (1.0 - c) * along * y
    bz = c * turned[2] - s * (x * turned[1] - y * turned[0]) + (1.0 - c) * along * z
    u[0] = np.arctan2(
        bx * second[0] + by * second[1] + bz * second[2],
        bx * first[0] + by * first[1] + bz * first[2],
    )


@inner
def norm(v: FloatArray) -> float:
    """Return the length of a vector, shape (3,)."""
    return float(np.sqrt(_dot(v, v)))


@inner
def _dot(a: FloatArray, b: FloatArray) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@inner
def _triad(first: FloatArray, angle: float, rows: FloatArray) -> None:
    """Fill three perpendicular unit vectors, right-handed, as rows.

    Args:
        first: The first one, shape (3,).
        angle: By which the others are rotated about it [rad].
        rows: Filled, shape (3, 3).
    """
    x, y, z = first[0], first[1], first[2]
    # The coordinate axis farthest from the first vector, made perpendicular.
    least = min(abs(x), abs(y), abs(z))
    if abs(x) == least:
        ax, ay, az = 1.0 - x * x, -x * y, -x * z
    elif abs(y) == least:
        ax, ay, az = -y * x, 1.0 - y * y, -y * z
    else:
        ax, ay, az = -z * x, -z * y, 1.0 - z * z
    scale = 1.0 / np.sqrt(ax * ax + ay * ay + az * az)
    ax, ay, az = ax * scale, ay * scale, az * scale
    bx, by, bz = y * az - z * ay, z * ax - x * az, x * ay - y * ax
    c, s = np.cos(angle), np.sin(angle)
    rows[0, 0], rows[0, 1], rows[0, 2] = x, y, z
    rows[1, 0], rows[1, 1], rows[1, 2] = c * ax + s * bx, c * ay + s * by, c * az + s * bz
    rows[2, 0], rows[2, 1], rows[2, 2] = c * bx - s * ax, c * by - s * ay, c * bz - s * az

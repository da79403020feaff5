"""The tool on a motion: bounds on its speed, and on how far it is off a straight line.

Both are measured at samples, between which derivatives of the joints bound what is missed.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.motion.scene import MotionScene
from tcs.kernel.motion.straight import OFF_LINE
from tcs.model.tasks import TOOL_SPEED
from tcs.motion.curves import Curve
from tcs.motion.limits import rates

BETWEEN = 1e-4
"""Part of the speed and of the error of the line that may be missed between samples."""


def tool_slowing(scene: MotionScene, motion: Curve) -> float:
    """Return the greatest speed of the tool as a fraction of TOOL_SPEED, at most BETWEEN too large.

    Args:
        scene: The arm.
        motion: A cubic spline of the time [s].
    """
    missed = BETWEEN * TOOL_SPEED
    _, third, _ = _greatest_derivatives(scene, motion)
    q, dq = _samples(motion, np.sqrt(third / (8.0 * missed)))
    _, p, axes, origins = _tool(scene, q)
    arms = np.cross(axes, p[:, None] - origins)
    sliding = scene.chain.slides > 0.0
    arms[:, sliding] = scene.chain.slides[sliding, None] * axes[:, sliding]
    speed = np.linalg.norm(np.einsum("nk,nkr->nr", dq, arms), axis=1)
    return float(np.max(speed) + missed) / TOOL_SPEED


def is_straight(scene: MotionScene, motion: Curve) -> bool:
    """Return whether the tool moves along a line at constant orientation, within OFF_LINE.

    Only `scene.turn` keeps its direction if the tool is free to rotate about it.

    Args:
        scene: The arm.
        motion: A motion whose ends are on the line.
    """
    missed = BETWEEN * OFF_LINE
    second, _, turning = _greatest_derivatives(scene, motion)
    q, _ = _samples(motion, np.sqrt(np.maximum(second, turning) / (8.0 * missed)))
    R, p, _, _ = _tool(scene, q)
    line = (p[-1] - p[0]) / np.linalg.norm(p[-1] - p[0])
    from_begin = p - p[0]
    off = np.linalg.norm(from_begin - np.outer(from_begin @ line, line), axis=1)
    turned = np.linalg.norm(R - R[0], axis=(1, 2)) / np.sqrt(2.0)
    if np.any(scene.chain.free_axis):
        turned = np.linalg.norm((R - R[0]) @ scene.chain.free_axis, axis=1)
    return bool(max(np.max(off), np.max(turned)) + missed <= OFF_LINE)


def _samples(motion: Curve, per_parameter: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return joint angles and their derivatives along a motion, shapes (m, 7).

    Args:
        motion: The motion.
        per_parameter: Least number of samples on each piece by its length, shape (n,).
    """
    counts = np.maximum(np.ceil(np.diff(motion.knots) * per_parameter).astype(np.int64), 1)
    piece = np.repeat(np.arange(motion.pieces), counts + 1)
    fractions = np.concatenate([np.linspace(0.0, 1.0, count + 1) for count in counts])
    q, dq, _ = motion.derivatives(piece, fractions)
    return q, dq


def _greatest_derivatives(
    scene: MotionScene, motion: Curve
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return bounds on derivatives of the tool's pose on each piece of a motion, shapes (n,).

    The derivative of the tool's position by joints up to k is at most its distance from axis k. A
    prismatic joint moves it no more than a rotation of a link as long as the joint ever extends.

    Args:
        scene: The arm.
        motion: The motion.

    Returns:
        The second and the third derivative of the position [m/s^2, m/s^3], and the second of the
        orientation, as rotation vectors [rad/s^2].
    """
    velocity, acceleration, jerk = rates(motion)
    links = np.linalg.norm(scene.chain.p[1:, :3], axis=1)
    sliding = scene.chain.slides > 0.0
    farthest = np.maximum(np.abs(scene.limits.lower), np.abs(scene.limits.upper))[sliding]
    links[sliding] += scene.chain.slides[sliding] * farthest
    for rate in (velocity, acceleration, jerk):
        rate[:, sliding] /= farthest
    # From the origin of each joint to the tool with the arm stretched.
    far = np.cumsum(links[::-1])[::-1]
    v, a = np.cumsum(velocity, axis=1), np.cumsum(acceleration, axis=1)

    def by_axis(sums: FloatArray) -> FloatArray:
        return np.asarray(np.diff(sums, axis=1, prepend=0.0) @ far)

    second = by_axis(v**2) + acceleration @ far
    third = by_axis(v**3) + 3.0 * by_axis(a * v) + jerk @ far
    turning = 2.0 * v[:, -1] ** 2 + a[:, -1]
    return second, third, turning


def _tool(
    scene: MotionScene, q: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return poses of the tool in A, orientation (n, 3, 3) and position (n, 3) [m], and of axes.

    Args:
        scene: The arm.
        q: Postures [rad], shape (n, 7).

    Returns:
        Orientation and position of the tool, and directions and origins [m] of the joints' axes in
        A, shapes (n, 7, 3).
    """
    R, p = np.repeat(np.eye(3)[None], len(q), axis=0), np.zeros((len(q), 3))
    axes, origins = np.empty((len(q), 7, 3)), np.empty((len(q), 7, 3))
    for k in range(7):
        p = p + R @ scene.chain.p[k, :3]
        R = R @ scene.chain.R[k]
        axes[:, k], origins[:, k] = R[:, :, 2], p
        if scene.chain.slides[k] > 0.0:
            p = p + scene.chain.slides[k] * q[:, k, None] * R[:, :, 2]
            continue
        turn = np.zeros((len(q), 3, 3))
        c, s = np.cos(q[:, k]), np.sin(q[:, k])
        turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = c, -s, s, c
        turn[:, 2, 2] = 1.0
        R = R @ turn
    return R @ scene.chain.R[7], p + R @ scene.chain.p[7, :3], axes, origins

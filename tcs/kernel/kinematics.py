"""Kinematics of an arm of seven revolute joints: link poses, tool pose, Jacobian, pose error.

`tcs.kernel.arrays.Chain` defines the frames. `tool_pose` and `jacobian` can be called from Python,
the others from compiled code only. The reference implementation in `tests/reference`
deliberately repeats these computations, to check them.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit

SMALL_ANGLE_COSINE = 0.9
"""Cosine of a rotation angle above which the sine approximates the angle."""


@inner
def copy_joints(q: FloatArray, to_q: FloatArray) -> None:
    """Copy seven joint angles; numba takes two seconds to compile `to_q[:] = q`."""
    for k in range(7):
        to_q[k] = q[k]


@inner
def link_poses(
    chain_R: FloatArray, chain_p: FloatArray, q: FloatArray, link_R: FloatArray, link_p: FloatArray
) -> None:
    """Fill the poses of the links L1..L7 in the arm base A; row i of the outputs is Li.

    Args:
        chain_R: Rotations of the chain, shape (8, 3, 3).
        chain_p: Translations of the chain [m], shape (8, 3); with a fourth column that holds
            `Chain.slides` if there are prismatic joints.
        q: Joint angles [rad], or positions [m], shape (7,).
        link_R: Filled with orientations, shape (8, 3, 3); row 0 is the identity, A itself.
        link_p: Filled with origins [m], shape (8, 3).
    """
    for r in range(3):
        link_p[0, r] = 0.0
        for c in range(3):
            link_R[0, r, c] = 1.0 if r == c else 0.0
    sliding = chain_p.shape[1] > 3
    for i in range(7):
        F, f = chain_R[i], chain_p[i]
        R, S = link_R[i], link_R[i + 1]
        slides = sliding and f[3] > 0.0
        cosine, sine = (1.0, 0.0) if slides else (np.cos(q[i]), np.sin(q[i]))
        for r in range(3):
            x = R[r, 0] * F[0, 0] + R[r, 1] * F[1, 0] + R[r, 2] * F[2, 0]
            y = R[r, 0] * F[0, 1] + R[r, 1] * F[1, 1] + R[r, 2] * F[2, 1]
            S[r, 0], S[r, 1] = cosine * x + sine * y, -sine * x + cosine * y
            S[r, 2] = R[r, 0] * F[0, 2] + R[r, 1] * F[1, 2] + R[r, 2] * F[2, 2]
            step = R[r, 0] * f[0] + R[r, 1] * f[1] + R[r, 2] * f[2]
            link_p[i + 1, r] = link_p[i, r] + step
            if slides:
                link_p[i + 1, r] += S[r, 2] * f[3] * q[i]


@inner
def place_tool(
    chain_R: FloatArray,
    chain_p: FloatArray,
    link_R: FloatArray,
    link_p: FloatArray,
    R_AT: FloatArray,
    p_AT: FloatArray,
) -> None:
    """Fill the tool pose from the link poses.

    Args:
        chain_R: Rotations of the chain, shape (8, 3, 3).
        chain_p: Translations of the chain [m], shape (8, 3).
        link_R: From `link_poses`, shape (8, 3, 3).
        link_p: From `link_poses` [m], shape (8, 3).
        R_AT: Filled, shape (3, 3).
        p_AT: Filled [m], shape (3,).
    """
    R, F, f = link_R[7], chain_R[7], chain_p[7]
    for r in range(3):
        offset = R[r, 0] * f[0] + R[r, 1] * f[1] + R[r, 2] * f[2]
        p_AT[r] = link_p[7, r] + offset
        for c in range(3):
            R_AT[r, c] = R[r, 0] * F[0, c] + R[r, 1] * F[1, c] + R[r, 2] * F[2, c]


@jit
def tool_pose(
    chain_R: FloatArray,
    chain_p: FloatArray,
    q: FloatArray,
    link_R: FloatArray,
    link_p: FloatArray,
    R_AT: FloatArray,
    p_AT: FloatArray,
) -> None:
    """Fill the poses of the links and the pose of the tool in the arm base A.

    Args:
        chain_R: Rotations of the chain, shape (8, 3, 3).
        chain_p: Translations of the chain [m], shape (8, 3).
        q: Joint angles [rad], shape (7,).
        link_R: Filled with the orientations of A, L1..L7 in A, shape (8, 3, 3).
        link_p: Filled with their origins [m], shape (8, 3).
        R_AT: Filled, shape (3, 3).
        p_AT: Filled [m], shape (3,).
    """
    link_poses(chain_R, chain_p, q, link_R, link_p)
    place_tool(chain_R, chain_p, link_R, link_p, R_AT, p_AT)


@inner
def fill_jacobian(link_R: FloatArray, link_p: FloatArray, tool: FloatArray, J: FloatArray) -> None:
    """Fill the Jacobian of the tool from the link poses.

    Args:
        link_R: From `link_poses`, shape (8, 3, 3).
        link_p: From `link_poses` [m], shape (8, 3).
        tool: Position of the tool in A [m], shape (3,).
        J: Filled, shape (6, 7), rows [angular; linear] [rad/rad; m/rad].
    """
    R, p = link_R, link_p
    for i in range(7):
        x, y, z = R[i + 1, 0, 2], R[i + 1, 1, 2], R[i + 1, 2, 2]
        dx, dy, dz = tool[0] - p[i + 1, 0], tool[1] - p[i + 1, 1], tool[2] - p[i + 1, 2]
        J[0, i], J[1, i], J[2, i] = x, y, z
        J[3, i], J[4, i], J[5, i] = y * dz - z * dy, z * dx - x * dz, x * dy - y * dx


@inner
def fill_sliding(chain_p: FloatArray, link_R: FloatArray, J: FloatArray) -> None:
    """Replace the columns of prismatic joints in a Jacobian as `fill_jacobian` fills it."""
    if chain_p.shape[1] > 3:
        for i in range(7):
            if chain_p[i, 3] > 0.0:
                for r in range(3):
                    J[r, i], J[3 + r, i] = 0.0, chain_p[i, 3] * link_R[i + 1, r, 2]


@jit
def jacobian(chain_R: FloatArray, chain_p: FloatArray, q: FloatArray, J: FloatArray) -> None:
    """Fill the Jacobian of the tool in the arm base A.

    Args:
        chain_R: Rotations of the chain, shape (8, 3, 3).
        chain_p: Translations of the chain [m], shape (8, 3).
        q: Joint angles [rad], shape (7,).
        J: Filled, shape (6, 7), rows [angular; linear] [rad/rad; m/rad].
    """
    R, p = np.empty((8, 3, 3)), np.empty((8, 3))
    link_poses(chain_R, chain_p, q, R, p)
    tool, f = np.empty(3), chain_p[7]
    for r in range(3):
        offset = R[7, r, 0] * f[0] + R[7, r, 1] * f[1] + R[7, r, 2] * f[2]
        tool[r] = p[7, r] + offset
    fill_jacobian(R, p, tool, J)
    fill_sliding(chain_p, R, J)


@inner
def pose_error(
    R: FloatArray, p: FloatArray, R_goal: FloatArray, p_goal: FloatArray, error: FloatArray
) -> float:
    """Fill the rotation vector and the translation from a pose to a goal, both in the same frame.

    Args:
        R: Orientation, shape (3, 3).
        p: Position [m], shape (3,).
        R_goal: Orientation of the goal, shape (3, 3).
        p_goal: Position of the goal [m], shape (3,).
        error: Filled, shape (6,): rotation vector [rad], translation [m]. Below about 26 degrees
            the sine approximates the angle.

    Returns:
        Largest absolute entry of the error [rad or m].
    """
    # Half the sum of the cross products of the axes with those of the goal: axis times sine.
    ex, ey, ez, trace = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        ex += R[1, k] * R_goal[2, k] - R[2, k] * R_goal[1, k]
        ey += R[2, k] * R_goal[0, k] - R[0, k] * R_goal[2, k]
        ez += R[0, k] * R_goal[1, k] - R[1, k] * R_goal[0, k]
        trace += R[0, k] * R_goal[0, k] + R[1, k] * R_goal[1, k] + R[2, k] * R_goal[2, k]
    scale, cosine = 0.5, 0.5 * (trace - 1.0)
    if cosine < SMALL_ANGLE_COSINE:
        sine = 0.5 * np.sqrt(ex * ex + ey * ey + ez * ez)
        # At 180 degrees the axis is undetermined; any error will do to start iterating from.
        scale = 0.5 * np.arctan2(sine, cosine) / max(sine, 1e-9)
    error[0], error[1], error[2] = scale * ex, scale * ey, scale * ez
    worst = 0.0
    for k in range(3):
        error[3 + k] = p_goal[k] - p[k]
        worst = max(worst, max(abs(error[k]), abs(error[3 + k])))
    return worst

"""Kinematic isotropy at given joint angles, from the Jacobian itself."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import jit
from tcs.kernel.contacts import place_links


@jit
def jacobian(chain_R: FloatArray, chain_p: FloatArray, q: FloatArray, J: FloatArray) -> None:
    """Fill the Jacobian of tool T in the arm base A.

    Args:
        chain_R: Rotations of the chain, shape (8, 3, 3).
        chain_p: Translations of the chain [m], shape (8, 3).
        q: Joint angles [rad], shape (7,).
        J: Filled, shape (6, 7), rows [angular; linear] [rad/rad; m/rad].
    """
    R, p = np.empty((8, 3, 3)), np.empty((8, 3))
    place_links(chain_R, chain_p, q, R, p)
    tool, f = np.empty(3), chain_p[7]
    for r in range(3):
        offset = R[7, r, 0] * f[0] + R[7, r, 1] * f[1] + R[7, r, 2] * f[2]
        tool[r] = p[7, r] + offset
    for i in range(7):
        x, y, z = R[i + 1, 0, 2], R[i + 1, 1, 2], R[i + 1, 2, 2]
        dx, dy, dz = tool[0] - p[i + 1, 0], tool[1] - p[i + 1, 1], tool[2] - p[i + 1, 2]
        J[0, i], J[1, i], J[2, i] = x, y, z
        J[3, i], J[4, i], J[5, i] = y * dz - z * dy, z * dx - x * dz, x * dy - y * dx


@jit
def isotropy_at(chain_R: FloatArray, chain_p: FloatArray, q: FloatArray) -> float:
    """Return how evenly the arm can move its tool in every direction, at joint angles q.

    Args:
        chain_R: Rotations of the chain, shape (8, 3, 3).
        chain_p: Translations of the chain [m], shape (8, 3).
        q: Joint angles [rad], shape (7,).

    Returns:
        Isotropy in [0, 1]; 0 at a singularity.

    Source:
        TCS eq. (2), det(J J^T)^(1/6) / (trace(J J^T)/6). The print shows a square root; only the
        sixth root keeps the measure below 1. Rows mix units: compare within one robot only.
    """
    J = np.empty((6, 7))
    jacobian(chain_R, chain_p, q, J)
    G = np.empty((6, 6))
    trace = 0.0
    for i in range(6):
        for j in range(i + 1):
            total = 0.0
            for k in range(7):
                total += J[i, k] * J[j, k]
            G[i, j] = total
        trace += G[i, i]
    # det of a Gram matrix by its Cholesky factor, in place.
    det = 1.0
    for j in range(6):
        pivot = G[j, j]
        for k in range(j):
            pivot -= G[j, k] * G[j, k]
        if pivot <= 0.0:
            return 0.0
        det *= pivot
        root = np.sqrt(pivot)
        for i in range(j + 1, 6):
            total = G[i, j]
            for k in range(j):
                total -= G[i, k] * G[j, k]
            G[i, j] = total / root
    return det ** (1.0 / 6.0) / (trace / 6.0)


@jit
def rounded_inward(q: FloatArray, lower: FloatArray, upper: FloatArray, out: FloatArray) -> None:
    """Fill `out` with q as float32 values that never pass a limit.

    Args:
        q: Joint angles [rad], shape (7,).
        lower: Lower limits [rad], shape (7,).
        upper: Upper limits [rad], shape (7,).
        out: Filled with the float32 values, as float64, shape (7,).
    """
    for i in range(q.size):
        near = np.float32(q[i])
        if near > upper[i]:
            near = np.nextafter(near, np.float32(-np.inf))
        elif near < lower[i]:
            near = np.nextafter(near, np.float32(np.inf))
        out[i] = near

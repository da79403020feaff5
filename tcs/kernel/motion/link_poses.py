"""Poses of the links at a posture, with the sines and cosines of all joints in one vector loop.

The library's sine and cosine, called joint by joint, take longer than all else that these poses
take. Scoring keeps them: its results do not change by a bit.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner

LANES = 8
"""Joints in the vector loop: seven, and one more to fill a vector."""
QUARTERS = 2.0 / np.pi
HIGH, LOW = 1.57079632673412561417e00, 6.07710050650619224932e-11
"""A quarter of a turn as the sum of two numbers, of which the first has 33 bits: a few thousand
times it is exact."""
S1, S2, S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
S4, S5, S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
"""Coefficients of the sine within an eighth of a turn, as in FreeBSD's `k_sin.c` (Sun Microsystems
1993): good to the last bit but one."""
C1, C2, C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
C4, C5, C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11
"""Coefficients of the cosine, as in `k_cos.c`."""


@inner
def place_links(
    chain_R: FloatArray,
    chain_p: FloatArray,
    q: FloatArray,
    turns: FloatArray,
    link_R: FloatArray,
    link_p: FloatArray,
) -> None:
    """Fill the poses of the links L1..L7 in the arm base A, as `kinematics.link_poses` does.

    Args:
        chain_R: Rotations of the chain, shape (8, 3, 3).
        chain_p: Translations of the chain [m], as for `kinematics.link_poses`.
        q: Joint angles [rad], below 1,000 turns, or positions [m], shape (7,).
        turns: Scratch, shape (3, LANES): angles, sines and cosines.
        link_R: Filled with orientations, shape (8, 3, 3); row 0 is the identity, A itself.
        link_p: Filled with origins [m], shape (8, 3).
    """
    angle, sine, cosine = turns[0], turns[1], turns[2]
    for k in range(7):
        angle[k] = q[k]
    # No branch: LLVM makes this loop a vector loop.
    for k in range(LANES):
        quarter = np.floor(angle[k] * QUARTERS + 0.5)
        x = (angle[k] - quarter * HIGH) - quarter * LOW
        z = x * x
        s = x + x * z * (S1 + z * (S2 + z * (S3 + z * (S4 + z * (S5 + z * S6)))))
        c = 1.0 - (0.5 * z - z * z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * (C5 + z * C6))))))
        side = quarter - 4.0 * np.floor(0.25 * quarter)
        is_odd = side == 1.0 or side == 3.0
        first, second = (c, s) if is_odd else (s, c)
        sine[k] = -first if side >= 2.0 else first
        cosine[k] = -second if side == 1.0 or side == 2.0 else second
    place_turned(chain_R, chain_p, q, turns, link_R, link_p)


@inner
def place_turned(
    chain_R: FloatArray,
    chain_p: FloatArray,
    q: FloatArray,
    turns: FloatArray,
    link_R: FloatArray,
    link_p: FloatArray,
) -> None:
    """Do as `place_links`, given the sines and cosines of the joints in `turns`."""
    sine, cosine = turns[1], turns[2]
    for r in range(3):
        link_p[0, r] = 0.0
        for c in range(3):
            link_R[0, r, c] = 1.0 if r == c else 0.0
    sliding = chain_p.shape[1] > 3
    for i in range(7):
        F, f = chain_R[i], chain_p[i]
        R, S = link_R[i], link_R[i + 1]
        slides = sliding and f[3] > 0.0
        cosine_i, sine_i = (1.0, 0.0) if slides else (cosine[i], sine[i])
        for r in range(3):
            x = R[r, 0] * F[0, 0] + R[r, 1] * F[1, 0] + R[r, 2] * F[2, 0]
            y = R[r, 0] * F[0, 1] + R[r, 1] * F[1, 1] + R[r, 2] * F[2, 1]
            S[r, 0], S[r, 1] = cosine_i * x + sine_i * y, -sine_i * x + cosine_i * y
            S[r, 2] = R[r, 0] * F[0, 2] + R[r, 1] * F[1, 2] + R[r, 2] * F[2, 2]
            step = R[r, 0] * f[0] + R[r, 1] * f[1] + R[r, 2] * f[2]
            link_p[i + 1, r] = link_p[i, r] + step
            if slides:
                link_p[i + 1, r] += S[r, 2] * f[3] * q[i]

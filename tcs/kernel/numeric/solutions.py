"""Inverse kinematics of one pose for an arm without a closed form, collisions not considered."""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.ik import within
from tcs.kernel.arrays import Chain, FloatArray
from tcs.kernel.dexterity import ISOTROPY
from tcs.kernel.numeric.arm import numeric_arm
from tcs.kernel.numeric.curves import correct
from tcs.kernel.numeric.search import (
    MOST_CANDIDATES,
    MOST_CURVES,
    MOST_POINTS,
    find_curves,
    is_within_span,
    new_curve_search,
)

ARRIVED = 1e-9
"""Greatest error of a solution [rad and m]."""


def numeric_solutions(chain: Chain, R_AG: FloatArray, p_AG: FloatArray) -> FloatArray:
    """Return arm postures with the tool at a pose, at most 0.2 rad apart along each curve.

    The curves are those that scoring searches; collisions are not checked.

    Args:
        chain: Any arm of seven revolute joints.
        R_AG: Goal orientation in the arm base A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).

    Returns:
        Joint angles within the limits [rad], shape (n, 7); n is 0 if no solution is found.
    """
    arm, search = numeric_arm(chain), new_curve_search(MOST_POINTS, MOST_CURVES, MOST_CANDIDATES)
    R, p = np.array(R_AG, dtype=np.float64, order="C"), np.array(p_AG, dtype=np.float64)
    if not is_within_span(arm, R, p):
        return np.empty((0, 7))
    curves = search.curves
    count = find_curves(arm, R, p, search, ISOTROPY)
    found = []
    for n in np.flatnonzero(curves.slack[: curves.first[count]] >= 0.0):
        curves.q_now[:] = curves.q[n]
        if not correct(arm, R, p, curves, ARRIVED):
            continue
        joints = zip(curves.q_now, chain.lower, chain.upper, strict=True)
        turned = [within(*joint) for joint in joints]
        # A point next to a limit may converge beyond it, and `within` would clip it.
        off = np.asarray(turned) - curves.q_now
        if np.abs(np.remainder(off + np.pi, 2.0 * np.pi) - np.pi).max() < ARRIVED:
            found.append(turned)
    return np.array(found).reshape(-1, 7)

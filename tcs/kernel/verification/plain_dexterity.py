"""Dexterity of one posture by its definition, in plain numpy: shares no code with the kernel.

`tcs verify` recomputes the stored dexterity with it, and tests compare the compiled measures.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import null_space

from tcs.kernel.arrays import FloatArray
from tcs.kernel.dexterity import (
    INVERSE_CONDITION,
    ISOTROPY,
    LIMIT_WEIGHTED,
    NORMALISED,
    UNLIMITED,
    dexterity,
)


def isotropy(J: FloatArray) -> float:
    """Return TCS eq. (2) with the m-th root, m rows: det(J J^T)^(1/m) / (trace(J J^T)/m)."""
    G, m = J @ J.T, len(J)
    return max(float(np.linalg.det(G)), 0.0) ** (1 / m) / (float(np.trace(G)) / m)


def inverse_condition(J: FloatArray) -> float:
    """Return ITCM thesis eq. (20): the least over the greatest singular value."""
    sigma = np.linalg.svd(J, compute_uv=False)
    return float(sigma.min() / sigma.max())


_FUNCTIONS = {ISOTROPY: isotropy, INVERSE_CONDITION: inverse_condition}
"""Function of the Jacobian, by its code in a measure."""


def limit_penalty(q: FloatArray, lower: FloatArray, upper: FloatArray, penalty: int) -> float:
    """Return ITCM thesis eq. (21) over the joints that have limits, k = 1e6.

    The normalised penalty multiplies every factor by 4, so that it is 1 in the middle of the
    limits, and sets k = 1e6 / 4^7: with seven limited joints the value is the same.
    """
    if penalty == UNLIMITED:
        return 1.0
    limited = np.isfinite(lower) & np.isfinite(upper)
    factors = (q - lower)[limited] * (upper - q)[limited] / (upper - lower)[limited] ** 2
    if penalty == NORMALISED:
        return 1.0 - math.exp(-(1e6 / 4**7) * float(np.prod(4 * factors)))
    return 1.0 - math.exp(-1e6 * float(np.prod(factors)))


def limit_weight(q: float, lower: float, upper: float) -> float:
    """Return the weight of a joint in JLWKI: 1 for a joint without limits.

    Source:
        TOC, max(0.001, 1 - 0.5^((R - |R - q + lower|) / (0.05 R) + 1)), R half the range.
    """
    if not (math.isfinite(lower) and math.isfinite(upper)):
        return 1.0
    R = (upper - lower) / 2
    return max(0.001, 1 - 0.5 ** ((R - abs(R - q + lower)) / (0.05 * R) + 1))


def prescribed(J: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the rows of J that a goal prescribes which leaves a rotation free, shape (5, joints).

    Args:
        J: Shape (6, joints), rows [angular; linear].
        axis: Unit axis of that rotation, in the frame of J, shape (3,).
    """
    across = null_space(axis[None])
    return np.concatenate([across.T @ J[:3], J[3:]])


def measured(
    J: FloatArray, q: FloatArray, lower: FloatArray, upper: FloatArray, measure: str
) -> float:
    """Return the dexterity measure of that name, ITCM thesis eq. (22) where it has a penalty.

    JLWKI is the isotropy of J with the column of each joint multiplied by the root of its weight.
    J of an arm of five joints is `prescribed`.
    """
    of, penalty = dexterity(measure)
    if of == LIMIT_WEIGHTED:
        weights = np.array([limit_weight(*joint) for joint in zip(q, lower, upper, strict=True)])
        return isotropy(J * np.sqrt(weights[-J.shape[1] :]))
    value = _FUNCTIONS[of](J)
    return value * limit_penalty(q, lower, upper, penalty)

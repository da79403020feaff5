"""Rates of the joints on a line where those of the shortest motion exceed a velocity limit.

A redundant arm has a motion that leaves the tool where it is. As much of it is added as the joint
needs that would be too fast.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.motion.straight import StraightWorkspace
from tcs.kernel.numeric.newton import null_space_direction

LEAST_SHARE = 1e-3
"""Least share of a joint in the motion that leaves the tool where it is, for its rate to be
changed by that."""


@inner
def are_kept(fastest: FloatArray, rates: FloatArray) -> bool:
    """Return whether no joint exceeds its greatest rate."""
    for k in range(7):
        if abs(rates[k]) > fastest[k]:
            return False
    return True


@inner
def slow_down(line: StraightWorkspace, fastest: FloatArray, rates: FloatArray) -> bool:
    """Let the joint that is the most too fast move at its limit; return whether all keep theirs.

    Args:
        line: Holds the factor at the posture; `q` is scratch.
        fastest: Greatest rate of each joint [rad], shape (7,).
        rates: Derivatives of the joints by the fraction of the line [rad], shape (7,); changed.
    """
    worst, fast = 1.0, 0
    for k in range(7):
        if abs(rates[k]) > worst * fastest[k]:
            worst, fast = abs(rates[k]) / fastest[k], k
    alone, along = line.q, line.newton.step
    for k in range(7):
        alone[k] = 1.0 if k == fast else 0.0
    share = null_space_direction(line.newton, alone, along)
    if share < LEAST_SHARE:
        return False
    limit = np.copysign(fastest[fast], rates[fast])
    change = (limit - rates[fast]) / share
    for k in range(7):
        rates[k] += change * along[k]
    rates[fast] = limit
    return are_kept(fastest, rates)

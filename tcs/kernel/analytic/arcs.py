"""Arcs of the free joint at which the goal is within reach, and windows to refine the search in."""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit

MAX_ARCS = 6
"""Greatest number of arcs: two, symmetric about the direction of the goal, each shifted by -1, 0
and 1 full turns."""

INSET = 1e-9
"""Distance of the ends of the arcs from the limits of free joint and elbow [rad]. The slack there
is about 1e-9, so that rounding does not decide whether the outermost sample is feasible."""

REACH_ROUNDING = 1e-13
"""What rounding may add to |SW|^2 [m^2], a hundred times its 1e-15: at full stretch, or folded all
the way, goals that the arm just reaches must not count as too far. The tool misses by 1e-13 m."""

IN_REACH, OUT_OF_REACH, OUT_OF_LIMITS = 0, 1, 2
"""Result of `elbow_arcs`."""


@jit
def elbow_arcs(arm: ArmSolver, goal: FloatArray, arcs: FloatArray) -> tuple[int, int]:
    """Fill the arcs of the free joint at which the elbow can span the distance shoulder to wrist.

    |SW|^2 varies as a cosine of q1, the free joint, about the direction of the goal, and as a
    cosine of q4: the limits of joint 4 bound the first cosine from both sides.

    Args:
        arm: The arm.
        goal: From `wrist_goal`, shape (4, 3).
        arcs: Filled with (first, last) [rad], shape (MAX_ARCS, 2); within the joint's limits.

    Returns:
        Number of arcs, and IN_REACH, OUT_OF_REACH (no angle of the free joint suffices) or
        OUT_OF_LIMITS (only angles beyond the limits of the free joint do).
    """
    wx, wy, wz = goal[0, 0], goal[0, 1], goal[0, 2]
    sx, sy, sz = arm.p[1, 0], arm.p[1, 1], arm.p[1, 2]
    near = arm.reach[0] + arm.reach[1] * arm.elbow_cos[0]
    far = arm.reach[0] + arm.reach[1] * arm.elbow_cos[1]
    steady = wx * wx + wy * wy + wz * wz + sx * sx + sy * sy + sz * sz - 2.0 * wz * sz
    cosine, sine = wx * sx + wy * sy, wy * sx - wx * sy
    swing = 2.0 * np.hypot(cosine, sine)
    centre = np.arctan2(sine, cosine)
    inner, outer = 0.0, np.pi
    if 0.0 < steady - swing - far < REACH_ROUNDING:
        far = steady - swing + REACH_ROUNDING
    if 0.0 < near - steady - swing < REACH_ROUNDING:
        near = steady + swing - REACH_ROUNDING
    # |SW|^2 = steady - swing cos(q1 - centre) must lie in [near, far].
    if steady - swing > far or steady + swing < near:
        return 0, OUT_OF_REACH
    if steady - swing < near:
        inner = INSET + np.arccos(min(max((steady - near) / swing, -1.0), 1.0))
    if steady + swing > far:
        outer = np.arccos(min(max((steady - far) / swing, -1.0), 1.0)) - INSET
    if inner > outer:
        return 0, OUT_OF_REACH
    lower, upper = arm.lower[arm.free], arm.upper[arm.free]
    if not upper - lower < 2.0 * np.pi:
        # One full turn about the direction of the goal contains every solution.
        if inner == 0.0:
            arcs[0, 0], arcs[0, 1] = centre - outer, centre + outer
            return 1, IN_REACH
        arcs[0, 0], arcs[0, 1] = centre - outer, centre - inner
        arcs[1, 0], arcs[1, 1] = centre + inner, centre + outer
        return 2, IN_REACH
    count = 0
    for turn in range(-1, 2):
        middle = centre + 2.0 * np.pi * turn
        for side in range(2):
            first, last = middle - outer, middle - inner
            if side == 1:
                first, last = middle + inner, middle + outer
            first, last = max(first, lower + INSET), min(last, upper - INSET)
            if first > last:
                continue
            # Arcs that join half a turn away from the goal are separated by rounding only.
            if count and arcs[count - 1, 1] >= first - INSET:
                arcs[count - 1, 1] = last
            elif count < MAX_ARCS:
                arcs[count, 0], arcs[count, 1] = first, last
                count += 1
    return count, IN_REACH if count else OUT_OF_LIMITS


@inner
def is_peak(slack: FloatArray, i: int, count: int, step: float) -> bool:
    """Return whether a feasible window narrower than the spacing may lie next to sample i.

    Args:
        slack: Slack of consecutive samples, shape (>= count,).
        i: Index of the sample.
        count: Number of samples.
        step: Spacing of the samples [rad].
    """
    if slack[i] >= 0.0 or slack[i] <= -PEAK_SLOPE * step:
        return False
    left = slack[i - 1] if i > 0 else -np.inf
    right = slack[i + 1] if i + 1 < count else -np.inf
    return left <= slack[i] and right <= slack[i]


@jit
def windows_of(slack: FloatArray, count: int, step: float, windows: FloatArray, found: int) -> int:
    """Append the windows of consecutive samples that contain, or may contain, feasible angles.

    A window is a run of feasible samples with the sample on either side, or the two neighbours of
    an infeasible sample whose slack is a local maximum: a feasible interval narrower than the
    spacing shows as such a peak.

    Args:
        slack: Slack of consecutive samples, shape (>= count,).
        count: Number of samples.
        step: Spacing of the samples [rad].
        windows: Filled with (first, last) as sample indices, shape (capacity, 2).
        found: Number of windows already present.

    Returns:
        Updated number of windows.
    """
    i = 0
    while i < count and found < windows.shape[0]:
        if slack[i] >= 0.0:
            j = i
            while j + 1 < count and slack[j + 1] >= 0.0:
                j += 1
            windows[found, 0], windows[found, 1] = max(i - 1, 0), min(j + 1, count - 1)
            found += 1
            i = j + 1
            continue
        if is_peak(slack, i, count, step):
            windows[found, 0], windows[found, 1] = max(i - 1, 0), min(i + 1, count - 1)
            found += 1
        i += 1
    return found


PEAK_SLOPE = 10.0
"""A peak whose slack is above -PEAK_SLOPE times the spacing may hide a feasible window. Slack is a
difference of cosines of joint angles, which change by a few radians per radian of the free joint,
and by up to 13 where one joint leaves a limit just as another meets one. The true maximum lies at
most half a spacing from the best sample, so this allows for slopes of 20."""

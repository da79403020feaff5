"""Lines that Newton's method follows, from postures on the way: where the grid finds none.

The grid moves the free joint, and the closed form moves the others. Next to a straight wrist, where
they turn fast against each other, and past the folds between branches, joints keep their limits
along other lines: those of the shortest joint motion, whatever the free joint does, with a joint
that arrives at its limit resting there. Through each posture leads one of them.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.ik import within
from tcs.kernel.approach.curve import MOST, finish_spline, is_too_fast, spline_is_free
from tcs.kernel.approach.grid import NOWHERE, PIECES
from tcs.kernel.approach.memory import AnyApproach, Approach
from tcs.kernel.approach.opening import end_of_window
from tcs.kernel.approach.scene import pair_contact_code
from tcs.kernel.approach.turns import place_sample
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.dexterity.measures import rounded_inward
from tcs.kernel.motion.scene import MotionScene
from tcs.kernel.motion.straight import (
    BLOCKED,
    DONE,
    LIMITS,
    OFF_LINE,
    StraightWorkspace,
    evaluate_on_line,
    next_on_line,
    release_joints,
    tangent_where_evaluated,
)
from tcs.kernel.numeric.newton import null_space_direction
from tcs.kernel.problem import Problem

LEAST_SHARE = 1e-3
"""Least share of a joint in the motion that leaves the tool where it is, for its rate to be
changed by that."""
AT_GOAL = int_constant(0)
"""Number of the point of a spline at the goal."""
PER_LEVEL = MOST // PIECES
"""Number of pieces of the spline between two levels of the grid."""
NONE = -1
"""In place of a joint that rests."""
RESTS = 1e-6
"""Distance from a limit within which a joint may rest where it is, all along a line [rad]."""
NARROW = 16
"""Greatest number of columns of a window in which the grid may miss lines: further on they may be
closer together than the columns."""
APART = 8
"""Number of columns from one posture to the next of a window, from which lines are followed."""


@inner
def lead_from(
    problem: Problem, approach: AnyApproach, fastest: FloatArray, first: int, q: FloatArray
) -> int:
    """Follow the line from one of its points to both ends; return DONE, LIMITS or BLOCKED.

    Args:
        problem: The scene.
        approach: The line is in place; the spline is filled, and `contact` if this is the first
            line that is blocked.
        fastest: As for `approach_pair`.
        first: Number of the point of the spline at which the posture is.
        q: The posture [rad], shape (7,).
    """
    scene, line = approach.scene, approach.curve.line
    outcome = _lead(problem, approach, fastest, first, q, NONE)
    release_joints(scene, line)
    for k in range(7):
        if outcome == DONE:
            break
        slack = min(q[k] - scene.limits.lower[k], scene.limits.upper[k] - q[k])
        if line.locked[k] == 0 and slack < RESTS:
            rested = _lead(problem, approach, fastest, first, q, k)
            if rested != LIMITS:
                outcome = rested
    return outcome


@inner
def _lead(
    problem: Problem,
    approach: AnyApproach,
    fastest: FloatArray,
    first: int,
    q: FloatArray,
    resting: int,
) -> int:
    """Do as `lead_from` with a joint that rests all along, or NONE."""
    curve, scene, offset = approach.curve, approach.scene, approach.offset
    points, slopes, line, ahead = curve.points, curve.slopes, curve.line, curve.ahead
    _release(scene, line, resting)
    if not next_on_line(scene, line, offset, first / MOST, q, q, points[first]):
        return LIMITS
    for side in range(2):
        step = 1 - 2 * side
        _release(scene, line, resting)
        n = first
        evaluate_on_line(scene, line, points[n])
        while True:
            if not tangent_where_evaluated(scene, line, offset, slopes[n]):
                return LIMITS
            before, begin = n, points[n]
            if not _are_kept(fastest, slopes[n]):
                if not _slow_down(line, fastest, slopes[n]):
                    return LIMITS
                begin = ahead
                for k in range(7):
                    begin[k] = points[n, k] + step / MOST * slopes[n, k]
            if n == (0 if side else MOST):
                break
            n += step
            if not next_on_line(scene, line, offset, n / MOST, points[before], begin, points[n]):
                return LIMITS
            if is_too_fast(points, n + side, MOST, fastest):
                return LIMITS
    release_joints(scene, line)
    if finish_spline(scene, approach.motion, curve, offset, MOST) > OFF_LINE:
        return LIMITS
    if spline_is_free(scene, approach.motion, curve):
        return DONE
    if approach.contact[0] == NO_CONTACT:
        approach.contact[0] = pair_contact_code(problem, scene, curve.blocked[1])
    return BLOCKED


@inner
def _release(scene: MotionScene, line: StraightWorkspace, resting: int) -> None:
    """Let all joints move but one, or but NONE."""
    release_joints(scene, line)
    if resting != NONE:
        line.locked[resting] = 1


@inner
def lead_through_windows(
    problem: Problem, approach: Approach, fastest: FloatArray, b: int, level: int
) -> bool:
    """Follow lines through all windows of a level of a branch, and through their ends.

    Returns:
        Whether one is free; `search.best` is filled then, with the posture at the goal.
    """
    low, high = _next_window(approach, b, level, approach.grid.spans[b, level, 0])
    while low != NOWHERE:
        if _lead_through_window(problem, approach, fastest, b, level, low, high):
            return True
        # What is free of contact may be next to a limit alone, closer than the columns are.
        for side in range(2):
            angle = end_of_window(problem, approach, b, level, high if side else low, side == 1)
            if _lead_through(problem, approach, fastest, b, angle, level):
                return True
        low, high = _next_window(approach, b, level, high + 1)
    return False


@inner
def lead_through_narrow(
    problem: Problem, approach: Approach, fastest: FloatArray, b: int, level: int
) -> bool:
    """Do as `lead_through_windows` for windows of at most NARROW columns, without their ends."""
    low, high = _next_window(approach, b, level, approach.grid.spans[b, level, 0])
    while low != NOWHERE:
        if high - low < NARROW and _lead_through_window(
            problem, approach, fastest, b, level, low, high
        ):
            return True
        low, high = _next_window(approach, b, level, high + 1)
    return False


@inner
def _lead_through_window(
    problem: Problem,
    approach: Approach,
    fastest: FloatArray,
    b: int,
    level: int,
    low: int,
    high: int,
) -> bool:
    """Do as `lead_through_windows` for one window, from column `low` to column `high`."""
    grid, width = approach.grid, high + 1 - low
    count = (width + APART - 1) // APART
    for n in range(count):
        column = low + (2 * n + 1) * width // (2 * count)
        angle = grid.origin[0] + column * grid.origin[1]
        if _lead_through(problem, approach, fastest, b, angle, level):
            return True
    return False


@inner
def _lead_through(
    problem: Problem, approach: Approach, fastest: FloatArray, b: int, angle: float, level: int
) -> bool:
    """Follow the line through a posture at a level of the grid; return whether it is free.

    Args:
        problem: The scene.
        approach: The grid is in place; `search.best` is filled, with the posture at the goal.
        fastest: As for `approach_pair`.
        b: The branch.
        angle: Its free joint [rad].
        level: Its level.
    """
    arm, grid, search = problem.arm, approach.grid, approach.search
    place_sample(
        arm, grid.goal[level], arm.branches[b], angle, search.q, approach.motion.posture.turns
    )
    if lead_from(problem, approach, fastest, level * PER_LEVEL, search.q) != DONE:
        return False
    for k in range(7):
        search.best[k] = within(approach.curve.points[0, k], arm.lower[k], arm.upper[k])
    # It counts only if the posture at the goal, as it is stored, leads along that line again.
    rounded_inward(search.best, arm.lower, arm.upper, search.q)
    return lead_from(problem, approach, fastest, AT_GOAL, search.q) == DONE


@inner
def narrowest_level(approach: Approach, b: int) -> int:
    """Return the level with the fewest open nodes of a branch: all lines lead through it.

    Nodes at the goal are closed where lines have been followed.
    """
    grid, level, fewest = approach.grid, NOWHERE, 0
    for n in range(min(1, grid.deepest[b]), grid.deepest[b] + 1):
        count = 0
        for i in range(grid.spans[b, n, 0], grid.spans[b, n, 1] + 1):
            count += grid.is_open[b, n, i]
        if level == NOWHERE or count <= fewest:
            level, fewest = n, count
    return level


@inner
def _next_window(approach: Approach, b: int, level: int, column: int) -> tuple[int, int]:
    """Return the first and the last column of the next open window, NOWHERE without one."""
    is_open, last = approach.grid.is_open[b, level], approach.grid.spans[b, level, 1]
    first = column
    while first <= last and not is_open[first]:
        first += 1
    if first > last:
        return NOWHERE, NOWHERE
    end = first
    while end < last and is_open[end + 1]:
        end += 1
    return first, end


@inner
def _are_kept(fastest: FloatArray, rates: FloatArray) -> bool:
    """Return whether no joint exceeds its greatest rate."""
    for k in range(7):
        if abs(rates[k]) > fastest[k]:
            return False
    return True


@inner
def _slow_down(line: StraightWorkspace, fastest: FloatArray, rates: FloatArray) -> bool:
    """Let the joint that is the most too fast move at its limit; return whether all keep theirs.

    A redundant arm has a motion that leaves the tool where it is. As much of it is added as that
    joint needs.

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
    return _are_kept(fastest, rates)

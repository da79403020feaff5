"""The best approachable posture of one reached pair, for an arm with a closed form."""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.ik import sample_joints
from tcs.kernel.analytic.scratch import best_of, fill_samples, solve
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.approach.candidates import follow_candidates, measure_at_goal
from tcs.kernel.approach.curve import place_line
from tcs.kernel.approach.follow import CLOSED, follow
from tcs.kernel.approach.grid import (
    NOWHERE,
    PIECES,
    TWO,
    LineGrid,
    place_columns,
    place_fine_columns,
    place_levels,
)
from tcs.kernel.approach.lines import (
    AT_GOAL,
    NARROW,
    lead_from,
    lead_through_narrow,
    lead_through_windows,
    narrowest_level,
)
from tcs.kernel.approach.memory import ENOUGH, Approach
from tcs.kernel.approach.opening import make_whole, open_begin, open_branch, open_goal
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.dexterity.measures import rounded_inward
from tcs.kernel.kinematics import copy_joints
from tcs.kernel.motion.straight import BLOCKED, DONE, LIMITS
from tcs.kernel.problem import Problem
from tcs.kernel.scores import APPROACH_BLOCKED, APPROACH_LIMITS, REACHED

PATH_SPEED = 0.8
"""Fraction of the velocity limit up to which the free joint moves from level to level: cubics
through the levels are faster in between."""
NEAR = 8
"""Number of columns on either side of the posture that scoring found, whose line is tried first."""
FINE, TIMES = 8, 2
"""Factor by which the columns are closer then, and how often."""
STEEPEST = 40.0
"""Greatest slope of the slack by the free joint, as in `solve_samples`, on either side of a window
that may be hidden between columns: four times what scoring allows for."""
EXPECTED = -2
"""In place of a contact: postures are checked before their line is followed."""
GOAL = int_constant(0)
"""Level of the goal."""
SHIFTS = 4
"""Number of times that the columns are moved by a part of their spacing, until a line is free."""


@inner
def approach_pair(problem: Problem, approach: Approach, fastest: FloatArray, q: FloatArray) -> int:
    """Do as `solvers.approach_pair` for an arm of seven joints with a closed form."""
    _prepare(problem, approach, fastest, q)
    columns = approach.columns
    if _is_approachable(problem, approach, fastest):
        return -1
    for shift in range(SHIFTS):
        if columns[4] == ENOUGH:
            break
        if shift > 0:
            # Between the columns lie windows that are narrower than their spacing.
            arm, step = problem.arm, approach.grid.origin[1]
            angle = q[arm.free] + shift / SHIFTS * step
            if angle > arm.upper[arm.free]:
                angle -= step
            if angle < arm.lower[arm.free]:
                break
            columns[0], columns[4] = place_columns(arm, approach.grid, angle), 0
        if shift == SHIFTS - 1:
            columns[5] = 0
        if _search(problem, approach, fastest):
            return REACHED
        if approach.contact[0] == NO_CONTACT:
            if _search_narrow(problem, approach, fastest):
                return REACHED
            break
    if columns[4] != ENOUGH and _search_lines(problem, approach, fastest, q):
        return REACHED
    return APPROACH_LIMITS if approach.contact[0] == NO_CONTACT else APPROACH_BLOCKED


@inner
def _is_approachable(problem: Problem, approach: Approach, fastest: FloatArray) -> bool:
    """Return whether the posture that scoring found is approachable; fills `known`.

    Most often it is without any motion of the free joint.
    """
    grid, columns = approach.grid, approach.columns
    b, column = columns[3], columns[2]
    approach.known[0] = np.inf
    for n in range(2):
        near = n * NEAR
        first, last = max(column - near, 0), min(column + near, columns[0] - 1)
        is_complete = open_branch(problem, approach, b, first, last)
        if n == 0 and grid.is_open[b, 0, column]:
            approach.known[0] = measure_at_goal(problem, approach, b, column)
        if is_complete and follow(problem, approach, fastest, b, column, True) == DONE:
            return True
        if columns[4] == ENOUGH:
            break
    return False


@inner
def _search(problem: Problem, approach: Approach, fastest: FloatArray) -> bool:
    """Fill `search.best` with the best approachable node; return whether there is one."""
    for b in range(len(problem.arm.branches)):
        open_goal(problem, approach, b, 0, approach.columns[0] - 1)
    return follow_candidates(problem, approach, fastest)


@inner
def _search_narrow(problem: Problem, approach: Approach, fastest: FloatArray) -> bool:
    """Search where no line leads beyond a narrow window, at a finer spacing around that.

    So are lines in the window of the posture that scoring found, if lines that lead on break a
    limit between the levels.

    Returns:
        Whether a node is approachable; the best one on its branch fills `search.best`.
    """
    arm, grid, columns = problem.arm, approach.grid, approach.columns
    first, step, column = grid.origin[0], grid.origin[1], columns[2]
    for b in range(len(arm.branches)):
        make_whole(problem, approach, b)
    for b in range(len(arm.branches)):
        level = grid.deepest[b]
        if level == NOWHERE or (level == PIECES and b != columns[3]):
            continue
        low, high = grid.spans[b, level, 0], grid.spans[b, level, 1]
        if level == PIECES:
            # Lines lead on in other windows, which no motion reaches.
            low = high = column
        elif high - low >= NARROW:
            continue
        if level < PIECES and not _may_hide(grid.slack[b], step):
            continue
        angle = first + 0.5 * (low + high) * step
        if _follow_narrow(problem, approach, fastest, b, level, angle, step):
            return True
    return False


@inner
def _follow_narrow(
    problem: Problem,
    approach: Approach,
    fastest: FloatArray,
    b: int,
    level: int,
    angle: float,
    spacing: float,
) -> bool:
    """Search a branch around an angle of its last open level, at finer and finer spacings.

    Args:
        problem: The scene.
        approach: As for `approach_pair`; `search.best` is filled if a node is approachable.
        fastest: As for `approach_pair`.
        b: The branch.
        level: Its last open level.
        angle: Middle of the window there [rad].
        spacing: Usual spacing of the columns [rad].

    Returns:
        Whether a node is approachable.
    """
    arm, grid, columns = problem.arm, approach.grid, approach.columns
    for _ in range(TIMES):
        spacing /= FINE
        _place_fine(arm, approach, fastest, angle, spacing)
        low = high = NOWHERE
        if level < PIECES:
            slack = _greatest_slack(arm, approach, b, level + 1)
            if not _may_hide(slack, spacing):
                return False
            if slack < 0.0:
                low, high = _window(arm, approach, b, level)
        if low == NOWHERE:
            for other in range(len(arm.branches)):
                for i in range(columns[0]):
                    grid.onward[other, 0, i] = NOWHERE
            if open_branch(problem, approach, b, 0, columns[0] - 1):
                if follow_candidates(problem, approach, fastest):
                    if _is_found_again(problem, approach, fastest):
                        return True
                    _place_fine(arm, approach, fastest, angle, spacing)
                break
            level = grid.deepest[b]
            if level == NOWHERE:
                break
            low, high = grid.spans[b, level, 0], grid.spans[b, level, 1]
        angle = grid.origin[0] + 0.5 * (low + high) * spacing
    open_branch(problem, approach, b, 0, columns[0] - 1)
    return grid.deepest[b] != NOWHERE and lead_through_windows(
        problem, approach, fastest, b, narrowest_level(approach, b)
    )


@inner
def _may_hide(slack: float, spacing: float) -> bool:
    """Return whether a window may be hidden between columns of a greatest slack."""
    return slack > -STEEPEST * spacing


@inner
def _search_lines(problem: Problem, approach: Approach, fastest: FloatArray, q: FloatArray) -> bool:
    """Follow lines of the shortest joint motion where limits or contacts leave a doubt.

    They are those through the posture that scoring found, through nodes of the narrowest level of
    each branch and of narrow windows at the goal, and through nodes at the begin: most of what is
    open there may lead into a window at the goal that is narrower than the spacing of the columns,
    or into another branch.

    Args:
        problem: The scene.
        approach: As for `approach_pair`; `search.best` is filled if a line is free.
        fastest: As for `approach_pair`.
        q: As for `approach_pair`.

    Returns:
        Whether a line is free.
    """
    arm, grid, columns, search = problem.arm, approach.grid, approach.columns, approach.search
    if lead_from(problem, approach, fastest, AT_GOAL, q) == DONE:
        copy_joints(q, search.best)
        return True
    if grid.is_fine[0] or approach.contact[0] != NO_CONTACT:
        columns[0] = place_columns(arm, grid, q[arm.free])
        columns[1] = _most_columns(arm, grid, fastest)
        for b in range(len(arm.branches)):
            open_branch(problem, approach, b, 0, columns[0] - 1)
    in_doubt = False
    for b in range(len(arm.branches)):
        level = grid.deepest[b]
        if level == NOWHERE or (level < PIECES and not _may_hide(grid.slack[b], grid.origin[1])):
            continue
        in_doubt = True
        level = narrowest_level(approach, b)
        # All that is open at the begin follows below.
        if level < PIECES and lead_through_windows(problem, approach, fastest, b, level):
            return True
        open_goal(problem, approach, b, 0, columns[0] - 1)
        if lead_through_narrow(problem, approach, fastest, b, GOAL):
            return True
    for b in range(len(arm.branches) if in_doubt else 0):
        if open_begin(problem, approach, b) and lead_through_windows(
            problem, approach, fastest, b, PIECES
        ):
            return True
    return False


@inner
def _is_found_again(problem: Problem, approach: Approach, fastest: FloatArray) -> bool:
    """Return whether the line of the posture in `search.best` is found again from that as stored.

    The grid is another one afterwards.
    """
    arm, search = problem.arm, approach.search
    rounded_inward(search.best, arm.lower, arm.upper, search.trial)
    return follow_posture(problem, approach, fastest, search.trial) == DONE


@inner
def _greatest_slack(arm: ArmSolver, approach: Approach, b: int, level: int) -> float:
    """Return the greatest slack of the columns at a level; fills those of `search`."""
    search, grid, count = approach.search, approach.grid, approach.columns[0]
    first, spacing = grid.origin[0], grid.origin[1]
    fill_samples(search, first, first + max(count - 1, 1) * spacing, max(count, TWO))
    for r in range(4):
        for c in range(3):
            search.goal[r, c] = grid.goal[level, r, c]
    solve(arm, search, b, count)
    return float(search.samples.slack[best_of(search.samples.slack, count)])


@inner
def _window(arm: ArmSolver, approach: Approach, b: int, level: int) -> tuple[int, int]:
    """Return the first and the last column that is open at a level, NOWHERE without one."""
    low = high = NOWHERE
    if _greatest_slack(arm, approach, b, level) >= 0.0:
        for i in range(approach.columns[0]):
            if approach.search.samples.slack[i] >= 0.0:
                low, high = i if low == NOWHERE else low, i
    return low, high


@inner
def _place_fine(
    arm: ArmSolver, approach: Approach, fastest: FloatArray, through: float, spacing: float
) -> None:
    """Place columns at a fine spacing around an angle of the free joint [rad]."""
    columns, grid = approach.columns, approach.grid
    columns[0], columns[4] = place_fine_columns(arm, grid, through, spacing), 0
    columns[1] = _most_columns(arm, grid, fastest)
    columns[2] = int((through - grid.origin[0]) / grid.origin[1] + 0.5)


@inner
def _most_columns(arm: ArmSolver, grid: LineGrid, fastest: FloatArray) -> int:
    """Return the number of columns that the free joint may move from level to level."""
    return int(PATH_SPEED * fastest[arm.free] / (PIECES * grid.origin[1]))


@inner
def follow_posture(problem: Problem, approach: Approach, fastest: FloatArray, q: FloatArray) -> int:
    """Do as `solvers.follow_posture` for an arm of seven joints with a closed form."""
    _prepare(problem, approach, fastest, q)
    b, columns, grid, arm = approach.columns[3], approach.columns, approach.grid, problem.arm
    columns[5] = 0
    angle, spacing, outcome = q[arm.free], grid.origin[1], CLOSED
    centre = angle
    for n in range(TIMES + 1):
        if n > 0:
            # One of the columns is that of the posture, as where it was found.
            spacing /= FINE
            steps = int(np.floor((centre - angle) / spacing + 0.5))
            _place_fine(arm, approach, fastest, angle + steps * spacing, spacing)
            columns[2] -= steps
            if not 0 <= columns[2] < columns[0]:
                break
        centre, level = angle, PIECES
        if open_branch(problem, approach, b, 0, columns[0] - 1):
            outcome = follow(problem, approach, fastest, b, columns[2], True)
            if outcome == LIMITS:
                # Limits may end the shortest path alone, which a contact had led around.
                approach.contact[0] = EXPECTED
                open_branch(problem, approach, b, 0, columns[0] - 1)
                if follow(problem, approach, fastest, b, columns[2], True) == DONE:
                    outcome = DONE
                approach.contact[0] = NO_CONTACT
        else:
            level = grid.deepest[b]
        if outcome == DONE or outcome == BLOCKED or level == NOWHERE:
            break
        if level < PIECES:
            middle = 0.5 * (grid.spans[b, level, 0] + grid.spans[b, level, 1])
            centre = grid.origin[0] + middle * grid.origin[1]
    if outcome != DONE:
        outcome = lead_from(problem, approach, fastest, AT_GOAL, q)
    return outcome


@inner
def _prepare(problem: Problem, approach: Approach, fastest: FloatArray, q: FloatArray) -> None:
    """Place line and grid, and find column and branch of the posture that scoring found."""
    arm, grid, search, columns = problem.arm, approach.grid, approach.search, approach.columns
    place_levels(arm, approach.work, approach.offset, grid)
    place_line(approach.scene, approach.work, approach.curve)
    angle = q[arm.free]
    columns[0] = place_columns(arm, grid, angle)
    columns[1] = _most_columns(arm, grid, fastest)
    columns[2] = int((angle - grid.origin[0]) / grid.origin[1] + 0.5)
    columns[3], columns[4], columns[5], columns[6] = 0, 0, 1, 0
    approach.contact[0] = NO_CONTACT
    least = np.inf
    for b in range(len(arm.branches)):
        sample_joints(arm, grid.goal[0], arm.branches[b], angle, search.q)
        error = 0.0
        for k in range(7):
            error += 1.0 - np.cos(search.q[k] - q[k])
        if error < least:
            least, columns[3] = error, b

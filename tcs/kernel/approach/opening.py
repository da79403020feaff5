"""Finding the open nodes of a branch: those of the goal first, others where lines lead there.

Most lines that are followed can be completed with the free joint at rest, which takes a single
sample at each level.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.samples import measure_samples
from tcs.kernel.analytic.scratch import Search, best_of, fill_samples, solve
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.approach.grid import NOWHERE, PIECES, TWO, UNSEEN, LineGrid, find_onward
from tcs.kernel.approach.memory import Approach
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.problem import Problem

HALVINGS = 5
"""Number of times that the distance of two columns is halved to find the end of a window."""
GOAL, ONE, BEGIN = int_constant(0), int_constant(1), int_constant(PIECES)


@inner
def open_branch(problem: Problem, approach: Approach, b: int, first: int, last: int) -> bool:
    """Fill the nodes of a branch from columns at the goal; return whether the line is complete.

    Args:
        problem: The scene.
        approach: The levels and columns are in place.
        b: The branch.
        first: First column at the goal.
        last: Last column at the goal: if they are not all, no others are looked at.
    """
    open_goal(problem, approach, b, first, last)
    return _complete(problem, approach, b, first, last)


@inner
def open_goal(problem: Problem, approach: Approach, b: int, first: int, last: int) -> None:
    """Fill the nodes of a branch at the goal, in columns `first` to `last`."""
    grid, columns = approach.grid, approach.columns[0]
    is_open, onward = grid.is_open[b, 0], grid.onward[b, 0]
    grid.deepest[b], grid.is_whole[b] = NOWHERE, False
    _open_level(problem.arm, approach.search, grid, b, columns, GOAL, first, last)
    for i in range(columns):
        onward[i] = UNSEEN if is_open[i] else NOWHERE


@inner
def open_begin(problem: Problem, approach: Approach, b: int) -> bool:
    """Fill the nodes of a branch at the begin of the line; return whether any is open."""
    grid, columns = approach.grid, approach.columns[0]
    return _open_level(problem.arm, approach.search, grid, b, columns, BEGIN, 0, columns - 1)


@inner
def lead_on(problem: Problem, approach: Approach, b: int, column: int) -> bool:
    """Find out where the line leads from a node at the goal; return whether it is complete."""
    grid = approach.grid
    if grid.onward[b, 0, column] == UNSEEN and not _keep_straight(problem, approach, b, column):
        make_whole(problem, approach, b)
    return bool(grid.onward[b, 0, column] != NOWHERE)


@inner
def make_whole(problem: Problem, approach: Approach, b: int) -> None:
    """Fill the levels of a branch beyond the goal, unless they are filled."""
    if not approach.grid.is_whole[b]:
        _complete(problem, approach, b, 0, approach.columns[0] - 1)


@inner
def end_of_window(
    problem: Problem, approach: Approach, b: int, level: int, column: int, is_high: bool
) -> float:
    """Return the free joint [rad] where limits end a window, less than a column beyond its last.

    Args:
        problem: The scene.
        approach: The levels and columns are in place.
        b: The branch.
        level: Level of the window.
        column: Its first or last column.
        is_high: Whether that is the last one.
    """
    arm, grid = problem.arm, approach.grid
    inside = grid.origin[0] + column * grid.origin[1]
    outside = inside + (grid.origin[1] if is_high else -grid.origin[1])
    outside = min(max(outside, arm.lower[arm.free]), arm.upper[arm.free])
    if _is_open_at(problem, approach, b, level, outside):
        return outside
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        if _is_open_at(problem, approach, b, level, middle):
            inside = middle
        else:
            outside = middle
    return inside


@inner
def _is_open_at(problem: Problem, approach: Approach, b: int, level: int, angle: float) -> bool:
    """Return whether a level is open at an angle of the free joint within its limits [rad]."""
    search = approach.search
    samples = search.samples
    samples.cosine[0], samples.sine[0] = np.cos(angle), np.sin(angle)
    _take_goal(search, approach.grid, level)
    solve(problem.arm, search, b, ONE)
    return bool(samples.slack[0] >= 0.0)


@inner
def _keep_straight(problem: Problem, approach: Approach, b: int, column: int) -> bool:
    """Return whether the line from a node can be completed without the free joint; fills it."""
    grid, search = approach.grid, approach.search
    samples = search.samples
    angle = grid.origin[0] + column * grid.origin[1]
    samples.cosine[0], samples.sine[0] = np.cos(angle), np.sin(angle)
    for level in range(1, PIECES + 1):
        _take_goal(search, grid, level)
        solve(problem.arm, search, b, ONE)
        if samples.slack[0] < 0.0:
            return False
    for level in range(PIECES + 1):
        grid.onward[b, level, column] = column
        if level > 0:
            grid.is_open[b, level, column], grid.is_free[b, level, column] = True, False
    return True


@inner
def _complete(problem: Problem, approach: Approach, b: int, first: int, last: int) -> bool:
    """Fill the levels of a branch beyond the goal, see `open_branch`."""
    grid, columns, most = approach.grid, approach.columns[0], approach.columns[1]
    grid.is_whole[b] = True
    is_narrow = last - first + 1 < columns
    is_complete = grid.deepest[b] != NOWHERE
    for level in range(1, PIECES + 1):
        if not is_complete:
            break
        if not is_narrow:
            low, high = grid.spans[b, level - 1, 0], grid.spans[b, level - 1, 1]
            first, last = max(low - most, 0), min(high + most, columns - 1)
        is_complete = _open_level(
            problem.arm, approach.search, grid, b, columns, level, first, last
        )
    if is_complete:
        find_onward(grid, b, columns, most)
        return True
    for i in range(columns):
        grid.onward[b, 0, i] = NOWHERE
    return False


@inner
def _open_level(
    arm: ArmSolver,
    search: Search,
    grid: LineGrid,
    b: int,
    columns: int,
    level: int,
    first: int,
    last: int,
) -> bool:
    """Find the open nodes of a branch at one level.

    Args:
        arm: The arm.
        search: Scratch.
        grid: `is_open`, `spans`, `deepest` and `slack` are filled, and `measure` at the goal.
        b: The branch.
        columns: Number of columns.
        level: The level.
        first: First column to look at.
        last: Last column to look at.

    Returns:
        Whether there are any.
    """
    is_open, is_free, slack = grid.is_open[b, level], grid.is_free[b, level], search.samples.slack
    count = last - first + 1
    start = grid.origin[0] + first * grid.origin[1]
    fill_samples(search, start, start + max(count - 1, 1) * grid.origin[1], max(count, TWO))
    _take_goal(search, grid, level)
    solve(arm, search, b, count)
    for i in range(columns):
        is_open[i] = is_free[i] = False
    low, high = 0, count - 1
    while low < count and slack[low] < 0.0:
        low += 1
    if low == count:
        grid.slack[b] = slack[best_of(slack, count)]
        return False
    while slack[high] < 0.0:
        high -= 1
    for i in range(low, high + 1):
        is_open[first + i] = slack[i] >= 0.0
    if level == 0:
        # The rows of all samples begin at the same distance from those of the first.
        measure_samples(
            arm,
            search.samples.rows[low:],
            slack[low:],
            high + 1 - low,
            grid.measure[b, first + low :],
        )
    grid.deepest[b] = level
    grid.spans[b, level, 0], grid.spans[b, level, 1] = first + low, first + high
    return True


@inner
def _take_goal(search: Search, grid: LineGrid, level: int) -> None:
    """Make the pose of a level the goal of the search."""
    for r in range(4):
        for c in range(3):
            search.goal[r, c] = grid.goal[level, r, c]

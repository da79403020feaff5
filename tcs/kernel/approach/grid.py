"""Limits along the approach: a grid over the line and the free joint, on each branch.

Level 0 is the goal, the last level the begin of the approach. A node is open where the closed form
has a solution within the joint limits and no contact is known. The free joint may move from level
to level by no more than its velocity limit allows.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.analytic.ik import wrist_goal
from tcs.kernel.analytic.samples import MAX_SAMPLES
from tcs.kernel.analytic.scratch import Search, fill_samples, measure_feasible, solve
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.contacts import Workspace

PIECES = 4
"""Number of pieces of the line between levels."""
STEP = 0.0125
"""Spacing of the free joint [rad], as in the search over it."""
OVERLAP = 0.3
"""Distance by which the angles of a free joint without limits go beyond a full turn [rad]."""
BRANCHES = 8
NOWHERE = -1
TWO = int_constant(2)


class LineGrid(NamedTuple):
    """Nodes of the search of one pair, reused from pair to pair."""

    goal: FloatArray
    """The tool's poses at each level as from `wrist_goal`, shape (PIECES + 1, 4, 3)."""
    p_AT: FloatArray
    """Scratch: position of the tool in A [m], shape (3,)."""
    is_open: BoolArray
    """Whether each node is open, shape (BRANCHES, PIECES + 1, MAX_SAMPLES)."""
    is_free: BoolArray
    """Whether each node is known to be free of contact, shape as `is_open`."""
    onward: IntArray
    """Column of the nearest node of the next level from which the line can be completed, or
    NOWHERE, shape (BRANCHES, PIECES + 1, MAX_SAMPLES)."""
    nearest: IntArray
    """Scratch, shape (MAX_SAMPLES,)."""
    measure: FloatArray
    """Measure of the nodes at the goal, shape (BRANCHES, MAX_SAMPLES)."""
    origin: FloatArray
    """Free joint at column 0, and spacing [rad], shape (2,)."""
    path: FloatArray
    """Free joint at each level of the current path [rad], shape (PIECES + 1,)."""


def new_grid() -> LineGrid:
    """Return memory for one worker."""
    return LineGrid(
        np.empty((PIECES + 1, 4, 3)),
        np.empty(3),
        np.zeros((BRANCHES, PIECES + 1, MAX_SAMPLES), np.bool_),
        np.zeros((BRANCHES, PIECES + 1, MAX_SAMPLES), np.bool_),
        np.zeros((BRANCHES, PIECES + 1, MAX_SAMPLES), np.int64),
        np.zeros(MAX_SAMPLES, np.int64),
        np.zeros((BRANCHES, MAX_SAMPLES)),
        np.empty(2),
        np.empty(PIECES + 1),
    )


@inner
def place_levels(arm: ArmSolver, work: Workspace, offset: FloatArray, grid: LineGrid) -> None:
    """Fill the tool's poses at each level.

    Args:
        arm: The arm.
        work: Workspace with the goal in A.
        offset: Motion of the tool from the goal to the begin of the approach, in A [m], shape (3,).
        grid: `goal` is filled.
    """
    for level in range(PIECES + 1):
        for r in range(3):
            grid.p_AT[r] = work.p_AG[r] + level / PIECES * offset[r]
        wrist_goal(arm, work.R_AG, grid.p_AT, grid.goal[level])


@inner
def place_columns(arm: ArmSolver, grid: LineGrid, through: float) -> int:
    """Choose the angles of the free joint, one of them `through` [rad]; return their number."""
    low, high = arm.lower[arm.free], arm.upper[arm.free]
    if not high - low < 2.0 * np.pi:
        low, high = through - np.pi - OVERLAP, through + np.pi + OVERLAP
    step = max(STEP, (high - low) / (MAX_SAMPLES - 2))
    before = int((through - low) / step)
    grid.origin[0], grid.origin[1] = through - before * step, step
    return before + 1 + int((high - through) / step)


@inner
def open_levels(
    arm: ArmSolver,
    search: Search,
    grid: LineGrid,
    b: int,
    columns: int,
    most: int,
    first: int,
    last: int,
) -> bool:
    """Find the open nodes of one branch that can be reached from the goal.

    Args:
        arm: The arm.
        search: Scratch.
        grid: `is_open` is filled, and `measure` at the goal.
        b: The branch.
        columns: Number of columns.
        most: Greatest number of columns that the free joint moves from level to level.
        first: First column at the goal.
        last: Last column at the goal.

    Returns:
        Whether any node of the last level can be reached.
    """
    narrow = last - first + 1 < columns
    for level in range(PIECES + 1):
        is_open, is_free = grid.is_open[b, level], grid.is_free[b, level]
        for i in range(columns):
            is_open[i] = is_free[i] = False
        count = last - first + 1
        start = grid.origin[0] + first * grid.origin[1]
        fill_samples(search, start, start + max(count - 1, 1) * grid.origin[1], max(count, TWO))
        for r in range(4):
            for c in range(3):
                search.goal[r, c] = grid.goal[level, r, c]
        solve(arm, search, b, count)
        if level == 0:
            measure_feasible(arm, search, count)
        low, high = columns, NOWHERE
        for i in range(count):
            if search.slack[i] >= 0.0:
                is_open[first + i] = True
                low, high = min(low, first + i), first + i
                if level == 0:
                    grid.measure[b, first + i] = search.measure[i]
        if high == NOWHERE:
            return False
        if not narrow:
            first, last = max(low - most, 0), min(high + most, columns - 1)
    return True


@inner
def find_onward(grid: LineGrid, b: int, columns: int, most: int) -> None:
    """Fill `onward` of one branch from the open nodes."""
    for i in range(columns):
        grid.onward[b, PIECES, i] = i if grid.is_open[b, PIECES, i] else NOWHERE
    nearest = grid.nearest
    for back in range(PIECES):
        level = PIECES - 1 - back
        ahead, onward, is_open = (
            grid.onward[b, level + 1],
            grid.onward[b, level],
            grid.is_open[b, level],
        )
        seen = -columns
        for i in range(columns):
            if ahead[i] != NOWHERE:
                seen = i
            nearest[i] = seen
        seen = 3 * columns
        for n in range(columns):
            i = columns - 1 - n
            if ahead[i] != NOWHERE:
                seen = i
            j = nearest[i] if i - nearest[i] <= seen - i else seen
            onward[i] = j if is_open[i] and abs(j - i) <= most else NOWHERE


@inner
def take_path(grid: LineGrid, b: int, column: int) -> None:
    """Fill `path` with the angles of the free joint from a column at the goal on."""
    for level in range(PIECES + 1):
        grid.path[level] = grid.origin[0] + column * grid.origin[1]
        column = grid.onward[b, level, column]


@inner
def column_at(grid: LineGrid, b: int, column: int, level: int) -> int:
    """Return the column of the path from a column at the goal, at a level."""
    for k in range(level):
        column = grid.onward[b, k, column]
    return column

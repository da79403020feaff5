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
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.workspace import Workspace

PIECES = 4
"""Number of pieces of the line between levels."""
STEP = 0.0125
"""Spacing of the free joint [rad], as in the search over it."""
OVERLAP = 0.3
"""Distance by which the angles of a free joint without limits go beyond a full turn [rad]."""
BRANCHES = 8
NOWHERE = -1
UNSEEN = -2
"""In place of a column: where the line leads has not been looked at."""
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
    """Column of the nearest node of the next level from which the line can be completed, NOWHERE,
    or at the goal UNSEEN, shape (BRANCHES, PIECES + 1, MAX_SAMPLES)."""
    is_whole: BoolArray
    """Whether all levels of each branch are filled; else that of the goal is, and the columns of
    lines along which the free joint rests, shape (BRANCHES,)."""
    nearest: IntArray
    """Scratch, shape (MAX_SAMPLES,)."""
    spans: IntArray
    """First and last column in which nodes may be open, shape (BRANCHES, PIECES + 1, 2)."""
    deepest: IntArray
    """Last level with open nodes of each branch, or NOWHERE, shape (BRANCHES,)."""
    slack: FloatArray
    """Greatest slack at the level after that, shape (BRANCHES,)."""
    measure: FloatArray
    """Measure of the nodes at the goal, shape (BRANCHES, MAX_SAMPLES)."""
    origin: FloatArray
    """Free joint at column 0, and spacing [rad], shape (2,)."""
    path: FloatArray
    """Free joint at each level of the current path [rad], shape (PIECES + 1,)."""
    is_fine: BoolArray
    """Whether the columns are closer than usual, shape (1,)."""
    is_bent: BoolArray
    """Whether the free joint has the rate of a parabola at both ends of the path, shape (1,)."""


def new_grid() -> LineGrid:
    """Return memory for one worker."""
    return LineGrid(
        np.empty((PIECES + 1, 4, 3)),
        np.empty(3),
        np.zeros((BRANCHES, PIECES + 1, MAX_SAMPLES), np.bool_),
        np.zeros((BRANCHES, PIECES + 1, MAX_SAMPLES), np.bool_),
        np.zeros((BRANCHES, PIECES + 1, MAX_SAMPLES), np.int64),
        np.zeros(BRANCHES, np.bool_),
        np.zeros(MAX_SAMPLES, np.int64),
        np.zeros((BRANCHES, PIECES + 1, 2), np.int64),
        np.zeros(BRANCHES, np.int64),
        np.zeros(BRANCHES),
        np.zeros((BRANCHES, MAX_SAMPLES)),
        np.empty(2),
        np.empty(PIECES + 1),
        np.zeros(1, np.bool_),
        np.zeros(1, np.bool_),
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
    grid.is_fine[0] = False
    return before + 1 + int((high - through) / step)


@inner
def place_fine_columns(arm: ArmSolver, grid: LineGrid, through: float, step: float) -> int:
    """Choose angles of the free joint at a finer spacing around one of them, `through`.

    Args:
        arm: The arm.
        grid: `origin` is filled.
        through: An angle within the limits [rad].
        step: Spacing of the others [rad].

    Returns:
        Their number.
    """
    most = (MAX_SAMPLES - 2) // 2
    before = min(most, int((through - arm.lower[arm.free]) / step)) if is_limited(arm) else most
    after = min(most, int((arm.upper[arm.free] - through) / step)) if is_limited(arm) else most
    grid.origin[0], grid.origin[1] = through - before * step, step
    grid.is_fine[0] = True
    return before + 1 + after


@inner
def is_limited(arm: ArmSolver) -> bool:
    """Return whether the free joint has limits."""
    return bool(arm.upper[arm.free] - arm.lower[arm.free] < np.inf)


@inner
def find_onward(grid: LineGrid, b: int, columns: int, most: int) -> None:
    """Fill `onward` of one branch from the open nodes, which are in the columns of `spans`."""
    nearest, spans = grid.nearest, grid.spans[b]
    for level in range(PIECES + 1):
        onward = grid.onward[b, level]
        for i in range(columns):
            onward[i] = NOWHERE
    for i in range(spans[PIECES, 0], spans[PIECES, 1] + 1):
        if grid.is_open[b, PIECES, i]:
            grid.onward[b, PIECES, i] = i
    for back in range(PIECES):
        level = PIECES - 1 - back
        ahead, onward, is_open = (
            grid.onward[b, level + 1],
            grid.onward[b, level],
            grid.is_open[b, level],
        )
        low, high = spans[level, 0], spans[level, 1]
        first, last = max(low - most, 0), min(high + most, columns - 1)
        seen = -columns
        for i in range(first, high + 1):
            if ahead[i] != NOWHERE:
                seen = i
            nearest[i] = seen
        seen = 3 * columns
        for n in range(last - low + 1):
            i = last - n
            if ahead[i] != NOWHERE:
                seen = i
            if i <= high and is_open[i]:
                j = nearest[i] if i - nearest[i] <= seen - i else seen
                onward[i] = j if abs(j - i) <= most else NOWHERE


@inner
def close_node(grid: LineGrid, b: int, level: int, column: int, columns: int, most: int) -> None:
    """Close a node, and find other nodes onward from those whose lines lead through it.

    Args:
        grid: `onward` is changed as `find_onward` would fill it.
        b: The branch.
        level: Level of the node.
        column: Its column.
        columns: Number of columns.
        most: Greatest number of columns that the free joint moves from level to level.
    """
    grid.is_open[b, level, column] = False
    grid.onward[b, level, column] = NOWHERE
    first = last = column
    while level > 0 and first <= last:
        level -= 1
        ahead, onward = grid.onward[b, level + 1], grid.onward[b, level]
        low, high = max(first - most, 0), min(last + most, columns - 1)
        first, last = columns, NOWHERE
        for i in range(low, high + 1):
            if onward[i] == NOWHERE or ahead[onward[i]] != NOWHERE:
                continue
            onward[i] = _nearest_to(ahead, i, columns, most)
            if onward[i] == NOWHERE:
                first, last = min(first, i), i


@inner
def _nearest_to(ahead: IntArray, i: int, columns: int, most: int) -> int:
    """Return the nearest column to i that leads on, the lower one of two, or NOWHERE."""
    for away in range(most + 1):
        if i >= away and ahead[i - away] != NOWHERE:
            return i - away
        if i + away < columns and ahead[i + away] != NOWHERE:
            return i + away
    return NOWHERE


@inner
def take_path(grid: LineGrid, b: int, column: int) -> None:
    """Fill `path` with the angles of the free joint from a column at the goal on."""
    grid.is_bent[0] = False
    for level in range(PIECES + 1):
        grid.path[level] = grid.origin[0] + column * grid.origin[1]
        column = grid.onward[b, level, column]


@inner
def column_at(grid: LineGrid, b: int, column: int, level: int) -> int:
    """Return the column of the path from a column at the goal, at a level."""
    for k in range(level):
        column = grid.onward[b, k, column]
    return column

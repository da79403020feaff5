"""Postures at the goal in the order in which their lines are followed."""

from __future__ import annotations

from tcs.kernel.analytic.score_pair import measure_of, samples_hold_measure
from tcs.kernel.analytic.scratch import sort_candidates
from tcs.kernel.approach.curve import path_touches
from tcs.kernel.approach.follow import close_goal, contact_at, follow
from tcs.kernel.approach.grid import NOWHERE, take_path
from tcs.kernel.approach.memory import MOST_CURVES, Approach
from tcs.kernel.approach.opening import lead_on
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.kinematics import copy_joints
from tcs.kernel.motion.scene import NO_PAIR
from tcs.kernel.motion.straight import DONE
from tcs.kernel.problem import Problem

STRIDE = 8
"""Number of columns from one of the postures tried first to the next."""
PHASE = 1e6
"""Above any measure: sort key of postures that are tried later."""
AT_GOAL = int_constant(0)
"""Level of the goal."""


@inner
def follow_candidates(problem: Problem, approach: Approach, fastest: FloatArray) -> bool:
    """Fill `search.best` with the best approachable open node; return whether there is one."""
    columns, search = approach.columns, approach.search
    candidates = search.candidates
    for rank in range(_list_candidates(problem, approach)):
        n = candidates.order[rank]
        b, i = candidates.branch[n], candidates.pair[n, 0]
        if rank > 0:
            if not _seems_free(problem, approach, b, i):
                close_goal(approach, b, i)
                continue
            if columns[5] == 1 and _climb(problem, approach, fastest, b, i):
                return True
        if follow(problem, approach, fastest, b, i, False) == DONE:
            copy_joints(approach.curve.points[0], search.best)
            if rank > 0 and columns[5] == 0:
                _climb(problem, approach, fastest, b, i)
            return True
        if columns[4] > MOST_CURVES:
            break
    return False


@inner
def _climb(problem: Problem, approach: Approach, fastest: FloatArray, b: int, i: int) -> bool:
    """Climb from a node that seems free to a better one less than STRIDE columns away.

    Only where the climb ends is the line followed; where that one is blocked, the climb begins
    again.

    Returns:
        Whether the line of a better node is free; its joint angles fill `search.best`.
    """
    while approach.columns[4] <= MOST_CURVES:
        j = _better(problem, approach, b, i)
        if j == i:
            break
        if follow(problem, approach, fastest, b, j, False) == DONE:
            copy_joints(approach.curve.points[0], approach.search.best)
            return True
    return False


@inner
def _list_candidates(problem: Problem, approach: Approach) -> int:
    """List the nodes at the goal from which the line can be completed; return their number.

    The best one comes first, then every STRIDE-th, then all others, each in descending order of
    their measure. Last come nodes that are better than the posture that scoring found: had they
    been free, it would have found them.
    """
    grid, search, columns = approach.grid, approach.search, approach.columns
    candidates = search.candidates
    _measure_nodes(problem, approach)
    best, best_branch = NOWHERE, NOWHERE
    while True:
        best_branch, best = _best_node(problem, approach)
        if best == NOWHERE or lead_on(problem, approach, best_branch, best):
            break
    count = 0
    for b in range(len(problem.arm.branches)):
        for i in range(columns[0]):
            if grid.onward[b, 0, i] == NOWHERE or count == len(candidates.key):
                continue
            candidates.branch[count], candidates.pair[count, 0] = b, i
            candidates.key[count] = -grid.measure[b, i]
            if grid.measure[b, i] > approach.known[0]:
                candidates.key[count] += 2.0 * PHASE
            if b == best_branch and i == best:
                candidates.key[count] -= PHASE
            elif i % STRIDE:
                candidates.key[count] += PHASE
            count += 1
    sort_candidates(search, count)
    return count


@inner
def _measure_nodes(problem: Problem, approach: Approach) -> None:
    """Fill the measure of all open nodes at the goal."""
    if samples_hold_measure(problem):
        return
    grid = approach.grid
    for b in range(len(problem.arm.branches)):
        for i in range(approach.columns[0]):
            if grid.onward[b, 0, i] != NOWHERE:
                grid.measure[b, i] = measure_at_goal(problem, approach, b, i)


@inner
def _best_node(problem: Problem, approach: Approach) -> tuple[int, int]:
    """Return branch and column of the best open node at the goal, NOWHERE without one.

    It is no better than the posture that scoring found.
    """
    grid, known = approach.grid, approach.known[0]
    branch = column = NOWHERE
    for b in range(len(problem.arm.branches)):
        measure, onward = grid.measure[b], grid.onward[b, 0]
        for i in range(approach.columns[0]):
            if onward[i] == NOWHERE or measure[i] > known:
                continue
            if column == NOWHERE or measure[i] > grid.measure[branch, column]:
                branch, column = b, i
    return branch, column


@inner
def measure_at_goal(problem: Problem, approach: Approach, b: int, i: int) -> float:
    """Return the measure of an open node at the goal."""
    grid, search = approach.grid, approach.search
    if samples_hold_measure(problem):
        return grid.measure[b, i]
    for r in range(4):
        for c in range(3):
            search.goal[r, c] = grid.goal[0, r, c]
    return measure_of(problem, search, b, grid.origin[0] + i * grid.origin[1])


@inner
def _better(problem: Problem, approach: Approach, b: int, i: int) -> int:
    """Return a better node less than STRIDE columns from node i that seems free, i without one."""
    columns, step, measure = approach.columns, STRIDE // 2, approach.grid.measure[b]
    known = approach.known[0]
    while step >= 1:
        for side in range(2):
            j = i + step if side else i - step
            if not 0 <= j < columns[0] or not measure[i] < measure[j] <= known:
                continue
            if _seems_free(problem, approach, b, j):
                i = j
                break
        step //= 2
    return i


@inner
def _seems_free(problem: Problem, approach: Approach, b: int, column: int) -> bool:
    """Return whether a node at the goal is free of contact, and its line where others are not."""
    grid, columns = approach.grid, approach.columns
    if not lead_on(problem, approach, b, column):
        return False
    take_path(grid, b, column)
    if columns[5] == 1 and path_touches(
        problem.arm, approach.scene, approach.motion, grid, approach.curve, b, approach.offset
    ):
        return False
    if not grid.is_free[b, 0, column]:
        if contact_at(problem, approach, b, column, AT_GOAL) != NO_PAIR:
            return False
        grid.is_free[b, 0, column] = True
    return True

"""Lines looked at one by one lead where those of a branch filled as a whole do."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.approach.grid import NOWHERE, PIECES, column_at, place_columns, place_levels
from tcs.kernel.approach.memory import Approach, new_approach
from tcs.kernel.approach.opening import lead_on, make_whole, open_branch, open_goal
from tcs.kernel.approach.scene import approach_scene
from tcs.kernel.arrays import IntArray
from tcs.kernel.cache import jit
from tcs.kernel.problem import Problem, build_problem
from tests.kernel.arms import drake_arm
from tests.kernel.shapes import rotation
from tests.kernel.toy import toy_scene

MOST = 6


@jit
def end_of(approach: Approach, b: int, column: int) -> int:
    """Return the column in which the line from a column ends, NOWHERE if it is not complete."""
    if approach.grid.onward[b, 0, column] == NOWHERE:
        return NOWHERE
    return column_at(approach.grid, b, column, PIECES)


@jit
def looked_at(problem: Problem, approach: Approach, b: int, order: IntArray, seen: IntArray) -> int:
    """Fill where lines lead from columns looked at in an order, whole last; return their number."""
    place_levels(problem.arm, approach.work, approach.offset, approach.grid)
    columns = approach.columns
    columns[0], columns[1] = place_columns(problem.arm, approach.grid, 0.3), MOST
    open_goal(problem, approach, b, 0, columns[0] - 1)
    for i in order:
        if i < columns[0]:
            lead_on(problem, approach, b, i)
            seen[0, i] = end_of(approach, b, i)
    make_whole(problem, approach, b)
    for i in range(columns[0]):
        seen[1, i] = end_of(approach, b, i)
    open_branch(problem, approach, b, 0, columns[0] - 1)
    for i in range(columns[0]):
        seen[2, i] = end_of(approach, b, i)
    return columns[0]


@pytest.fixture(scope="module")
def problem():
    return build_problem(toy_scene(drake_arm("pr2 left").chain, 3))


@pytest.mark.slow
def test_lines_lead_on_as_where_all_levels_are_filled(problem, rng):
    approach = new_approach(problem, approach_scene(problem))
    complete = straight = ended = 0
    for _ in range(60):
        approach.work.R_AG[:] = rotation(rng)
        approach.work.p_AG[:] = rng.uniform([0.2, -0.4, -0.3], [0.8, 0.6, 0.4])
        approach.offset[:] = rng.normal(scale=0.05, size=3)
        seen = np.full((3, approach.grid.onward.shape[2]), NOWHERE)
        for b in range(len(problem.arm.branches)):
            order = rng.permutation(seen.shape[1])
            count = looked_at(problem, approach, b, order, seen)
            one_by_one, made_whole, whole = seen[:, :count]
            np.testing.assert_array_equal(made_whole, whole)
            np.testing.assert_array_equal(one_by_one, whole)
            leads = whole != NOWHERE
            complete += leads.sum()
            straight += np.sum(whole[leads] == np.flatnonzero(leads))
            ended += np.sum(approach.grid.is_open[b, 0, :count] & ~leads)
    assert min(complete, complete - straight, ended) > 50
    assert PIECES == approach.grid.onward.shape[1] - 1

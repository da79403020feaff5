"""The best approachable posture of one reached pair, for seven joints without a closed form.

Postures are tried along the curves of solutions at the goal, and those that lead to the goal along
the curves at the begin of the line: a joint that arrives at its limit rests there, which is not the
same in both directions.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.approach.curve import MOST
from tcs.kernel.approach.lines import lead_from
from tcs.kernel.approach.listed import follow_posture, leads_from, refusal
from tcs.kernel.approach.memory import ListedApproach
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.motion.straight import DONE
from tcs.kernel.numeric.curves import correct, point_between, slack_of
from tcs.kernel.numeric.score_curves import EXACT
from tcs.kernel.numeric.search import (
    SPACING,
    NumericSolver,
    find_candidates,
    find_curves,
    turn_into_limits,
)
from tcs.kernel.problem import Problem
from tcs.kernel.scores import REACHED

STRIDE = 4
"""Number of candidates from one of those tried first to the next."""
AT_BEGIN = int_constant(MOST)
"""Number of the point of a spline at the begin of the line."""
TRIED = -1.0
"""Measure of a candidate whose line has been followed."""
NOWHERE = -1


@inner
def approach_pair(
    problem: Problem, approach: ListedApproach[NumericSolver], fastest: FloatArray, q: FloatArray
) -> int:
    """Do as `solvers.approach_pair` for an arm of seven joints without a closed form."""
    if follow_posture(problem, approach, fastest, q) == DONE:
        return -1
    if _search(problem, approach, fastest, False) or _search(problem, approach, fastest, True):
        return REACHED
    return refusal(approach)


@inner
def _search(
    problem: Problem, approach: ListedApproach[NumericSolver], fastest: FloatArray, at_begin: bool
) -> bool:
    """Fill `search.best` with the best candidate whose line is free; return whether there is one.

    Every STRIDE-th candidate is tried first, in descending order of its measure at the end of the
    line where it is; then all others. At the goal, the search climbs from the first whose line is
    free to better ones beside it.
    """
    arm, search, work = approach.search.arm, approach.search.search, approach.work
    p_AT = np.empty(3)
    for r in range(3):
        p_AT[r] = work.p_AG[r] + (approach.offset[r] if at_begin else 0.0)
    count = find_curves(arm, work.R_AG, p_AT, search, problem.measure.of)
    found = find_candidates(problem, arm, search, count, SPACING)
    for step in (STRIDE, 1):
        while True:
            top = NOWHERE
            for n in range(0, found, step):
                if search.measure[n] != TRIED and (
                    top == NOWHERE or search.measure[n] > search.measure[top]
                ):
                    top = n
            if top == NOWHERE:
                break
            if _leads(problem, approach, fastest, p_AT, top, at_begin):
                if not at_begin:
                    _climb(problem, approach, fastest, found, top)
                return True
    return False


@inner
def _climb(
    problem: Problem,
    approach: ListedApproach[NumericSolver],
    fastest: FloatArray,
    found: int,
    top: int,
) -> None:
    """Improve `search.best`, from candidate `top`, by better ones less than STRIDE from it."""
    search, step = approach.search.search, STRIDE // 2
    value = measure_at(problem, approach.search.best)
    while step >= 1:
        for side in range(2):
            n = top + step if side else top - step
            if not 0 <= n < found or search.measure[n] <= value:
                continue
            if _leads(problem, approach, fastest, approach.work.p_AG, n, False):
                top, value = n, measure_at(problem, approach.search.best)
                break
        step //= 2


@inner
def _leads(
    problem: Problem,
    approach: ListedApproach[NumericSolver],
    fastest: FloatArray,
    p_AT: FloatArray,
    n: int,
    at_begin: bool,
) -> bool:
    """Return whether the line of a candidate is free; `search.best` is filled if it is.

    Args:
        problem: The scene.
        approach: As for `solvers.approach_pair`.
        fastest: As for `solvers.approach_pair`.
        p_AT: Where the tool is at the candidate, in A [m], shape (3,).
        n: The candidate, which counts as tried.
        at_begin: Whether it is at the begin of the line, not at the goal.
    """
    arm, search, work = approach.search.arm, approach.search.search, approach.work
    at, q = search.at[n], search.curves.q_now
    search.measure[n] = TRIED
    point_between(search.curves, int(at), at - int(at), q)
    if not correct(arm, work.R_AG, p_AT, search.curves, EXACT) or slack_of(arm, q) < 0.0:
        return False
    turn_into_limits(problem, q)
    if at_begin:
        if lead_from(problem, approach, fastest, AT_BEGIN, q) != DONE:
            return False
        for k in range(7):
            q[k] = approach.curve.points[0, k]
        turn_into_limits(problem, q)
    return leads_from(problem, approach, fastest, q)

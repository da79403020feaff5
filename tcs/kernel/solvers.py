"""Reach test and pair scorer of the sweep, for either solver of the inverse kinematics.

A solver is a named tuple of constants and scratch memory: `analytic.search.Search` for an arm with
a closed form, `numeric.search.NumericSolver` for any other. `out_of_reach` and `score_pair` select
the implementation by the type of the solver when numba compiles their caller, so a sweep compiles
the code of its own solver only.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.extending import overload

from tcs.kernel.analytic import pairs as analytic
from tcs.kernel.analytic.scratch import Search, new_search
from tcs.kernel.analytic.solver import is_outside
from tcs.kernel.arrays import FloatArray
from tcs.kernel.contacts import Workspace
from tcs.kernel.numeric import pairs as numeric
from tcs.kernel.numeric.search import NumericSolver, new_numeric_solver
from tcs.kernel.problem import Problem
from tcs.kernel.views import tuple_class

Solver = Search | NumericSolver


def new_solver(problem: Problem) -> Solver:
    """Return the solver of a problem's arm, with scratch memory for one worker."""
    return new_numeric_solver(problem) if is_outside(problem.arm) else new_search()


def out_of_reach(problem: Problem, work: Workspace, solver: Solver) -> int:
    """Return TOO_FAR or JOINT_LIMITS if the pose of the goal alone is out of reach, else REACHED.

    Args:
        problem: The scene.
        work: Workspace with the goal in A.
        solver: Prepared for `score_pair` at this goal.
    """
    if isinstance(solver, Search):
        return analytic.out_of_reach(problem, work, solver)
    return numeric.out_of_reach(problem, work, solver)


def score_pair(
    problem: Problem, work: Workspace, body_A: FloatArray, solver: Solver
) -> tuple[int, int]:
    """Score one goal within reach, base and gripper being free of contact.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        solver: Prepared by `out_of_reach`; `best` is filled with the joint angles [rad] of the
            solution if the goal is reached.

    Returns:
        Reason and contact code.
    """
    if isinstance(solver, Search):
        return analytic.score_pair(problem, work, body_A, solver)
    return numeric.score_pair(problem, work, body_A, solver)


# Not strict: a strict overload would compare the annotations of the arguments too.
@overload(out_of_reach, strict=False)
def _compiled_out_of_reach(problem: Any, work: Any, solver: Any) -> Callable[..., int]:
    if tuple_class(solver) is Search:
        return lambda problem, work, solver: analytic.out_of_reach(problem, work, solver)
    return lambda problem, work, solver: numeric.out_of_reach(problem, work, solver)


@overload(score_pair, strict=False)
def _compiled_score_pair(
    problem: Any, work: Any, body_A: Any, solver: Any
) -> Callable[..., tuple[int, int]]:
    if tuple_class(solver) is Search:
        return lambda problem, work, body_A, solver: analytic.score_pair(
            problem, work, body_A, solver
        )
    return lambda problem, work, body_A, solver: numeric.score_pair(problem, work, body_A, solver)

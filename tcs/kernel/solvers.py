"""Reach test and pair scorer of the sweep, for every solver of the inverse kinematics.

A solver is a named tuple of constants and scratch memory: `analytic.search.Search` for an arm of
seven joints with a closed form, `numeric.search.NumericSolver` for one without, and
`six_joints.pairs.SixJointSolver` for an arm of six joints. `out_of_reach` and `score_pair` select
the implementation by the type of the solver when numba compiles their caller, so a sweep compiles
the code of its own solver only.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numba
from numba.core.typing.templates import AbstractTemplate, infer_global

from tcs.kernel.analytic import pairs as analytic
from tcs.kernel.analytic.scratch import Search, new_search
from tcs.kernel.analytic.solver import is_outside
from tcs.kernel.arrays import FloatArray
from tcs.kernel.contacts import Workspace
from tcs.kernel.numeric import pairs as numeric
from tcs.kernel.numeric.search import NumericSolver, new_numeric_solver
from tcs.kernel.problem import Problem
from tcs.kernel.six_joints import pairs as six_joints
from tcs.kernel.six_joints.pairs import SixJointSolver, new_six_joint_solver
from tcs.kernel.views import tuple_class

Solver = Search | NumericSolver | SixJointSolver


def new_solver(problem: Problem) -> Solver:
    """Return the solver of a problem's arm, with scratch memory for one worker.

    Raises:
        ArmClassError: If the arm has six joints and no closed form.
    """
    if problem.joints == 6:
        return new_six_joint_solver(problem)
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
    if isinstance(solver, SixJointSolver):
        return six_joints.out_of_reach(problem, work, solver)
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
    if isinstance(solver, SixJointSolver):
        return six_joints.score_pair(problem, work, body_A, solver)
    return numeric.score_pair(problem, work, body_A, solver)


class _OfSolver(AbstractTemplate):
    """Types a call by the type of its last argument, the solver.

    As `numba.extending.overload` does, without a function in between.
    """

    implementations: ClassVar[dict[type, Any]]
    """Implementation by the class of the solver."""
    entries: ClassVar[dict[Any, Any]]
    """Compiled implementations by the types of the arguments."""

    def generic(self, args: Any, kws: Any) -> Any:
        """Return the signature of the implementation that fits the types of the arguments."""
        implementation = self.implementations[tuple_class(args[-1])]
        dispatcher: Any = numba.typeof(implementation)
        signature: Any = dispatcher.get_call_type(self.context, args, kws)
        self.entries[signature.args] = dispatcher.get_overload(signature)
        return signature

    def get_impl_key(self, signature: Any) -> Any:
        """Return the compiled implementation of a signature from `generic`."""
        return self.entries[signature.args]


@infer_global(out_of_reach)
class _OutOfReach(_OfSolver):
    implementations: ClassVar[dict[type, Any]] = {
        Search: analytic.out_of_reach,
        NumericSolver: numeric.out_of_reach,
        SixJointSolver: six_joints.out_of_reach,
    }
    entries: ClassVar[dict[Any, Any]] = {}


@infer_global(score_pair)
class _ScorePair(_OfSolver):
    implementations: ClassVar[dict[type, Any]] = {
        Search: analytic.score_pair,
        NumericSolver: numeric.score_pair,
        SixJointSolver: six_joints.score_pair,
    }
    entries: ClassVar[dict[Any, Any]] = {}

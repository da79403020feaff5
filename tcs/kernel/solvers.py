"""Reach test and pair scorer of the sweep, for every solver of the inverse kinematics.

A solver is a named tuple of constants and scratch memory: `analytic.search.Search` for an arm of
seven joints with a closed form, `numeric.search.NumericSolver` for one without,
`six_joints.score_solutions.SixJointSolver` for an arm of six joints and
`five_joints.score_turned.FiveJointSolver` for one of five. `out_of_reach`, `score_pair` and others
select the implementation by the type of the solver when numba compiles their caller, so a sweep
compiles the code of its own solver only.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numba
from numba.core.typing.templates import AbstractTemplate, infer_global

from tcs.kernel.analytic import score_pair as analytic
from tcs.kernel.analytic.scratch import Search, new_search
from tcs.kernel.analytic.solver import is_outside
from tcs.kernel.arrays import FloatArray
from tcs.kernel.base_pose import pose_in_arm_base
from tcs.kernel.cache import inner
from tcs.kernel.contacts import NO_CONTACT, gripper_body_contact
from tcs.kernel.five_joints import score_turned as five_joints
from tcs.kernel.five_joints.score_turned import FiveJointSolver, new_five_joint_solver
from tcs.kernel.numeric import score_curves as numeric
from tcs.kernel.numeric.search import NumericSolver, new_numeric_solver
from tcs.kernel.problem import Problem
from tcs.kernel.scores import GRIPPER_BLOCKED_BY_ROBOT, REACHED, TOO_FAR
from tcs.kernel.six_joints import score_solutions as six_joints
from tcs.kernel.six_joints.score_solutions import SixJointSolver, new_six_joint_solver
from tcs.kernel.views import tuple_class
from tcs.kernel.workspace import Workspace

Solver = Search | NumericSolver | SixJointSolver | FiveJointSolver

THOROUGH = -2.0
"""Bound of `score_pose` that leaves nothing to a quick look."""


def new_solver(problem: Problem) -> Solver:
    """Return the solver of a problem's arm, with scratch memory for one worker.

    Raises:
        ArmClassError: If an arm of six joints cannot be solved, or one of five for goals that leave
            what they leave free.
    """
    if problem.chain.joints == 5:
        return new_five_joint_solver(problem)
    if problem.chain.joints == 6:
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
    if isinstance(solver, FiveJointSolver):
        return five_joints.out_of_reach(problem, work, solver)
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
    if isinstance(solver, FiveJointSolver):
        return five_joints.score_pair(problem, work, body_A, solver)
    return numeric.score_pair(problem, work, body_A, solver)


def quick_look(
    problem: Problem, work: Workspace, body_A: FloatArray, least: float, solver: Solver
) -> tuple[int, int]:
    """Score one goal as `score_pair`, unless that is not worth its time.

    An arm with a closed form tries samples of its free joint; without a free one among them, the
    goal does not count as reached.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        least: Measure that the solution has to exceed; negative for any.
        solver: Prepared by `out_of_reach`; `best` is filled with the joint angles [rad] of the
            solution if there is one.

    Returns:
        Reason and contact code.
    """
    if isinstance(solver, Search):
        return analytic.quick_look(problem, work, body_A, least, solver)
    if isinstance(solver, SixJointSolver):
        return six_joints.quick_look(problem, work, body_A, least, solver)
    if isinstance(solver, FiveJointSolver):
        return five_joints.score_pair(problem, work, body_A, solver)
    return _numeric_look(problem, work, body_A, least, solver)


@inner
def _numeric_look(
    problem: Problem, work: Workspace, body_A: FloatArray, least: float, solver: NumericSolver
) -> tuple[int, int]:
    """Score as `score_pair`, than which nothing is quicker."""
    return numeric.score_pair(problem, work, body_A, solver)


@inner
def _five_joint_look(
    problem: Problem, work: Workspace, body_A: FloatArray, least: float, solver: FiveJointSolver
) -> tuple[int, int]:
    return five_joints.score_pair(problem, work, body_A, solver)


def look_near(
    problem: Problem, work: Workspace, body_A: FloatArray, least: float, solver: Solver
) -> tuple[int, int]:
    """Score one goal as `quick_look`, next to a goal whose solution is known.

    Args:
        problem: The scene.
        work: Workspace with environment, base, gripper and goal in place.
        body_A: The robot's other shapes in A at the current torso level.
        least: Measure that the solution has to exceed.
        solver: Prepared by `out_of_reach`; `best` holds the known solution, and is filled with the
            joint angles [rad] of the new one if there is one.

    Returns:
        Reason and contact code.
    """
    if isinstance(solver, Search):
        return analytic.look_near(problem, work, body_A, least, solver)
    return quick_look(problem, work, body_A, least, solver)


def score_pose(
    problem: Problem,
    work: Workspace,
    body_A: FloatArray,
    state: int,
    torso: int,
    R: FloatArray,
    p: FloatArray,
    least: float,
    near: bool,
    solver: Solver,
) -> tuple[int, int]:
    """Score one tool pose of a goal with freedom, the gripper being free of the environment.

    An arm of five joints turns the tool about the axis that the goals leave free, and checks the
    gripper at each of these poses itself.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        body_A: The robot's other shapes in A at the current torso level.
        state: The environment state.
        torso: The torso level.
        R: Tool orientation in W, shape (3, 3).
        p: Tool position in W [m], shape (3,).
        least: Measure that a quick look has to exceed, negative for any; THOROUGH for a pose whose
            solutions are all to be found.
        near: Whether `solver.best` is the solution of a pose next to this one, from which it is
            enough to look.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.

    Returns:
        Reason and contact code.
    """
    if isinstance(solver, FiveJointSolver):
        return five_joints.score_turned(
            problem, work, body_A, state, torso, R, p, least, near, solver
        )
    return _score_single_pose(problem, work, body_A, state, torso, R, p, least, near, solver)


@inner
def _score_single_pose(
    problem: Problem,
    work: Workspace,
    body_A: FloatArray,
    state: int,
    torso: int,
    R: FloatArray,
    p: FloatArray,
    least: float,
    near: bool,
    solver: Solver,
) -> tuple[int, int]:
    """Score a tool pose as a goal of its own, see `score_pose`."""
    pose_in_arm_base(problem, work, torso, R, p)
    reason = out_of_reach(problem, work, solver)
    if reason == TOO_FAR:
        return reason, NO_CONTACT
    code = gripper_body_contact(problem, work, body_A)
    if code != NO_CONTACT:
        return GRIPPER_BLOCKED_BY_ROBOT, code
    if reason != REACHED:
        return reason, NO_CONTACT
    if near:
        return look_near(problem, work, body_A, least, solver)
    if least > THOROUGH:
        return quick_look(problem, work, body_A, least, solver)
    return score_pair(problem, work, body_A, solver)


class OfSolver(AbstractTemplate):
    """Types a call by the type of its last argument, the solver, unless `solver` finds another.

    As `numba.extending.overload` does, without a function in between.
    """

    implementations: ClassVar[dict[type, Any]]
    """Implementation by the class of the solver."""
    entries: ClassVar[dict[Any, Any]]
    """Compiled implementations by the types of the arguments."""

    @staticmethod
    def solver(args: Any) -> type:
        """Return the class of the solver, given the types of the arguments."""
        return tuple_class(args[-1])

    def generic(self, args: Any, kws: Any) -> Any:
        """Return the signature of the implementation that fits the types of the arguments."""
        implementation = self.implementations[self.solver(args)]
        dispatcher: Any = numba.typeof(implementation)
        signature: Any = dispatcher.get_call_type(self.context, args, kws)
        self.entries[signature.args] = dispatcher.get_overload(signature)
        return signature

    def get_impl_key(self, signature: Any) -> Any:
        """Return the compiled implementation of a signature from `generic`."""
        return self.entries[signature.args]


@infer_global(out_of_reach)
class _OutOfReach(OfSolver):
    implementations: ClassVar[dict[type, Any]] = {
        Search: analytic.out_of_reach,
        NumericSolver: numeric.out_of_reach,
        SixJointSolver: six_joints.out_of_reach,
        FiveJointSolver: five_joints.out_of_reach,
    }
    entries: ClassVar[dict[Any, Any]] = {}


@infer_global(score_pair)
class _ScorePair(OfSolver):
    implementations: ClassVar[dict[type, Any]] = {
        Search: analytic.score_pair,
        NumericSolver: numeric.score_pair,
        SixJointSolver: six_joints.score_pair,
        FiveJointSolver: five_joints.score_pair,
    }
    entries: ClassVar[dict[Any, Any]] = {}


@infer_global(score_pose)
class _ScorePose(OfSolver):
    implementations: ClassVar[dict[type, Any]] = {
        Search: _score_single_pose,
        NumericSolver: _score_single_pose,
        SixJointSolver: _score_single_pose,
        FiveJointSolver: five_joints.score_turned,
    }
    entries: ClassVar[dict[Any, Any]] = {}


@infer_global(look_near)
class _LookNear(OfSolver):
    implementations: ClassVar[dict[type, Any]] = {
        Search: analytic.look_near,
        NumericSolver: _numeric_look,
        SixJointSolver: six_joints.quick_look,
        FiveJointSolver: _five_joint_look,
    }
    entries: ClassVar[dict[Any, Any]] = {}


@infer_global(quick_look)
class _QuickLook(OfSolver):
    implementations: ClassVar[dict[type, Any]] = {
        Search: analytic.quick_look,
        NumericSolver: _numeric_look,
        SixJointSolver: six_joints.quick_look,
        FiveJointSolver: _five_joint_look,
    }
    entries: ClassVar[dict[Any, Any]] = {}
